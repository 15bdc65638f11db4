"""Gravity: a uniform field exerts no torque. It comes first and so clears the last step's sums."""

from physics.compiler.jit import LANES, stage


@stage
def gravity(model, workspace):
    """Sets the force on every dynamic body to its weight and the torque to zero."""
    for m in range(model.dynamic.shape[0]):
        solid = workspace.solid[m]
        weight, force, torque = solid.weight, solid.force, solid.torque
        for axis in range(3):
            # one array a loop: LLVM copies and clears them as a whole
            for i in range(LANES):
                force[axis, i] = weight[axis, i]
            for i in range(LANES):
                torque[axis, i] = 0.0
