"""Gravity: a uniform field makes no torque. It comes first and so clears the last step's sums."""

from physics.jit import stage


@stage
def gravity(model, state, w):
    """Sets every mover's force to its weight and its torque to zero."""
    for i in range(model.mover.shape[0]):
        m = state.mover[w, i]
        m.force[0] = model.mover[i].weight[0]
        m.torque[0] = 0.0
        m.force[1] = model.mover[i].weight[1]
        m.torque[1] = 0.0
        m.force[2] = model.mover[i].weight[2]
        m.torque[2] = 0.0
