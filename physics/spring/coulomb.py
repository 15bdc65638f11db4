"""Coulomb friction with history: the tangential spring of Cundall and Strack (1979).

A contact remembers the force s = -k_t xi of its shear xi. The trial force s - c_t u is cut to the
cone |f| <= mu N. Where it is cut, s becomes the force that gives the cut one at the present speed,
f + c_t u (Luding 2008), so the force is continuous when sliding ends.

Contacts that collide and contacts that last differ in what they remember.

- In a collision N starts at zero, so c_t u exceeds the cone and s would point forwards. Such a
  spring stores energy that no work has paid for, and returns it later. Contacts that collide
  therefore have friction by damping alone, within the cone.
- A body at rest and one that slides to rest need the shear spring. Contacts that last keep it.

The normal law tells the two apart by the impact speed, compared with that of a contact that rests
under its load: `persistence` there (evidence: docs/decisions).

The damping decides where a body that slides comes to rest. With a = mu g and half-step speeds,
sliding ends in the step whose speed u falls below c a / k_t, at the shear
xi = (m a - c u_before) / k_t, and the body comes to rest where xi is zero, -xi further on.
Meanwhile a body pitched forward by the force under it swings back, and its centre with it, by
m a h^2 / k_rock, with h its height over the face and k_rock the stiffness against rocking.
Coulomb's law leaves it u^2 / (2 a) to slide. These agree, on average over the phase of the step in
which sliding ends, if

    c^2 + dt k_t c - 2 k_t m (1 + k_t h^2 / k_rock) - (dt k_t)^2 / 12 = 0,

which `tangential_coefficients` solves for c: near 1/sqrt(2) of critical damping. The remaining
error is at most a dt^2 / 8, and for a box on another than its widest face the difference in
rocking (`python -m benchmarks accuracy`).

A body set down on a slope steeper than its friction angle slides from the first moment, but its
spring is slack and gives too little friction until it is charged. With gravity g_t along the slope
and g_n across it, and omega_t^2 = k_t/m, the spring has charged after the time t at which
g_t (1 - cos omega_t t) = mu g_n. The body then has the speed g_t sin(omega_t t) / omega_t, and by
Coulomb's law (g_t - mu g_n) t. At 30 degrees and mu = 0.5 it stays too fast by 0.4 g/omega_t.
So where a body is set down on a ground or static and its weight alone makes it slide, the contact
begins wound up, to `_WOUND_UP` times the cone of the weight, and stays so while it pulls uphill. A
body that lands, or slides up, begins with a slack spring, or friction would drive it.

Resistance against rolling and spinning is the same law for the relative angular velocity across the
normal and along it, with torques up to a length times the normal force. A rolling ball slows by
5/7 g c/R.

Viscous friction, f = -eta v in the lecture, is limited to the cone too. It has no memory, so it
holds nothing still, and is the cheapest.
"""

import math

from physics.compiler.jit import stage

# Cones of damping, beyond the first, that a lasting contact may remember. The rear edge of a body
# that slides to rest needs several, as it carries a third of the mean load. Without a limit
# samples with little load would pull in the direction of an earlier velocity where it turns
_AT_REST = 10.0
# As much as the cone of an edge grows while a cube is set down: dropped from zero penetration it
# presses with up to twice its weight; all of this on an edge, which has 3/8 of a face's stiffness
_WOUND_UP = 16.0 / 3.0
# A body counts as set down if it approaches, and slides up, by at most the speed that gravity gives
# it in so many steps. In the first step a cube already pitches, and its lower edge moves up
_SET_DOWN = 2.0


@stage
def winding(mass, mu, steep, gx, gy, gz, nx, ny, nz):
    """Force along the slope to which a contact is wound up.

    Args:
        mass: kg, pair mass.
        mu: coefficient of friction.
        steep: the body slides where the slope exceeds this times mu, see `HALF_PAIR.slide_slope`.
        gx: m/s^2, gravity of the owner relative to the surface.
        gy: likewise.
        gz: likewise.
        nx: of the normal.
        ny: likewise.
        nz: likewise.

    Returns:
        Force x y z in N; zero where the body can rest.
    """
    along = gx * nx + gy * ny + gz * nz
    gx, gy, gz = gx - along * nx, gy - along * ny, gz - along * nz
    down = math.sqrt(gx * gx + gy * gy + gz * gz + 1e-60)
    cone = mu * max(-along, 0.0)
    factor = _WOUND_UP * mass * cone / down if down > steep * cone else 0.0
    return factor * gx, factor * gy, factor * gz


