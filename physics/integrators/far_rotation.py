"""Rotation by a large angle in one substep: exactly, or in parts.

Without torque a body with two equal moments I and a third moment I3 about its axis e precesses
steadily: it turns by L t / I about the world's direction of its angular momentum L, while it turns
by (1/I3 - 1/I) (L . e) t about e itself. Both are rotations by constant rates, so this holds for
any angle (Landau and Lifshitz, Mechanics, section 33).

For other bodies the midpoint rule is applied in up to MOST_PARTS parts, each of at most
SMALL_ROTATION about the slimmest axis, see `midpoint`.
"""

import math
from functools import cache

from physics.compiler.jit import stage
from physics.integrators.euler import make_euler_rotation
from physics.integrators.midpoint import make_midpoint_rotation
from physics.model.features import GENERAL
from physics.rotation import SMALL_ROTATION, compose, rotate_quaternion_far, rotation_entries

# largest number of parts of a rotation; beyond 30 rad per substep they exceed SMALL_ROTATION
MOST_PARTS = 100.0
# relative difference of moments that count as equal
_EQUAL = 1e-12


@stage
def small_rotation_limit(jx, jy, jz, time):
    """Square of the angular momentum up to which a rotation counts as small."""
    most = time * max(jx, jy, jz)
    return SMALL_ROTATION * SMALL_ROTATION / (most * most)


@stage
def symmetry_axis(jx, jy, jz):
    """The body axis 0, 1 or 2 about which the other two moments are equal; -1 if none is."""
    same = _EQUAL * max(jx, jy, jz)
    if abs(jx - jy) <= same:
        return 2
    if abs(jy - jz) <= same:
        return 0
    return 1 if abs(jz - jx) <= same else -1


@stage
def rotate_symmetric(x, y, z, w, axis, along, across, lx, ly, lz, time):
    """Orientation after a rotation without torque, and an upper bound of its speed in rad/s.

    `along` and `across` are the inverse moments about the body's axis `axis` and about the others.
    """
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation_entries(x, y, z, w)
    own = r02 * lx + r12 * ly + r22 * lz
    own = r01 * lx + r11 * ly + r21 * lz if axis == 1 else own
    own = r00 * lx + r10 * ly + r20 * lz if axis == 0 else own
    spin = (along - across) * own
    half = 0.5 * time * spin
    s = math.sin(half)
    x, y, z, w = compose(
        s if axis == 0 else 0.0,
        s if axis == 1 else 0.0,
        s if axis == 2 else 0.0,
        math.cos(half), x, y, z, w,
    )  # fmt: skip
    turn = time * across
    x, y, z, w = rotate_quaternion_far(x, y, z, w, turn * lx, turn * ly, turn * lz)
    return x, y, z, w, across * (abs(lx) + abs(ly) + abs(lz)) + abs(spin)


@cache
def make_far_rotation(rotation, euler):
    """Formula for a rotation by more than SMALL_ROTATION: see `rotate_symmetric`."""
    general = rotation == GENERAL and not euler
    make_rotation = make_euler_rotation if euler else make_midpoint_rotation
    rotated = make_rotation(rotation, rotate_quaternion_far)

    @stage
    def far_rotation(x, y, z, w, jx, jy, jz, lx, ly, lz, time):
        axis, parts, fastest = -1, 1, 0.0
        # equal moments need one part
        if general and not jx == jy == jz:
            axis = symmetry_axis(jx, jy, jz)
            square = small_rotation_limit(jx, jy, jz, time)
            far_by = math.sqrt((lx * lx + ly * ly + lz * lz) / square)
            if axis < 0 and far_by > 1.0:  # NaN, which ceil could not convert, stays one part
                parts = math.ceil(min(MOST_PARTS, far_by))
        if axis >= 0:
            along = jx if axis == 0 else (jy if axis == 1 else jz)
            across = jx if axis == 2 else (jy if axis == 0 else jz)
            x, y, z, w, fastest = rotate_symmetric(
                x, y, z, w, axis, along, across, lx, ly, lz, time
            )
        else:
            for _ in range(parts):
                x, y, z, w, ox, oy, oz = rotated(x, y, z, w, jx, jy, jz, lx, ly, lz, time / parts)
                speed = abs(ox) + abs(oy) + abs(oz)
                fastest = fastest if speed <= fastest else speed  # keeps NaN
        return x, y, z, w, fastest

    return far_rotation
