"""Servos of drives: a spring and damper between the drive and a moving set point, force-limited.

A gripper is one mechanism. Along y, the axis along which it closes, the servo forces on its two
fingers are the carriage's (the same on both) plus the grip's (opposite on both), and each is
limited separately. Fingers with independent limits would have no restoring force towards the middle
once both are saturated. Along x and z the fingers move as one solid: forces on either act on both,
half each.
"""

from physics.compiler.jit import LANES, stage
from physics.model.features import cached_by_features

CLOSING = 1  # axis along which grippers close

# fraction of a substep by which the end of a set point's motion may miss the end of a substep:
# frames are cut into substeps up to round-off
_SAME_STEP = 1e-9


@cached_by_features
def make_drives(features):
    """Stage that moves the set points and adds the servo forces."""
    present, gripper = features.drives, features.gripper

    @stage
    def drives(model, workspace, h):
        if present:
            for m in range(model.dynamic.shape[0]):
                if model.dynamic[m].is_body:
                    continue
                solid, constants = workspace.solid[m], model.dynamic[m]
                stiffness, damping = constants.servo_stiffness, constants.servo_damping
                limit, partner = constants.force_limit, constants.gripper_partner
                c, v, force = solid.position, solid.velocity, solid.force
                reference, velocity = solid.reference, solid.reference_velocity
                left, per_h = solid.reference_time, 1.0 / h if h > 0.0 else 0.0
                for axis in range(3):
                    grips = gripper and partner >= 0 and axis == CLOSING
                    most = 1e300 if grips else limit
                    for i in range(LANES):
                        # fraction of the substep for which the set point still moves
                        whole = left[i] > (1.0 - _SAME_STEP) * h
                        moving = 1.0 if whole else left[i] * per_h
                        ahead = reference[axis, i] + h * (moving * velocity[axis, i])
                        reference[axis, i] = ahead
                        pull = stiffness * (ahead - c[axis, i])
                        pull += damping * (moving * velocity[axis, i] - v[axis, i])
                        force[axis, i] += min(max(pull, -most), most)
                for i in range(LANES):
                    left[i] = max(left[i] - h, 0.0)
                if gripper and partner >= 0 and partner < m:
                    other = workspace.solid[partner].force
                    limit_forces(other, force, limit, constants.grip_limit)

    return drives


@stage
def limit_forces(force, other, limit, grip_limit):
    """Limits the servo forces on a gripper's two fingers along y; no other force is in them yet."""
    for i in range(LANES):
        one, two = force[CLOSING, i], other[CLOSING, i]
        carriage = min(max(0.5 * (one + two), -limit), limit)
        grip = min(max(0.5 * (one - two), -grip_limit), grip_limit)
        force[CLOSING, i] = carriage + grip
        other[CLOSING, i] = carriage - grip


@stage
def average(values, others):
    """Replaces two fingers' vectors by their mean, except along the closing axis."""
    for axis in range(3):
        if axis != CLOSING:
            for i in range(LANES):
                mean = 0.5 * (values[axis, i] + others[axis, i])
                values[axis, i] = mean
                others[axis, i] = mean


@cached_by_features
def make_finger_coupling(features):
    """Stage that makes one solid of a gripper's fingers: forces, and momenta after collisions."""
    gripper = features.gripper

    @stage
    def couple_fingers(model, workspace, drifted):
        if gripper:
            for m in range(model.dynamic.shape[0]):
                partner = model.dynamic[m].gripper_partner
                if partner > m:
                    one, other = workspace.solid[m], workspace.solid[partner]
                    average(one.force, other.force)
                    if drifted > 0.0:
                        average(one.momentum, other.momentum)

    return couple_fingers


@cached_by_features
def make_finger_velocity_coupling(features):
    """Stage that makes one solid of a gripper's fingers while impulses change their velocities."""
    gripper = features.gripper

    @stage
    def couple_finger_velocities(model, workspace):
        if gripper:
            for m in range(model.dynamic.shape[0]):
                partner = model.dynamic[m].gripper_partner
                if partner > m:
                    average(workspace.solid[m].velocity, workspace.solid[partner].velocity)

    return couple_finger_velocities
