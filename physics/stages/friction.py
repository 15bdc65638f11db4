"""Coulomb friction with history: the tangential spring of Cundall and Strack.

A contact remembers how far it has been sheared, xi. The trial force -k_t xi - c_t u is cut to the
cone |f| <= mu N. Where it is cut, xi becomes what would give the cut force at the present speed,
xi = -(f + c_t u)/k_t (Luding), so the force is continuous when sliding ends.

That rule also fixes where a body comes to rest. Sliding ends at the speed u1 = c_t mu g / k_t with
xi1 = (mu g m - c_t u1) / k_t, and the body then rests where xi is zero, that is -xi1 further on.
Coulomb's law says u1^2 / (2 mu g). Both agree if c_t^2 = 2 k_t m, damping at 1/sqrt(2) of critical,
for a body that doesn't rock. Rocking is a spring in series whose share depends on the shape: it
leaves an error of length, at most about half the sink for a cube, whatever the speed
(`python -m benchmarks.accuracy`).
"""

import math

from physics.jit import stage


def tangential_coefficients(
    stiffness: float, pair_mass: float, shear_mass: float
) -> tuple[float, float]:
    """Shear stiffness N/m and damping N s/m of a pair.

    Args:
        stiffness: N/m, normal.
        pair_mass: kg, reduced mass.
        shear_mass: kg that a tangential force at the surface feels; turning makes it less than the
            pair mass, and the shear spring that much softer, so that no tangential mode is faster
            than the normal ones.
    """
    shear_stiffness = 2.0 / 3.0 * stiffness * shear_mass / pair_mass
    return shear_stiffness, math.sqrt(2.0 * shear_stiffness * pair_mass)


@stage
def friction_force(normal, ux, uy, uz, k, c, mu, h, sx, sy, sz):
    """Tangential force x y z [N] of a sample with the whole pair's stiffness, and its new shear.

    Args:
        normal: N, the normal force.
        ux: m/s, tangential velocity.
        uy: likewise.
        uz: likewise.
        k: N/m, shear stiffness.
        c: N s/m, shear damping.
        mu: coefficient of friction.
        h: s.
        sx: m, shear before this step, in the tangent plane.
        sy: likewise.
        sz: likewise.
    """
    sx += h * ux
    sy += h * uy
    sz += h * uz
    fx = -k * sx - c * ux
    fy = -k * sy - c * uy
    fz = -k * sz - c * uz
    cut = min(1.0, mu * normal / math.sqrt(fx * fx + fy * fy + fz * fz + 1e-60))
    fx *= cut
    fy *= cut
    fz *= cut
    back = -1.0 / k if normal > 0.0 else 0.0
    return fx, fy, fz, back * (fx + c * ux), back * (fy + c * uy), back * (fz + c * uz)
