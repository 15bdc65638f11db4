"""Servos of driven tools: a spring and damper to a moving reference, their force limited.

A gripper is one mechanism. Along y, where it closes, the servos' forces on its two fingers are the
carriage's, the same on both, and the grip's, opposite on both. Each is limited by itself; fingers
limited one by one would have nothing to centre them once both are at their limit. Along x and z
the fingers are one solid: whatever acts on either acts on both, half and half.
"""

from functools import cache

from physics.jit import LANES, stage

CLOSING = 1  # axis along which grippers close


@cache
def make_drives(features):
    """Stage that moves the references on and adds the servos' forces."""
    present, gripper = features.drives, features.gripper

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
                limit, twin = constants.force_limit, constants.twin
                for axis in range(3):
                    grips = gripper and twin >= 0 and axis == CLOSING
                    most = 1e300 if grips else limit
                    for i in range(LANES):
                        ahead = reference[axis, i] + h * wanted[axis, i]
                        reference[axis, i] = ahead
                        pull = stiffness * (ahead - c[axis, i])
                        pull += damping * (wanted[axis, i] - v[axis, i])
                        force[axis, i] += min(max(pull, -most), most)
                if gripper and twin >= 0 and twin < m:
                    limit_forces(work.solid[twin].force, force, limit, constants.grip_limit)

    return drives


@stage
def limit_forces(force, other, limit, grip_limit):
    """Limits what the servos, so far alone, give a gripper's two fingers along y."""
    for i in range(LANES):
        one, two = force[CLOSING, i], other[CLOSING, i]
        carried = min(max(0.5 * (one + two), -limit), limit)
        gripped = min(max(0.5 * (one - two), -grip_limit), grip_limit)
        force[CLOSING, i] = carried + gripped
        other[CLOSING, i] = carried - gripped


@stage
def share(values, others):
    """Gives both fingers the mean of what they have, but along the closing axis."""
    for axis in range(3):
        if axis != CLOSING:
            for i in range(LANES):
                mean = 0.5 * (values[axis, i] + others[axis, i])
                values[axis, i] = mean
                others[axis, i] = mean


@cache
def make_join(features):
    """Stage that makes one solid of the fingers: of forces, and of collisions' momenta if any."""
    gripper = features.gripper

    @stage
    def join(model, work, drifted):
        if gripper:
            for m in range(model.mover.shape[0]):
                twin = model.mover[m].twin
                if twin > m:
                    share(work.solid[m].force, work.solid[twin].force)
                    if drifted > 0.0:
                        share(work.solid[m].momentum, work.solid[twin].momentum)

    return join


@cache
def make_join_speeds(features):
    """Stage that makes one solid of the fingers while impulses change their speeds."""
    gripper = features.gripper

    @stage
    def join_speeds(model, work):
        if gripper:
            for m in range(model.mover.shape[0]):
                twin = model.mover[m].twin
                if twin > m:
                    share(work.solid[m].velocity, work.solid[twin].velocity)

    return join_speeds
