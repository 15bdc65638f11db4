"""The servo of a driven tool: a spring and damper to a moving reference, its force limited."""

from functools import cache

from physics.jit import kernel, stage
from physics.stages.kinematics import CENTER, VELOCITY


@kernel
def servo_force(constants, ahead, faster):
    """Force in N along an axis; the reference is `ahead` by m and `faster` by m/s."""
    pull = constants.servo_stiffness * ahead + constants.servo_damping * faster
    return min(max(pull, -constants.force_limit), constants.force_limit)


@cache
def make_drives(features):
    """Stage that moves the references on and adds the servos' forces."""
    present = features.drives

    @stage
    def drives(model, state, frame, w, h):
        if present:
            for i in range(model.mover.shape[0]):
                m, constants = state.mover[w, i], model.mover[i]
                if constants.turns:
                    continue
                # axis by axis and not in a loop: three turns would become a masked vector store,
                # which the next load has to wait for
                vx, vy, vz = (
                    m.reference_velocity[0],
                    m.reference_velocity[1],
                    m.reference_velocity[2],
                )
                x = m.reference[0] + h * vx
                y = m.reference[1] + h * vy
                z = m.reference[2] + h * vz
                m.reference[0] = x
                m.reference[1] = y
                m.reference[2] = z
                ux, uy, uz = frame[i, VELOCITY], frame[i, VELOCITY + 1], frame[i, VELOCITY + 2]
                m.force[0] += servo_force(constants, x - frame[i, CENTER], vx - ux)
                m.force[1] += servo_force(constants, y - frame[i, CENTER + 1], vy - uy)
                m.force[2] += servo_force(constants, z - frame[i, CENTER + 2], vz - uz)

    return drives
