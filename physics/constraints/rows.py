"""Scalar constraints of joints: their value C, and its derivative J with respect to motion.

With the anchors p, fixed to the bodies a and b, an axis u of a, axes w and z of b, and all of them
in the world frame:

    ALONG           C = (p_a - p_b) . w               moves along an axis
    PERPENDICULAR   C = u . w                         two axes
    DISTANCE        C = |p_a - p_b|
    ANGLE           C = atan2(u . (z x w), u . w)     about z

    dC/dt = n . (v_a - v_b) + s_a . omega_a - s_b . omega_b

A row stores n, s, and s times the body's inverse inertia. An impulse or force `x` along a row acts
with x n and the moment x s_a on a, and the opposite, x n and x s_b, on b. All C are relative to the
row's target; a HIGH_LIMIT has the opposite sign, so that limits allow C >= 0.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.model.tables import ALONG, DISTANCE, HIGH_LIMIT, MOTOR, PERPENDICULAR
from physics.motion.vectors import cross, rotated, rotated_at, rotated_back


@stage
def between_anchors(row, A, B, i):
    """Arms of both anchors from the centres, and the vector from that of b to that of a, m."""
    ax, ay, az = rotated_at(A.rotation, i, row.point_a)
    bx, by, bz = rotated_at(B.rotation, i, row.point_b)
    a, b = A.position, B.position
    dx = a[0, i] - b[0, i] + (ax - bx)
    dy = a[1, i] - b[1, i] + (ay - by)
    dz = a[2, i] - b[2, i] + (az - bz)
    return ax, ay, az, bx, by, bz, dx, dy, dz


@stage
def _along(row, A, B, i):
    ax, ay, az, bx, by, bz, dx, dy, dz = between_anchors(row, A, B, i)
    nx, ny, nz = rotated_at(B.rotation, i, row.axis_b)
    sx, sy, sz = cross(ax, ay, az, nx, ny, nz)
    # the axis rotates with b, so its arm ends at the anchor of a
    tx, ty, tz = cross(bx + dx, by + dy, bz + dz, nx, ny, nz)
    return nx, ny, nz, sx, sy, sz, tx, ty, tz, dx * nx + dy * ny + dz * nz


@stage
def _distance(row, A, B, i):
    ax, ay, az, bx, by, bz, dx, dy, dz = between_anchors(row, A, B, i)
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    inverse = 1.0 / length
    nx, ny, nz = dx * inverse, dy * inverse, dz * inverse
    sx, sy, sz = cross(ax, ay, az, nx, ny, nz)
    tx, ty, tz = cross(bx, by, bz, nx, ny, nz)
    return nx, ny, nz, sx, sy, sz, tx, ty, tz, length


@stage
def _perpendicular(row, A, B, i):
    ux, uy, uz = rotated_at(A.rotation, i, row.axis_a)
    wx, wy, wz = rotated_at(B.rotation, i, row.axis_b)
    sx, sy, sz = cross(ux, uy, uz, wx, wy, wz)
    return 0.0, 0.0, 0.0, sx, sy, sz, sx, sy, sz, ux * wx + uy * wy + uz * wz


@stage
def _angle(row, A, B, i):
    ux, uy, uz = rotated_at(A.rotation, i, row.axis_a)
    wx, wy, wz = rotated_at(B.rotation, i, row.axis_b)
    zx, zy, zz = rotated_at(B.rotation, i, row.pivot)
    tx, ty, tz = cross(zx, zy, zz, wx, wy, wz)
    angle = math.atan2(ux * tx + uy * ty + uz * tz, ux * wx + uy * wy + uz * wz)
    return 0.0, 0.0, 0.0, zx, zy, zz, zx, zy, zz, angle


def _make_measure(formula):
    """Stage that writes the value of a row."""

    @stage
    def measure(row, work, A, B):
        target, sign = row.target, -1.0 if row.role == HIGH_LIMIT else 1.0
        for i in range(LANES):
            value = formula(row, A, B, i)[9]
            work.value[i] = sign * (value - at(target, i))

    return measure


def _make_linearise(formula):
    """Stage that writes the value and the derivative of a row."""

    @stage
    def linearise(row, work, A, B):
        target, sign = row.target, -1.0 if row.role == HIGH_LIMIT else 1.0
        for i in range(LANES):
            nx, ny, nz, sx, sy, sz, tx, ty, tz, value = formula(row, A, B, i)
            work.value[i] = sign * (value - at(target, i))
            work.direction[0, i] = sign * nx
            work.direction[1, i] = sign * ny
            work.direction[2, i] = sign * nz
            work.moment_a[0, i] = sign * sx
            work.moment_a[1, i] = sign * sy
            work.moment_a[2, i] = sign * sz
            work.moment_b[0, i] = sign * tx
            work.moment_b[1, i] = sign * ty
            work.moment_b[2, i] = sign * tz

    return linearise


_measure_along, _linearise_along = _make_measure(_along), _make_linearise(_along)
_measure_distance, _linearise_distance = _make_measure(_distance), _make_linearise(_distance)
_measure_perpendicular = _make_measure(_perpendicular)
_linearise_perpendicular = _make_linearise(_perpendicular)
_measure_angle, _linearise_angle = _make_measure(_angle), _make_linearise(_angle)


@stage
def measure_rows(model, workspace):
    """Writes the values of all rows but those of motors, which have none."""
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        A, B = workspace.solid[row.a], workspace.solid[row.b]
        if row.role == MOTOR:
            continue
        if row.kind == ALONG:
            _measure_along(row, work, A, B)
        elif row.kind == PERPENDICULAR:
            _measure_perpendicular(row, work, A, B)
        elif row.kind == DISTANCE:
            _measure_distance(row, work, A, B)
        else:
            _measure_angle(row, work, A, B)


@stage
def _turned(R, j, moment, turn):
    """R diag(j) R^T times a moment: what a unit of the row changes an angular velocity by."""
    for i in range(LANES):
        x, y, z = rotated_back(R, i, moment[0, i], moment[1, i], moment[2, i])
        x, y, z = rotated(R, i, at(j[0], i) * x, at(j[1], i) * y, at(j[2], i) * z)
        turn[0, i] = x
        turn[1, i] = y
        turn[2, i] = z


@stage
def linearise_rows(model, workspace):
    """Writes the values and derivatives of all rows, at the poses of the rotation matrices."""
    dynamic_count = model.dynamic.shape[0]
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        A, B = workspace.solid[row.a], workspace.solid[row.b]
        if row.kind == ALONG:
            _linearise_along(row, work, A, B)
        elif row.kind == PERPENDICULAR:
            _linearise_perpendicular(row, work, A, B)
        elif row.kind == DISTANCE:
            _linearise_distance(row, work, A, B)
        else:
            _linearise_angle(row, work, A, B)
        _turned(A.rotation, model.dynamic[row.a].inverse_inertia, work.moment_a, work.turn_a)
        if row.b < dynamic_count:
            _turned(B.rotation, model.dynamic[row.b].inverse_inertia, work.moment_b, work.turn_b)


@stage
def _dot(a, b, i):
    return a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i]


@stage
def add_rates_of_momenta(model, row, work, P, L, Q, M, factor, out):
    """Adds factor J W (P, L, Q, M) to `out`, W the inverse masses: the row's rate in m/s or rad/s.

    P and L are the momentum and angular momentum of a, Q and M those of b; or force and torque, of
    which the rate is the acceleration.
    """
    inverse_mass = model.dynamic[row.a].inverse_mass
    for i in range(LANES):
        rate = at(inverse_mass, i) * _dot(work.direction, P, i) + _dot(work.turn_a, L, i)
        out[i] += factor * rate
    if row.b < model.dynamic.shape[0]:
        inverse_mass = model.dynamic[row.b].inverse_mass
        for i in range(LANES):
            rate = at(inverse_mass, i) * _dot(work.direction, Q, i) + _dot(work.turn_b, M, i)
            out[i] -= factor * rate


@stage
def add_along_row(work, amount, P, L, Q, M):
    """Adds impulses [LANES] along a row to the momenta of both bodies; or forces to forces."""
    for i in range(LANES):
        x = amount[i]
        P[0, i] += x * work.direction[0, i]
        P[1, i] += x * work.direction[1, i]
        P[2, i] += x * work.direction[2, i]
        L[0, i] += x * work.moment_a[0, i]
        L[1, i] += x * work.moment_a[1, i]
        L[2, i] += x * work.moment_a[2, i]
        Q[0, i] -= x * work.direction[0, i]
        Q[1, i] -= x * work.direction[1, i]
        Q[2, i] -= x * work.direction[2, i]
        M[0, i] -= x * work.moment_b[0, i]
        M[1, i] -= x * work.moment_b[1, i]
        M[2, i] -= x * work.moment_b[2, i]
