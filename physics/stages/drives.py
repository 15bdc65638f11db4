"""The servo of a driven tool: a spring and damper to a moving reference, its force limited."""

from functools import cache

from physics.jit import LANES, stage


@cache
def make_drives(features):
    """Stage that moves the references on and adds the servos' forces."""
    present = features.drives

    @stage
    def drives(model, work, h):
        if present:
            for m in range(model.mover.shape[0]):
                if model.mover[m].turns:
                    continue
                solid, constants = work.solid[m], model.mover[m]
                c, v, force = solid.position, solid.velocity, solid.force
                reference, wanted = solid.reference, solid.reference_velocity
                stiffness, damping = constants.servo_stiffness, constants.servo_damping
                limit = constants.force_limit
                for axis in range(3):
                    for i in range(LANES):
                        ahead = reference[axis, i] + h * wanted[axis, i]
                        reference[axis, i] = ahead
                        pull = stiffness * (ahead - c[axis, i])
                        pull += damping * (wanted[axis, i] - v[axis, i])
                        force[axis, i] += min(max(pull, -limit), limit)

    return drives
