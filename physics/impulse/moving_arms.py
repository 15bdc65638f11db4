"""What the motion of a contact's arms adds to its slip within half a step.

Velocities are known half a step before and after the present arms. A body that pivots on a corner
at r from its centre has v + w x r = 0 at every time, so with the present arm the slip of the
velocities half a step later is not zero but

    v + w x r(now) = -t,    t = h/2 (w_1 x r_1' - w_2 x r_2'),

across the normal; half a step before it is t. Along the normal it is the `bend` of `contact_rows`.
Friction that stops the slip of the present arms instead drives what pivots or rolls on a rim: a
disk that rolled inclined gained 3 % of its energy in 2 s.

On a flat surface the arm of a sample at c with the radius r is c - r n, and the normal turns with
the second body, so

    r_1' = W x c - r w_2 x n,    r_2' = r_1' + v_1 - v_2,

where W is the body's w. The samples of a cylinder or torus on a floor turn about its axis a until
the first of them is lowest, see `collision.facing`. Then the part of W along the axis is the rate
at which the lowest point moves around it. With the direction d to that point and e = a x d it is

    ((n a) a' - n') e / |n - (n a) a|,    a' = w_1 x a.

On balls, capsules, cylinders and tori the term is left out: it is zero for balls that roll in a
plane. Meshes count as flat.
"""

import math

from physics.collision.facing import BIAS
from physics.compiler.jit import stage
from physics.motion.vectors import cross


@stage
def rate_around(owner, i, nx, ny, nz, mx, my, mz):
    """What the spin about z of the frame of an axial owner's samples exceeds the owner's by.

    Args:
        owner: row of SOLID.
        i: lane.
        nx: of the normal.
        ny: likewise.
        nz: likewise.
        mx: 1/s, of its rate of change.
        my: likewise.
        mz: likewise.

    Returns:
        x y z in rad/s, along the axis.
    """
    R, w = owner.rotation, owner.angular_velocity
    ax, ay, az = R[2, i], R[5, i], R[8, i]
    along = nx * ax + ny * ay + nz * az
    dx, dy, dz = along * ax - nx, along * ay - ny, along * az - nz
    square = dx * dx + dy * dy + dz * dz
    ex, ey, ez = cross(ax, ay, az, dx, dy, dz)  # as long as d
    px, py, pz = cross(w[0, i], w[1, i], w[2, i], ax, ay, az)
    qx, qy, qz = along * px - mx, along * py - my, along * pz - mz
    # below the bias the samples keep their angle in the body
    rate = (qx * ex + qy * ey + qz * ez) / max(square, BIAS * BIAS)
    excess = rate - (w[0, i] * ax + w[1, i] * ay + w[2, i] * az)
    excess = excess if square > BIAS * BIAS else 0.0
    return excess * ax, excess * ay, excess * az


@stage
def slip_of_arms(owner, surface, point, i, ahead, radius, axial):
    """Slip t, x y z in m/s, see above. Zero where a step turns more than a radian.

    Args:
        owner: row of SOLID.
        surface: likewise.
        point: row of CONTACT_ROW, in the world frame.
        i: lane.
        ahead: s, from the present arms to the velocities.
        radius: m, of the owner's samples.
        axial: whether they turn about its axis.
    """
    w, u, v, s = (
        owner.angular_velocity,
        surface.angular_velocity,
        owner.velocity,
        surface.velocity,
    )
    nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
    wx, wy, wz, ux, uy, uz = w[0, i], w[1, i], w[2, i], u[0, i], u[1, i], u[2, i]
    mx, my, mz = cross(ux, uy, uz, nx, ny, nz)
    fx, fy, fz = wx, wy, wz
    if axial:
        gx, gy, gz = rate_around(owner, i, nx, ny, nz, mx, my, mz)
        fx, fy, fz = fx + gx, fy + gy, fz + gz
    cx = point.arm[0, i] + radius * nx
    cy = point.arm[1, i] + radius * ny
    cz = point.arm[2, i] + radius * nz
    px, py, pz = cross(fx, fy, fz, cx, cy, cz)
    px, py, pz = px - radius * mx, py - radius * my, pz - radius * mz
    qx, qy, qz = px + (v[0, i] - s[0, i]), py + (v[1, i] - s[1, i]), pz + (v[2, i] - s[2, i])
    px, py, pz = cross(wx, wy, wz, px, py, pz)
    qx, qy, qz = cross(ux, uy, uz, qx, qy, qz)
    tx, ty, tz = ahead * (px - qx), ahead * (py - qy), ahead * (pz - qz)
    along = tx * nx + ty * ny + tz * nz
    fastest = max(fx * fx + fy * fy + fz * fz, ux * ux + uy * uy + uz * uz)
    fastest = max(fastest, wx * wx + wy * wy + wz * wz)
    resolved = ahead * math.sqrt(fastest) <= 0.5
    tx, ty, tz = tx - along * nx, ty - along * ny, tz - along * nz
    return tx if resolved else 0.0, ty if resolved else 0.0, tz if resolved else 0.0
