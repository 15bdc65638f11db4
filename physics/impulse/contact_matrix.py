"""The matrix of Newton's method: M + sum J^T K J over the contacts, in blocks of bodies.

J is the relative velocity of a contact by the velocities of its bodies, K its response. Row 2m of
the matrix is the translation of body m, row 2m + 1 its rotation.

The contacts of a half-pair are summed first, with the owner's arms r: K, [r]x K and [r]x K [r]x^T.
The arms of the surface are r + d, with the distance d of the two centres, so its sums follow.
"""

from physics.compiler.jit import LANES, at, sequence, stage
from physics.impulse.blocks import (
    XX,
    XY,
    XZ,
    YX,
    YY,
    YZ,
    ZX,
    ZY,
    ZZ,
    add,
    block_index,
    set_cross_transposed,
    set_transposed,
    set_zero,
    subtract,
    subtract_transposed,
)
from physics.impulse.contact_responses import response_times
from physics.impulse.point_impulses import world_tensor
from physics.motion.vectors import cross


@stage
def set_masses(model, workspace, bodies):
    """Starts the matrix with masses and inertias, and the right side with zero."""
    blocks, right = workspace.block, workspace.block_vector
    for b in range(blocks.shape[0]):
        blocks[b].used = 0
    for b in range(right.shape[0]):
        vector = right[b].component
        for i in range(LANES):
            vector[0, i] = 0.0
            vector[1, i] = 0.0
            vector[2, i] = 0.0
    for m in range(bodies):
        inverse_mass, J = model.dynamic[m].inverse_mass, model.dynamic[m].inertia
        R = workspace.solid[m].rotation
        linear = blocks[block_index(2 * m, 2 * m)]
        mixed = blocks[block_index(2 * m + 1, 2 * m)]
        angular = blocks[block_index(2 * m + 1, 2 * m + 1)]
        linear.used = 1
        mixed.used = 1
        angular.used = 1
        A, C = linear.entry, angular.entry
        set_zero(A)
        set_zero(mixed.entry)
        for i in range(LANES):
            mass = 1.0 / at(inverse_mass, i)
            A[XX + i] = mass
            A[YY + i] = mass
            A[ZZ + i] = mass
            xx, yy, zz, xy, xz, yz = world_tensor(R, i, at(J[0], i), at(J[1], i), at(J[2], i))
            C[XX + i] = xx
            C[XY + i] = xy
            C[XZ + i] = xz
            C[YX + i] = xy
            C[YY + i] = yy
            C[YZ + i] = yz
            C[ZX + i] = xz
            C[ZY + i] = yz
            C[ZZ + i] = zz


@stage
def sum_contacts(pair, rows, first, sums):
    """Sums K, [r]x K and [r]x K [r]x^T of a half-pair; and the lacking impulse and its moment."""
    points = pair.points
    K, L, A, total = sums[0].entry, sums[1].entry, sums[2].entry, sums[3].entry
    set_zero(K)
    set_zero(L)
    set_zero(A)
    set_zero(total)
    for n in range(points.shape[0]):
        point, row = points[n], rows[first + n]
        for i in range(LANES):
            rx, ry, rz = point.arm[0, i], point.arm[1, i], point.arm[2, i]
            xx, xy, xz = response_times(point, row, i, 1.0, 0.0, 0.0)
            yx, yy, yz = response_times(point, row, i, 0.0, 1.0, 0.0)
            zx, zy, zz = response_times(point, row, i, 0.0, 0.0, 1.0)
            K[XX + i] += xx
            K[XY + i] += xy
            K[XZ + i] += xz
            K[YX + i] += yx
            K[YY + i] += yy
            K[YZ + i] += yz
            K[ZX + i] += zx
            K[ZY + i] += zy
            K[ZZ + i] += zz
            # columns of [r]x K
            ax, ay, az = cross(rx, ry, rz, xx, xy, xz)
            bx, by, bz = cross(rx, ry, rz, yx, yy, yz)
            cx, cy, cz = cross(rx, ry, rz, zx, zy, zz)
            L[XX + i] += ax
            L[XY + i] += bx
            L[XZ + i] += cx
            L[YX + i] += ay
            L[YY + i] += by
            L[YZ + i] += cy
            L[ZX + i] += az
            L[ZY + i] += bz
            L[ZZ + i] += cz
            # columns of [r]x ([r]x K)^T
            dx, dy, dz = cross(rx, ry, rz, ax, bx, cx)
            ex, ey, ez = cross(rx, ry, rz, ay, by, cy)
            fx, fy, fz = cross(rx, ry, rz, az, bz, cz)
            A[XX + i] += dx
            A[XY + i] += ex
            A[XZ + i] += fx
            A[YX + i] += dy
            A[YY + i] += ey
            A[YZ + i] += fy
            A[ZX + i] += dz
            A[ZY + i] += ez
            A[ZZ + i] += fz
            gx, gy, gz = row.change[0, i], row.change[1, i], row.change[2, i]
            tx, ty, tz = cross(rx, ry, rz, gx, gy, gz)
            total[XX + i] += gx
            total[XY + i] += gy
            total[XZ + i] += gz
            total[YX + i] += tx
            total[YY + i] += ty
            total[YZ + i] += tz


