"""Kick-drift-kick for translation, the midpoint rule for rotation: second order.

The state is (x, q, P, L): position, quaternion, momentum, angular momentum. A substep is half a
kick, a drift, new forces, half a kick. Forces that depend on velocity see the half-step velocity of
the drift. Without torque L stays bitwise constant while omega = J^-1 L does not: the midpoint rule
rotates by the omega that belongs to the orientation half a step ahead.

The omega half a step ahead is unknown. Rotation by half a step of the present omega gives o1, that
of the explicit midpoint rule; rotation by half a step of o1 gives o2. Further iterates converge to
the implicit rule, whose energy error stays bounded. The energy errors of o1 and o2 have the same
size and opposite signs, up to terms of higher order: for the asymmetric top of the tests and steps
of 1 ms, +1.99e-6 and -1.99e-6 after 10^6 steps. So their mean is used. The energy then stays within
2e-10 for 10^7 steps; with the implicit rule it swings by 1.7e-7 (docs/decisions).

The midpoint rule does not conserve energy where L would rotate the body by a large angle about its
slimmest axis. Such a rotation is exact for bodies with two equal moments, and made in parts for
others (see far_rotation.py; evidence: docs/decisions).
"""

from functools import cache

from physics.compiler.jit import stage
from physics.model.features import GENERAL
from physics.motion.kinematics import angular_velocity_of


@cache
def make_midpoint_rotation(rotation, rotate_quaternion):
    """Formula of the midpoint rule: returns the new quaternion and the omega it used.

    `jx`, `jy`, `jz` are the inverses of the principal moments, 1/(kg m^2). `rotation` is
    ISOTROPIC (equal moments) or GENERAL. `rotate_quaternion` is that of small angles
    or, for any angle, `rotate_quaternion_far`.
    """

    @stage
    def midpoint_rotation(x, y, z, w, jx, jy, jz, lx, ly, lz, time):
        if rotation == GENERAL:
            half = 0.5 * time
            ox, oy, oz = angular_velocity_of(x, y, z, w, jx, jy, jz, lx, ly, lz)
            hx, hy, hz, hw = rotate_quaternion(x, y, z, w, half * ox, half * oy, half * oz)
            px, py, pz = angular_velocity_of(hx, hy, hz, hw, jx, jy, jz, lx, ly, lz)
            hx, hy, hz, hw = rotate_quaternion(x, y, z, w, half * px, half * py, half * pz)
            ox, oy, oz = angular_velocity_of(hx, hy, hz, hw, jx, jy, jz, lx, ly, lz)
            ox, oy, oz = 0.5 * (px + ox), 0.5 * (py + oy), 0.5 * (pz + oz)
        else:  # equal moments: omega is parallel to L
            ox, oy, oz = jx * lx, jx * ly, jx * lz
        x, y, z, w = rotate_quaternion(x, y, z, w, time * ox, time * oy, time * oz)
        return x, y, z, w, ox, oy, oz

    return midpoint_rotation
