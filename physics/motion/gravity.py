"""Gravity: a uniform field makes no torque. It comes first and so clears the last step's sums."""

from physics.jit import LANES, at, stage


@stage
def gravity(model, work):
    """Sets every mover's force to its weight and its torque to zero."""
    for m in range(model.mover.shape[0]):
        force, torque, weight = work.solid[m].force, work.solid[m].torque, model.mover[m].weight
        wx, wy, wz = weight[0], weight[1], weight[2]
        for i in range(LANES):
            force[0, i] = at(wx, i)
            force[1, i] = at(wy, i)
            force[2, i] = at(wz, i)
            torque[0, i] = 0.0
            torque[1, i] = 0.0
            torque[2, i] = 0.0