@stage
def add_wrench(force, torque, sign, total):
    """Adds an impulse and its moment to the right side."""
    for i in range(LANES):
        force[0, i] += sign * total[XX + i]
        force[1, i] += sign * total[XY + i]
        force[2, i] += sign * total[XZ + i]
        torque[0, i] += sign * total[YX + i]
        torque[1, i] += sign * total[YY + i]
        torque[2, i] += sign * total[YZ + i]


@stage
def move_wrench(total, d, pair):
    """Writes the distance d of the centres, and moves the moment to the surface's centre."""
    c, f = pair.owner[0].position, pair.surface[0].position
    for i in range(LANES):
        x, y, z = c[0, i] - f[0, i], c[1, i] - f[1, i], c[2, i] - f[2, i]
        d[XX + i] = x
        d[XY + i] = y
        d[XZ + i] = z
        tx, ty, tz = cross(x, y, z, total[XX + i], total[XY + i], total[XZ + i])
        total[YX + i] += tx
        total[YY + i] += ty
        total[YZ + i] += tz


@stage
def use(block):
    """Gives entries to a block that has been zero so far."""
    if block.used == 0:
        set_zero(block.entry)
        block.used = 1


@sequence
def add_body(workspace, body, sign, K, L, A, total):
    """Adds the contacts of a half-pair to the rows of one body."""
    blocks, right, j = workspace.block, workspace.block_vector, 2 * body
    add(blocks[block_index(j, j)].entry, K)
    add(blocks[block_index(j + 1, j)].entry, L)
    add(blocks[block_index(j + 1, j + 1)].entry, A)
    add_wrench(right[j].component, right[j + 1].component, sign, total)


@sequence
def add_half_pair(pair, workspace, a, b, bodies):
    """Adds the sums of a half-pair of solids a and b; what isn't a body doesn't move."""
    blocks, sums = workspace.block, workspace.contact_sum
    K, L, A, total = sums[0].entry, sums[1].entry, sums[2].entry, sums[3].entry
    if a < bodies:
        add_body(workspace, a, 1.0, K, L, A, total)
    if b < bodies:
        d, M, N, B = sums[4].entry, sums[5].entry, sums[6].entry, sums[7].entry
        move_wrench(total, d, pair)
        # with the surface's arms s = r + d: [s]x K, [s]x K [r]x^T and [s]x K [s]x^T
        set_cross_transposed(M, L, d, K)
        set_cross_transposed(N, A, d, L)
        set_transposed(B, N)
        set_cross_transposed(B, B, d, M)
        add_body(workspace, b, -1.0, K, M, B, total)
        if a < bodies:
            high, low = 2 * max(a, b), 2 * min(a, b)
            P, Q = blocks[block_index(high, low)], blocks[block_index(high, low + 1)]
            S, T = blocks[block_index(high + 1, low)], blocks[block_index(high + 1, low + 1)]
            use(P)
            use(Q)
            use(S)
            use(T)
            subtract(P.entry, K)
            if a > b:
                subtract_transposed(Q.entry, M)
                subtract(S.entry, L)
                subtract_transposed(T.entry, N)
            else:
                subtract_transposed(Q.entry, L)
                subtract(S.entry, M)
                subtract(T.entry, N)
