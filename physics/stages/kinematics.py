"""Frames of all solids: rotation matrix, position, velocity and angular velocity.

One row a solid of a scratch array [solids, FRAME]: columns 0-8 the rotation matrix, then c, v and
omega in the world frame, and how far a surface point has moved at most in the last drift.
"""

from functools import cache

from physics.features import GENERAL, NO_ROTATION
from physics.jit import kernel, stage
from physics.rotation import rotation_entries

CENTER, VELOCITY, SPIN, PATH, FRAME = 9, 12, 15, 18, 19


@kernel
def place(frame, i, qx, qy, qz, qw, x, y, z):
    """Writes a solid's pose."""
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation_entries(qx, qy, qz, qw)
    frame[i, 0] = r00
    frame[i, 1] = r01
    frame[i, 2] = r02
    frame[i, 3] = r10
    frame[i, 4] = r11
    frame[i, 5] = r12
    frame[i, 6] = r20
    frame[i, 7] = r21
    frame[i, 8] = r22
    frame[i, CENTER] = x
    frame[i, CENTER + 1] = y
    frame[i, CENTER + 2] = z


@kernel
def place_statics(model, frame):
    """Writes the rows of the statics, once for all worlds and steps."""
    movers = model.mover.shape[0]
    for s in range(model.static.shape[0]):
        p = model.static
        place(frame, movers + s, p[s, 3], p[s, 4], p[s, 5], p[s, 6], p[s, 0], p[s, 1], p[s, 2])
        for c in range(VELOCITY, FRAME):
            frame[movers + s, c] = 0.0


@stage
def turned(frame, i, x, y, z):
    """A vector of solid i's own frame in the world frame."""
    return (
        frame[i, 0] * x + frame[i, 1] * y + frame[i, 2] * z,
        frame[i, 3] * x + frame[i, 4] * y + frame[i, 5] * z,
        frame[i, 6] * x + frame[i, 7] * y + frame[i, 8] * z,
    )


@stage
def turned_back(frame, i, x, y, z):
    """A vector of the world frame in solid i's own."""
    return (
        frame[i, 0] * x + frame[i, 3] * y + frame[i, 6] * z,
        frame[i, 1] * x + frame[i, 4] * y + frame[i, 7] * z,
        frame[i, 2] * x + frame[i, 5] * y + frame[i, 8] * z,
    )


@kernel
def spin_of(x, y, z, w, jx, jy, jz, lx, ly, lz):
    """Omega = R J0^-1 R^T L of a body with quaternion x y z w; jx, jy, jz are 1/moments."""
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation_entries(x, y, z, w)
    bx = jx * (r00 * lx + r10 * ly + r20 * lz)
    by = jy * (r01 * lx + r11 * ly + r21 * lz)
    bz = jz * (r02 * lx + r12 * ly + r22 * lz)
    return (
        r00 * bx + r01 * by + r02 * bz,
        r10 * bx + r11 * by + r12 * bz,
        r20 * bx + r21 * by + r22 * bz,
    )


@cache
def make_kinematics(features):
    """Stage that writes the rows of the movers of one world."""
    rotation = features.rotation

    @stage
    def kinematics(model, state, frame, w):
        for i in range(model.mover.shape[0]):
            m, constants = state.mover[w, i], model.mover[i]
            x, y = m.orientation[0], m.orientation[1]
            z, s = m.orientation[2], m.orientation[3]
            place(frame, i, x, y, z, s, m.position[0], m.position[1], m.position[2])
            frame[i, VELOCITY] = constants.inverse_mass * m.momentum[0]
            frame[i, VELOCITY + 1] = constants.inverse_mass * m.momentum[1]
            frame[i, VELOCITY + 2] = constants.inverse_mass * m.momentum[2]
            ox = 0.0
            oy = 0.0
            oz = 0.0
            if rotation != NO_ROTATION and constants.turns:
                L, j = m.angular_momentum, constants.inverse_inertia
                lx, ly, lz = L[0], L[1], L[2]
                jx = j[0]
                if rotation == GENERAL:
                    ox, oy, oz = spin_of(x, y, z, s, jx, j[1], j[2], lx, ly, lz)
                else:
                    ox, oy, oz = jx * lx, jx * ly, jx * lz
            frame[i, SPIN] = ox
            frame[i, SPIN + 1] = oy
            frame[i, SPIN + 2] = oz

    return kinematics
