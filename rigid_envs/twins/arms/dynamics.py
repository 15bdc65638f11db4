"""How torques move a chain of hinges: M(q) q'' + b(q, q') = torque.

M is the mass matrix, and b the torque that keeps the hinges' speeds: against gravity, centrifugal
and Coriolis forces. Both follow from Newton's and Euler's laws of the links: b by the recursive
Newton-Euler algorithm, M by that of composite rigid bodies (Featherstone, Rigid Body Dynamics
Algorithms, 2008, chapters 5 and 6). Velocities [6] are the angular one and that of the point which
is at the world's origin; moments [6] are about that origin, with forces after them.
"""

import numpy as np

from physics.compiler.jit import LANES, sequence, stage
from rigid_envs.twins.arms.linear import factor, solve
from rigid_envs.twins.arms.work import JOINTS

Array = np.ndarray

GRAVITY = 9.81  # m/s^2


@sequence
def weigh(chain, work):
    """Writes mass matrix and bias of chains at their pose and speeds."""
    axis, body, force = work.axis, work.body, work.force
    velocity, acceleration, part, load = (
        work.spatial[0], work.spatial[1], work.spatial[2], work.spatial[3],
    )  # fmt: skip
    for k in range(6):
        for lane in range(LANES):
            velocity[k, lane] = 0.0
            acceleration[k, lane] = GRAVITY if k == 5 else 0.0
            load[k, lane] = 0.0
    for i in range(JOINTS):
        _move_axis(work.rotation[i], work.origin[i], axis[i])
        _move_inertia(chain, i, work.rotation[i], work.origin[i], body[i])
        # a' = a + v x (s q'), v' = v + s q'
        for k in range(6):
            for lane in range(LANES):
                part[k, lane] = axis[i, k, lane] * work.speeds[i, lane]
        _add_cross(velocity, part, acceleration)
        for k in range(6):
            for lane in range(LANES):
                velocity[k, lane] += part[k, lane]
        _momentum(body[i], acceleration, force[i])
        _momentum(body[i], velocity, part)
        _add_cross_force(velocity, part, force[i])
    for i in range(JOINTS - 1, -1, -1):
        for lane in range(LANES):
            work.bias[i, lane] = 0.0
        for k in range(6):
            for lane in range(LANES):
                load[k, lane] += force[i, k, lane]
                work.bias[i, lane] += axis[i, k, lane] * load[k, lane]
        if i < JOINTS - 1:
            for k in range(10):
                for lane in range(LANES):
                    body[i, k, lane] += body[i + 1, k, lane]
        _momentum(body[i], axis[i], part)
        for j in range(i + 1):
            for lane in range(LANES):
                work.mass_matrix[i, j, lane] = (
                    axis[j, 0, lane] * part[0, lane]
                    + axis[j, 1, lane] * part[1, lane]
                    + axis[j, 2, lane] * part[2, lane]
                    + axis[j, 3, lane] * part[3, lane]
                    + axis[j, 4, lane] * part[4, lane]
                    + axis[j, 5, lane] * part[5, lane]
                )
            for lane in range(LANES):
                work.mass_matrix[j, i, lane] = work.mass_matrix[i, j, lane]


@stage
def factor_masses(work):
    """Writes to `work.factored[0]` the factors of the mass matrices."""
    for i in range(JOINTS):
        for j in range(i + 1):
            for lane in range(LANES):
                work.factored[0, i, j, lane] = work.mass_matrix[i, j, lane]
    factor(work.factored[0], JOINTS)


@stage
def answer(jacobian, rows, factored, along, compliance):
    """Writes how hinges and points of an arm answer forces on the points.

    Args:
        jacobian: [rows, n, LANES], velocities of the points per speed of the hinges.
        rows: how many.
        factored: [n, n, LANES], factors of the mass matrices, see `linear.factor`.
        along: [rows, n, LANES], what is written: M^-1 J^T, transposed.
        compliance: [rows, rows, LANES], what is written: the lower half of J M^-1 J^T.
    """
    for a in range(rows):
        for i in range(JOINTS):
            for lane in range(LANES):
                along[a, i, lane] = jacobian[a, i, lane]
        solve(factored, along[a], JOINTS)
        for b in range(a + 1):
            for lane in range(LANES):
                compliance[a, b, lane] = 0.0
            for i in range(JOINTS):
                for lane in range(LANES):
                    compliance[a, b, lane] += jacobian[b, i, lane] * along[a, i, lane]


@stage
def _move_axis(rotation, origin, axis):
    for lane in range(LANES):
        x, y, z = rotation[0, 2, lane], rotation[1, 2, lane], rotation[2, 2, lane]
        px, py, pz = origin[0, lane], origin[1, lane], origin[2, lane]
        axis[0, lane], axis[1, lane], axis[2, lane] = x, y, z
        axis[3, lane] = py * z - pz * y
        axis[4, lane] = pz * x - px * z
        axis[5, lane] = px * y - py * x


