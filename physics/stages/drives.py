"""The servo of a driven tool: a spring and damper to a moving reference, its force limited."""

from functools import cache

from physics.jit import stage
from physics.stages.kinematics import CENTER, VELOCITY


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
                limit = constants.force_limit
                for c in range(3):
                    speed = m.reference_velocity[c]
                    m.reference[c] += h * speed
                    pull = constants.servo_stiffness * (
                        m.reference[c] - frame[i, CENTER + c]
                    ) + constants.servo_damping * (speed - frame[i, VELOCITY + c])
                    m.force[c] += min(max(pull, -limit), limit)

    return drives
