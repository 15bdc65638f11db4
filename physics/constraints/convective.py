"""The part of a row's acceleration that comes from present velocities: dJ/dt v - J W (omega x L).

It matters where forces are computed for a state at rest in time, a refresh: the constraint's
acceleration is J W F + dJ/dt v with W F the acceleration by forces, and that of a rotating body
lacks the gyroscopic part omega x L.
"""

import math

from physics.compiler.jit import LANES, stage
from physics.constraints.rows import between_anchors
from physics.model.features import cached_by_features
from physics.model.tables import ALONG, ANGLE, DISTANCE, HIGH_LIMIT
from physics.motion.vectors import cross, rotated_at


@stage
def _centripetal(omega, i, x, y, z):
    """Omega x (omega x r)."""
    ox, oy, oz = omega[0, i], omega[1, i], omega[2, i]
    vx, vy, vz = cross(ox, oy, oz, x, y, z)
    return cross(ox, oy, oz, vx, vy, vz)


@stage
def _velocity_between(row, A, B, i):
    """Vector from the anchor of b to that of a, its rate, and the rate's convective part."""
    ax, ay, az, bx, by, bz, dx, dy, dz = between_anchors(row, A, B, i)
    o, s = A.angular_velocity, B.angular_velocity
    ux, uy, uz = cross(o[0, i], o[1, i], o[2, i], ax, ay, az)
    wx, wy, wz = cross(s[0, i], s[1, i], s[2, i], bx, by, bz)
    v, u = A.velocity, B.velocity
    px, py, pz = _centripetal(o, i, ax, ay, az)
    qx, qy, qz = _centripetal(s, i, bx, by, bz)
    return (
        dx,
        dy,
        dz,
        v[0, i] + ux - u[0, i] - wx,
        v[1, i] + uy - u[1, i] - wy,
        v[2, i] + uz - u[2, i] - wz,
        px - qx,
        py - qy,
        pz - qz,
    )


@stage
def _along(row, A, B, i):
    dx, dy, dz, ex, ey, ez, fx, fy, fz = _velocity_between(row, A, B, i)
    nx, ny, nz = rotated_at(B.rotation, i, row.axis_b)
    s = B.angular_velocity
    mx, my, mz = cross(s[0, i], s[1, i], s[2, i], nx, ny, nz)
    kx, ky, kz = _centripetal(s, i, nx, ny, nz)
    rate = fx * nx + fy * ny + fz * nz + 2.0 * (ex * mx + ey * my + ez * mz)
    return rate + dx * kx + dy * ky + dz * kz


@stage
def _distance(row, A, B, i):
    dx, dy, dz, ex, ey, ez, fx, fy, fz = _velocity_between(row, A, B, i)
    inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
    closing = (dx * ex + dy * ey + dz * ez) * inverse
    across = ex * ex + ey * ey + ez * ez - closing * closing
    return (dx * fx + dy * fy + dz * fz + across) * inverse


@stage
def _perpendicular(row, A, B, i):
    ux, uy, uz = rotated_at(A.rotation, i, row.axis_a)
    wx, wy, wz = rotated_at(B.rotation, i, row.axis_b)
    o, s = A.angular_velocity, B.angular_velocity
    px, py, pz = _centripetal(o, i, ux, uy, uz)
    qx, qy, qz = _centripetal(s, i, wx, wy, wz)
    ax, ay, az = cross(o[0, i], o[1, i], o[2, i], ux, uy, uz)
    bx, by, bz = cross(s[0, i], s[1, i], s[2, i], wx, wy, wz)
    rate = px * wx + py * wy + pz * wz + 2.0 * (ax * bx + ay * by + az * bz)
    return rate + ux * qx + uy * qy + uz * qz


@stage
def _angle(row, A, B, i):
    zx, zy, zz = rotated_at(B.rotation, i, row.pivot)
    o, s = A.angular_velocity, B.angular_velocity
    x, y, z = cross(s[0, i], s[1, i], s[2, i], zx, zy, zz)
    return (o[0, i] - s[0, i]) * x + (o[1, i] - s[1, i]) * y + (o[2, i] - s[2, i]) * z


@stage
def _gyroscopic(solid, turn, i):
    """What omega x L takes from a row's rate."""
    o, L = solid.angular_velocity, solid.angular_momentum
    x, y, z = cross(o[0, i], o[1, i], o[2, i], L[0, i], L[1, i], L[2, i])
    return turn[0, i] * x + turn[1, i] * y + turn[2, i] * z


@stage
def _write(model, workspace, r):
    row, work = model.joint_row[r], workspace.joint[r]
    A, B = workspace.solid[row.a], workspace.solid[row.b]
    sign = -1.0 if row.role == HIGH_LIMIT else 1.0
    for i in range(LANES):
        if row.kind == ALONG:
            rate = _along(row, A, B, i)
        elif row.kind == DISTANCE:
            rate = _distance(row, A, B, i)
        elif row.kind == ANGLE:
            rate = _angle(row, A, B, i)
        else:
            rate = _perpendicular(row, A, B, i)
        rate = sign * rate - _gyroscopic(A, work.turn_a, i)
        if row.b < model.dynamic.shape[0]:
            rate += _gyroscopic(B, work.turn_b, i)
        work.convective[i] = rate


@cached_by_features
def make_convective_rates(features):
    """Stage that writes these parts of all rows in a refresh, and zero after a drift."""
    joints = features.joints

    @stage
    def convective_rates(model, workspace, drifted):
        if joints:
            for r in range(model.joint_row.shape[0]):
                if drifted > 0.0:
                    convective = workspace.joint[r].convective
                    for i in range(LANES):
                        convective[i] = 0.0
                else:
                    _write(model, workspace, r)

    return convective_rates
