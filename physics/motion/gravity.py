"""Gravity: a uniform field exerts no torque. It comes first and so clears the last step's sums."""

from physics.compiler.jit import LANES, at, stage


@stage
def gravity(model, workspace):
    """Sets the force on every dynamic body to its weight and the torque to zero."""
    for m in range(model.dynamic.shape[0]):
        weight, solid = model.dynamic[m].weight, workspace.solid[m]
        force, torque = solid.force, solid.torque
        wx, wy, wz = weight[0], weight[1], weight[2]
        for i in range(LANES):
            force[0, i] = at(wx, i)
            force[1, i] = at(wy, i)
            force[2, i] = at(wz, i)
            torque[0, i] = 0.0
            torque[1, i] = 0.0
            torque[2, i] = 0.0