@stage
def is_set_down(approach, along, gx, gy, gz, h, wound):
    """Whether a contact that begins is that of a body at rest, or that slides down.

    Args:
        approach: m/s.
        along: N m/s, velocity times `wound`.
        gx: m/s^2, gravity.
        gy: likewise.
        gz: likewise.
        h: s.
        wound: x y z in N, see `winding`.
    """
    wx, wy, wz = wound
    limit = _SET_DOWN * h * math.sqrt(gx * gx + gy * gy + gz * gz)
    return (approach <= limit) & (along >= -limit * math.sqrt(wx * wx + wy * wy + wz * wz))


@stage
def friction_force(normal, ux, uy, uz, k, c, mu, h, sx, sy, sz, persistence, wound):
    """Tangential force of a sample that carries the whole pair's stiffness.

    Args:
        normal: N, the normal force.
        ux: m/s, tangential velocity.
        uy: likewise.
        uz: likewise.
        k: N/m, shear stiffness.
        c: N s/m, shear damping.
        mu: coefficient of friction.
        h: s.
        sx: N, force of the shear spring before this step, in the tangent plane.
        sy: likewise.
        sz: likewise.
        persistence: 1 for a contact that lasts, falling to 0 for one that collides.
        wound: x y z in N, see `winding`, or None. A trial force against it is remembered up to this
            amount, even if that is more than the cone.

    Returns:
        Force x y z in N, and force x y z of the spring to remember in N.
    """
    whole = k * h + c
    fx = sx - whole * ux
    fy = sy - whole * uy
    fz = sz - whole * uz
    inverse = 1.0 / math.sqrt(fx * fx + fy * fy + fz * fz + 1e-60)
    limit = mu * normal
    cut = min(1.0, limit * inverse)
    grips, touches = limit > 0.0, normal > 0.0
    # Without grip these are zero anyway. As plain products they could be fused with a sum, or the
    # other product of that sum could: which one LLVM chose differed with per-world parameters
    rx = fx * cut if grips else 0.0
    ry = fy * cut if grips else 0.0
    rz = fz * cut if grips else 0.0
    if wound is None:
        fx, fy, fz = rx, ry, rz
    else:
        wx, wy, wz = wound
        most = math.sqrt(wx * wx + wy * wy + wz * wz)
        most = most if fx * wx + fy * wy + fz * wz < 0.0 else 0.0
        remembered = min(1.0, max(limit, most) * inverse)
        fx = fx * remembered if grips else 0.0
        fy = fy * remembered if grips else 0.0
        fz = fz * remembered if grips else 0.0
    # forgotten after the step, not before: the trial force need not wait for the normal law
    lasting = persistence * persistence
    damped = c * min(1.0, (1.0 + _AT_REST * lasting) * limit * inverse)
    sx = lasting * (fx + damped * ux) if touches else 0.0
    sy = lasting * (fy + damped * uy) if touches else 0.0
    sz = lasting * (fz + damped * uz) if touches else 0.0
    return rx, ry, rz, sx, sy, sz


@stage
def viscous_force(normal, ux, uy, uz, c, mu):
    """Tangential force x y z in N at a sliding velocity in m/s; c in N s/m."""
    speed = math.sqrt(ux * ux + uy * uy + uz * uz + 1e-60)
    factor = -min(c, mu * normal / speed)
    return factor * ux, factor * uy, factor * uz


@stage
def twist_torque(normal, wx, wy, wz, nx, ny, nz, k, c, rolling, spinning, h, tx, ty, tz):
    """Torque against rolling and spinning, of a sample that carries the whole pair's stiffness.

    Args:
        normal: N, the normal force.
        wx: rad/s, relative angular velocity.
        wy: likewise.
        wz: likewise.
        nx: of the normal.
        ny: likewise.
        nz: likewise.
        k: N m, stiffness.
        c: N m s, damping.
        rolling: m, rolling resistance.
        spinning: m, spinning resistance.
        h: s.
        tx: N m, torque of the spring before this step.
        ty: likewise.
        tz: likewise.

    Returns:
        Torque x y z in N m, and torque x y z of the spring to remember in N m.
    """
    spin, twist = wx * nx + wy * ny + wz * nz, tx * nx + ty * ny + tz * nz
    ax, ay, az, px, py, pz = friction_force(
        normal, wx - spin * nx, wy - spin * ny, wz - spin * nz, k, c, rolling, h,
        tx - twist * nx, ty - twist * ny, tz - twist * nz, 1.0, None,
    )  # fmt: skip
    along, _, _, turn, _, _ = friction_force(
        normal, spin, 0.0, 0.0, k, c, spinning, h, twist, 0.0, 0.0, 1.0, None
    )
    return (
        ax + along * nx,
        ay + along * ny,
        az + along * nz,
        px + turn * nx,
        py + turn * ny,
        pz + turn * nz,
    )
