"""A side's geometry in the frame of its surface, where the surface is at rest.

A scratch row holds it: rotation, offset, velocity and spin of the owner relative to the surface,
then the sums of force, torque and normal force that the loops over contacts leave behind.
"""

from physics.jit import stage
from physics.shapes import PLANE
from physics.stages.kinematics import CENTER, SPIN, VELOCITY, turned_back

OFFSET, SPEED, TURNING, FORCE, TORQUE, NORMAL_SUM, RELATIVE = 9, 12, 15, 18, 21, 24, 25


@stage
def relative_pose(model, frame, rel, k):
    """Rotation and offset of side k's owner in the frame of its surface."""
    side = model.side[k]
    a, b = side.owner, side.surface
    if side.kind == PLANE:
        # one by one: a vector load of what was just stored in single numbers has to wait for them
        rel[0] = frame[a, 0]
        rel[1] = frame[a, 1]
        rel[2] = frame[a, 2]
        rel[3] = frame[a, 3]
        rel[4] = frame[a, 4]
        rel[5] = frame[a, 5]
        rel[6] = frame[a, 6]
        rel[7] = frame[a, 7]
        rel[8] = frame[a, 8]
        rel[OFFSET] = frame[a, CENTER]
        rel[OFFSET + 1] = frame[a, CENTER + 1]
        rel[OFFSET + 2] = frame[a, CENTER + 2] - side.core[0]
    else:
        rel[0], rel[3], rel[6] = turned_back(frame, b, frame[a, 0], frame[a, 3], frame[a, 6])
        rel[1], rel[4], rel[7] = turned_back(frame, b, frame[a, 1], frame[a, 4], frame[a, 7])
        rel[2], rel[5], rel[8] = turned_back(frame, b, frame[a, 2], frame[a, 5], frame[a, 8])
        rel[OFFSET], rel[OFFSET + 1], rel[OFFSET + 2] = turned_back(
            frame,
            b,
            frame[a, CENTER] - frame[b, CENTER],
            frame[a, CENTER + 1] - frame[b, CENTER + 1],
            frame[a, CENTER + 2] - frame[b, CENTER + 2],
        )


@stage
def relative_motion(model, frame, rel, k):
    """Velocity and spin of the owner as seen from the surface; clears the sums."""
    side = model.side[k]
    a, b = side.owner, side.surface
    if side.kind == PLANE:
        rel[SPEED] = frame[a, VELOCITY]
        rel[TURNING] = frame[a, SPIN]
        rel[SPEED + 1] = frame[a, VELOCITY + 1]
        rel[TURNING + 1] = frame[a, SPIN + 1]
        rel[SPEED + 2] = frame[a, VELOCITY + 2]
        rel[TURNING + 2] = frame[a, SPIN + 2]
    else:
        dx = frame[a, CENTER] - frame[b, CENTER]
        dy = frame[a, CENTER + 1] - frame[b, CENTER + 1]
        dz = frame[a, CENTER + 2] - frame[b, CENTER + 2]
        wx, wy, wz = frame[b, SPIN], frame[b, SPIN + 1], frame[b, SPIN + 2]
        rel[SPEED], rel[SPEED + 1], rel[SPEED + 2] = turned_back(
            frame,
            b,
            frame[a, VELOCITY] - frame[b, VELOCITY] - (wy * dz - wz * dy),
            frame[a, VELOCITY + 1] - frame[b, VELOCITY + 1] - (wz * dx - wx * dz),
            frame[a, VELOCITY + 2] - frame[b, VELOCITY + 2] - (wx * dy - wy * dx),
        )
        rel[TURNING], rel[TURNING + 1], rel[TURNING + 2] = turned_back(
            frame, b, frame[a, SPIN] - wx, frame[a, SPIN + 1] - wy, frame[a, SPIN + 2] - wz
        )
    rel[FORCE] = 0.0
    rel[FORCE + 1] = 0.0
    rel[FORCE + 2] = 0.0
    rel[TORQUE] = 0.0
    rel[TORQUE + 1] = 0.0
    rel[TORQUE + 2] = 0.0
    rel[NORMAL_SUM] = 0.0
