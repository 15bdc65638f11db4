"""Semi-implicit Euler: a whole kick, then a drift with the new momenta. First order.

    P' = P + h F(c, P),   c' = c + h P'/m,   L' = L + h tau,   q' = exp(h omega / 2) (x) q

with omega = J^-1 L' of the orientation at the start of the step. Momenta are those of the end of
the step, as positions are, and the new forces see both. Translation is that of kick-drift-kick with
momenta half a step later, so contacts and servos are as stable, and the energy of an oscillator
stays bounded. Free rotation about three different moments gains or loses energy step by step: L
stays, omega does not belong to the middle of the step.
"""

from functools import cache

from physics.compiler.jit import stage
from physics.model.features import GENERAL
from physics.motion.kinematics import angular_velocity_of


@cache
def make_euler_rotation(rotation, rotate_quaternion):
    """Formula of the exponential map: takes and returns what `make_midpoint_rotation` does."""

    @stage
    def euler_rotation(x, y, z, w, jx, jy, jz, lx, ly, lz, time):
        if rotation == GENERAL:
            ox, oy, oz = angular_velocity_of(x, y, z, w, jx, jy, jz, lx, ly, lz)
        else:
            ox, oy, oz = jx * lx, jx * ly, jx * lz
        x, y, z, w = rotate_quaternion(x, y, z, w, time * ox, time * oy, time * oz)
        return x, y, z, w, ox, oy, oz

    return euler_rotation
