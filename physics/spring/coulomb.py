"""Coulomb friction with history: the tangential spring of Cundall and Strack.

A contact remembers how far it has been sheared, xi. The trial force -k_t xi - c_t u is cut to the
cone |f| <= mu N. Where it is cut, xi becomes what would give the cut force at the present speed,
xi = -(f + c_t u)/k_t (Luding), so the force is continuous when sliding ends.

Where c_t u exceeds the cone, that shear points backwards, and nothing has paid for its energy. In a
collision N starts at zero, so all slip is too fast: remembered as it is, the shear held friction
back while N rose, and was returned as energy that the solids never had, up to 11 % when tried. Nor
is a shear that slip has paid for to be returned: a rigid body sticks, it doesn't spring back along
the surface. So contacts that collide have friction by damping alone, within the cone; those that
last remember, as a body at rest and one that slides to rest need it. The normal law tells them
apart by their impact speed, over that of a contact that rests under its load: see `rest` there.

That rule also fixes where a body comes to rest. With a = mu g and half-step speeds, sliding ends
in the step whose speed u falls below c a / k_t, at the shear xi = (m a - c u_before) / k_t, and the
body then rests where xi is zero: -xi further on. Meanwhile a body pitched forward by the force
under it swings back, and its centre with it, by m a h^2 / k_rock: h is its height over the face,
k_rock the stiffness of that face against rocking. Coulomb's law leaves it u^2 / (2 a) to go. All
agree, in the mean over where in a step sliding ends, if

    c^2 + dt k_t c - 2 k_t m (1 + k_t h^2 / k_rock) - (dt k_t)^2 / 12 = 0,

which `tangential_coefficients` solves for c: near 1/sqrt(2) of critical damping. What is left is a
length of at most a dt^2 / 8, and for a box that lies on another than its widest face, that face's
share of rocking (`python -m benchmarks.accuracy`).

Resistance against rolling and spinning is the same law for the relative spin across the normal and
along it, with torques up to a length times the normal force: a rolling ball slows by 5/7 g c/R.

Viscous friction, the lecture's f = -eta v, is kept within the cone too. It has no memory and so
holds nothing still; that makes it the cheapest.
"""

import math

import numpy as np

from physics.jit import stage

Array = np.ndarray

# cones of damping beyond the first that a lasting contact may remember: a body that slides to rest
# needs several on its rear edge, which bears a third of the mean
_AT_REST = 10.0


@stage
def friction_force(normal, ux, uy, uz, k, c, mu, h, sx, sy, sz, rest):
    """Tangential force of a sample with the whole pair's stiffness, and what it remembers.

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
        rest: 1 for a contact that lasts, falling to 0 for one that collides.

    Returns:
        Force x y z N and shear x y z m.
    """
    sx += h * ux
    sy += h * uy
    sz += h * uz
    fx = -k * sx - c * ux
    fy = -k * sy - c * uy
    fz = -k * sz - c * uz
    inverse = 1.0 / math.sqrt(fx * fx + fy * fy + fz * fz + 1e-60)
    limit = mu * normal
    cut = min(1.0, limit * inverse)
    fx *= cut
    fy *= cut
    fz *= cut
    # forgotten after the step, not before: the trial force need not wait for the normal law
    lasting = rest * rest
    back = -lasting / k if normal > 0.0 else 0.0
    damped = c * min(1.0, (1.0 + _AT_REST * lasting) * limit * inverse)
    sx = back * (fx + damped * ux)
    sy = back * (fy + damped * uy)
    sz = back * (fz + damped * uz)
    return fx, fy, fz, sx, sy, sz


@stage
def viscous_force(normal, ux, uy, uz, c, mu):
    """Tangential force x y z in N against a slip in m/s; c in N s/m."""
    speed = math.sqrt(ux * ux + uy * uy + uz * uz + 1e-60)
    share = -min(c, mu * normal / speed)
    return share * ux, share * uy, share * uz


@stage
def twist_torque(normal, wx, wy, wz, nx, ny, nz, k, c, rolling, spinning, h, tx, ty, tz):
    """Torque against relative spin, of a sample with the whole pair's stiffness.

    Args:
        normal: N, the normal force.
        wx: rad/s, relative spin.
        wy: likewise.
        wz: likewise.
        nx: of the normal.
        ny: likewise.
        nz: likewise.
        k: N m, stiffness.
        c: N m s, damping.
        rolling: m, of the resistance.
        spinning: m, likewise.
        h: s.
        tx: rad, twist before this step.
        ty: likewise.
        tz: likewise.

    Returns:
        Torque x y z in N m and twist x y z in rad.
    """
    spin, twist = wx * nx + wy * ny + wz * nz, tx * nx + ty * ny + tz * nz
    ax, ay, az, px, py, pz = friction_force(
        normal, wx - spin * nx, wy - spin * ny, wz - spin * nz, k, c, rolling, h,
        tx - twist * nx, ty - twist * ny, tz - twist * nz, 1.0,
    )  # fmt: skip
    along, _, _, turn, _, _ = friction_force(
        normal, spin, 0.0, 0.0, k, c, spinning, h, twist, 0.0, 0.0, 1.0
    )
    return (
        ax + along * nx,
        ay + along * ny,
        az + along * nz,
        px + turn * nx,
        py + turn * ny,
        pz + turn * nz,
    )