@stage
def _move_inertia(chain, i, rotation, origin, body):
    """Inertia of link i about the world's origin: R I R^T, and what its displacement adds."""
    m = chain.mass[i]
    hx, hy, hz = chain.moment[i, 0], chain.moment[i, 1], chain.moment[i, 2]
    ixx, iyy, izz = chain.inertia[i, 0, 0], chain.inertia[i, 1, 1], chain.inertia[i, 2, 2]
    ixy, ixz, iyz = chain.inertia[i, 0, 1], chain.inertia[i, 0, 2], chain.inertia[i, 1, 2]
    for lane in range(LANES):
        ax, ay, az = rotation[0, 0, lane], rotation[0, 1, lane], rotation[0, 2, lane]
        bx, by, bz = rotation[1, 0, lane], rotation[1, 1, lane], rotation[1, 2, lane]
        cx, cy, cz = rotation[2, 0, lane], rotation[2, 1, lane], rotation[2, 2, lane]
        px, py, pz = origin[0, lane], origin[1, lane], origin[2, lane]
        # first moments about the link's origin, along the world's axes, and rows of R I
        gx = ax * hx + ay * hy + az * hz
        gy = bx * hx + by * hy + bz * hz
        gz = cx * hx + cy * hy + cz * hz
        aix = ax * ixx + ay * ixy + az * ixz
        aiy = ax * ixy + ay * iyy + az * iyz
        aiz = ax * ixz + ay * iyz + az * izz
        bix = bx * ixx + by * ixy + bz * ixz
        biy = bx * ixy + by * iyy + bz * iyz
        biz = bx * ixz + by * iyz + bz * izz
        cix = cx * ixx + cy * ixy + cz * ixz
        ciy = cx * ixy + cy * iyy + cz * iyz
        ciz = cx * ixz + cy * iyz + cz * izz
        # m p p^T + g p^T + p g^T
        mx, my, mz = m * px + gx, m * py + gy, m * pz + gz
        sxx, syy, szz = mx * px + px * gx, my * py + py * gy, mz * pz + pz * gz
        body[0, lane] = m
        body[1, lane], body[2, lane], body[3, lane] = mx, my, mz
        body[4, lane] = aix * ax + aiy * ay + aiz * az + syy + szz
        body[5, lane] = bix * bx + biy * by + biz * bz + sxx + szz
        body[6, lane] = cix * cx + ciy * cy + ciz * cz + sxx + syy
        body[7, lane] = aix * bx + aiy * by + aiz * bz - mx * py - px * gy
        body[8, lane] = aix * cx + aiy * cy + aiz * cz - mx * pz - px * gz
        body[9, lane] = bix * cx + biy * cy + biz * cz - my * pz - py * gz


@stage
def _momentum(body, velocity, out):
    """Momentum [6, LANES] of bodies [10, LANES] with velocities [6, LANES]."""
    for lane in range(LANES):
        wx, wy, wz = velocity[0, lane], velocity[1, lane], velocity[2, lane]
        vx, vy, vz = velocity[3, lane], velocity[4, lane], velocity[5, lane]
        m, hx, hy, hz = body[0, lane], body[1, lane], body[2, lane], body[3, lane]
        xx, yy, zz = body[4, lane], body[5, lane], body[6, lane]
        xy, xz, yz = body[7, lane], body[8, lane], body[9, lane]
        out[0, lane] = xx * wx + xy * wy + xz * wz + hy * vz - hz * vy
        out[1, lane] = xy * wx + yy * wy + yz * wz + hz * vx - hx * vz
        out[2, lane] = xz * wx + yz * wy + zz * wz + hx * vy - hy * vx
        out[3, lane] = m * vx + wy * hz - wz * hy
        out[4, lane] = m * vy + wz * hx - wx * hz
        out[5, lane] = m * vz + wx * hy - wy * hx


@stage
def _add_cross(v, x, out):
    """Adds v x x, of velocities [6, LANES]: how x changes that moves with v."""
    for lane in range(LANES):
        wx, wy, wz = v[0, lane], v[1, lane], v[2, lane]
        vx, vy, vz = v[3, lane], v[4, lane], v[5, lane]
        ax, ay, az = x[0, lane], x[1, lane], x[2, lane]
        bx, by, bz = x[3, lane], x[4, lane], x[5, lane]
        out[0, lane] += wy * az - wz * ay
        out[1, lane] += wz * ax - wx * az
        out[2, lane] += wx * ay - wy * ax
        out[3, lane] += wy * bz - wz * by + vy * az - vz * ay
        out[4, lane] += wz * bx - wx * bz + vz * ax - vx * az
        out[5, lane] += wx * by - wy * bx + vx * ay - vy * ax


@stage
def _add_cross_force(v, f, out):
    """Adds v x* f: how a momentum f [6, LANES] changes that moves with v [6, LANES]."""
    for lane in range(LANES):
        wx, wy, wz = v[0, lane], v[1, lane], v[2, lane]
        vx, vy, vz = v[3, lane], v[4, lane], v[5, lane]
        ax, ay, az = f[0, lane], f[1, lane], f[2, lane]
        bx, by, bz = f[3, lane], f[4, lane], f[5, lane]
        out[0, lane] += wy * az - wz * ay + vy * bz - vz * by
        out[1, lane] += wz * ax - wx * az + vz * bx - vx * bz
        out[2, lane] += wx * ay - wy * ax + vx * by - vy * bx
        out[3, lane] += wy * bz - wz * by
        out[4, lane] += wz * bx - wx * bz
        out[5, lane] += wx * by - wy * bx
