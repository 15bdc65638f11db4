"""Matrices of 3 x 3 blocks with one world per lane, and their direct solution.

The matrix is symmetric and positive definite. It is factored as L D L^T by blocks, from the first
row to the last; blocks that stay zero are skipped. A block is stored row by row in [9 LANES], so
that loops over all of it are long: the longer a loop is, the less LLVM's checks before it cost.
"""

from physics.compiler.jit import LANES, sequence, stage

# where the entries of a block start
XX, XY, XZ, YX, YY, YZ, ZX, ZY, ZZ = (LANES * j for j in range(9))
ENTRIES = 9 * LANES


@stage
def block_index(row, column):
    """Row of Workspace.block of a block on or below the diagonal."""
    return row * (row + 1) // 2 + column


@stage
def set_zero(M):
    """Sets a block to zero."""
    for j in range(ENTRIES):
        M[j] = 0.0


@stage
def add(out, M):
    """Adds M."""
    for j in range(ENTRIES):
        out[j] += M[j]


@stage
def subtract(out, M):
    """Subtracts M."""
    for j in range(ENTRIES):
        out[j] -= M[j]


@stage
def subtract_transposed(out, M):
    """Subtracts M^T."""
    for i in range(LANES):
        out[XX + i] -= M[XX + i]
        out[XY + i] -= M[YX + i]
        out[XZ + i] -= M[ZX + i]
        out[YX + i] -= M[XY + i]
        out[YY + i] -= M[YY + i]
        out[YZ + i] -= M[ZY + i]
        out[ZX + i] -= M[XZ + i]
        out[ZY + i] -= M[YZ + i]
        out[ZZ + i] -= M[ZZ + i]


@stage
def set_transposed(out, M):
    """Sets out to M^T."""
    for i in range(LANES):
        out[XX + i] = M[XX + i]
        out[XY + i] = M[YX + i]
        out[XZ + i] = M[ZX + i]
        out[YX + i] = M[XY + i]
        out[YY + i] = M[YY + i]
        out[YZ + i] = M[ZY + i]
        out[ZX + i] = M[XZ + i]
        out[ZY + i] = M[YZ + i]
        out[ZZ + i] = M[ZZ + i]


@stage
def set_cross_transposed(out, base, d, M):
    """Sets out to base + [d]x M^T; the columns of the latter are d x the rows of M."""
    for i in range(LANES):
        x, y, z = d[i], d[LANES + i], d[2 * LANES + i]
        xx, xy, xz = M[XX + i], M[XY + i], M[XZ + i]
        yx, yy, yz = M[YX + i], M[YY + i], M[YZ + i]
        zx, zy, zz = M[ZX + i], M[ZY + i], M[ZZ + i]
        out[XX + i] = base[XX + i] + (y * xz - z * xy)
        out[XY + i] = base[XY + i] + (y * yz - z * yy)
        out[XZ + i] = base[XZ + i] + (y * zz - z * zy)
        out[YX + i] = base[YX + i] + (z * xx - x * xz)
        out[YY + i] = base[YY + i] + (z * yx - x * yz)
        out[YZ + i] = base[YZ + i] + (z * zx - x * zz)
        out[ZX + i] = base[ZX + i] + (x * xy - y * xx)
        out[ZY + i] = base[ZY + i] + (x * yy - y * yx)
        out[ZZ + i] = base[ZZ + i] + (x * zy - y * zx)


@stage
def invert(M):
    """Replaces a symmetric block by its inverse."""
    for i in range(LANES):
        xx, xy, xz = M[XX + i], M[XY + i], M[XZ + i]
        yy, yz, zz = M[YY + i], M[YZ + i], M[ZZ + i]
        a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
        scale = 1.0 / (xx * a + xy * b + xz * c)
        e, f, g = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
        M[XX + i] = scale * a
        M[XY + i] = scale * b
        M[XZ + i] = scale * c
        M[YX + i] = scale * b
        M[YY + i] = scale * e
        M[YZ + i] = scale * f
        M[ZX + i] = scale * c
        M[ZY + i] = scale * f
        M[ZZ + i] = scale * g


@stage
def set_product(out, M, N):
    """Sets out to M N."""
    for i in range(LANES):
        xx, xy, xz = N[XX + i], N[XY + i], N[XZ + i]
        yx, yy, yz = N[YX + i], N[YY + i], N[YZ + i]
        zx, zy, zz = N[ZX + i], N[ZY + i], N[ZZ + i]
        x, y, z = M[XX + i], M[XY + i], M[XZ + i]
        out[XX + i] = x * xx + y * yx + z * zx
        out[XY + i] = x * xy + y * yy + z * zy
        out[XZ + i] = x * xz + y * yz + z * zz
        x, y, z = M[YX + i], M[YY + i], M[YZ + i]
        out[YX + i] = x * xx + y * yx + z * zx
        out[YY + i] = x * xy + y * yy + z * zy
        out[YZ + i] = x * xz + y * yz + z * zz
        x, y, z = M[ZX + i], M[ZY + i], M[ZZ + i]
        out[ZX + i] = x * xx + y * yx + z * zx
        out[ZY + i] = x * xy + y * yy + z * zy
        out[ZZ + i] = x * xz + y * yz + z * zz


@stage
def subtract_product_transposed(out, M, N):
    """Subtracts M N^T."""
    for i in range(LANES):
        xx, xy, xz = N[XX + i], N[XY + i], N[XZ + i]
        yx, yy, yz = N[YX + i], N[YY + i], N[YZ + i]
        zx, zy, zz = N[ZX + i], N[ZY + i], N[ZZ + i]
        x, y, z = M[XX + i], M[XY + i], M[XZ + i]
        out[XX + i] -= x * xx + y * xy + z * xz
        out[XY + i] -= x * yx + y * yy + z * yz
        out[XZ + i] -= x * zx + y * zy + z * zz
        x, y, z = M[YX + i], M[YY + i], M[YZ + i]
        out[YX + i] -= x * xx + y * xy + z * xz
        out[YY + i] -= x * yx + y * yy + z * yz
        out[YZ + i] -= x * zx + y * zy + z * zz
        x, y, z = M[ZX + i], M[ZY + i], M[ZZ + i]
        out[ZX + i] -= x * xx + y * xy + z * xz
        out[ZY + i] -= x * yx + y * yy + z * yz
        out[ZZ + i] -= x * zx + y * zy + z * zz


@stage
def subtract_times(out, M, v):
    """Subtracts M v from a vector."""
    for i in range(LANES):
        x, y, z = v[0, i], v[1, i], v[2, i]
        out[0, i] -= M[XX + i] * x + M[XY + i] * y + M[XZ + i] * z
        out[1, i] -= M[YX + i] * x + M[YY + i] * y + M[YZ + i] * z
        out[2, i] -= M[ZX + i] * x + M[ZY + i] * y + M[ZZ + i] * z


@stage
def multiply(M, v):
    """Replaces a vector v by M v."""
    for i in range(LANES):
        x, y, z = v[0, i], v[1, i], v[2, i]
        v[0, i] = M[XX + i] * x + M[XY + i] * y + M[XZ + i] * z
        v[1, i] = M[YX + i] * x + M[YY + i] * y + M[YZ + i] * z
        v[2, i] = M[ZX + i] * x + M[ZY + i] * y + M[ZZ + i] * z


@stage
def subtract_scaled(out, P, M, v):
    """Subtracts P M^T v from a vector, P symmetric."""
    for i in range(LANES):
        x = M[XX + i] * v[0, i] + M[YX + i] * v[1, i] + M[ZX + i] * v[2, i]
        y = M[XY + i] * v[0, i] + M[YY + i] * v[1, i] + M[ZY + i] * v[2, i]
        z = M[XZ + i] * v[0, i] + M[YZ + i] * v[1, i] + M[ZZ + i] * v[2, i]
        out[0, i] -= P[XX + i] * x + P[XY + i] * y + P[XZ + i] * z
        out[1, i] -= P[YX + i] * x + P[YY + i] * y + P[YZ + i] * z
        out[2, i] -= P[ZX + i] * x + P[ZY + i] * y + P[ZZ + i] * z


@sequence
def factor(blocks, scaled, rows):
    """Factors the matrix: inverse pivots on the diagonal, L D below it."""
    for k in range(rows):
        pivot = blocks[block_index(k, k)].entry
        invert(pivot)
        for a in range(k + 1, rows):
            left = blocks[block_index(a, k)]
            if left.used != 0:
                set_product(scaled, left.entry, pivot)
                for b in range(k + 1, a + 1):
                    right = blocks[block_index(b, k)]
                    if right.used != 0:
                        out = blocks[block_index(a, b)]
                        if out.used == 0:
                            set_zero(out.entry)
                        out.used = 1
                        subtract_product_transposed(out.entry, scaled, right.entry)


@sequence
def solve(blocks, vectors, rows):
    """Replaces the right side by the solution."""
    for k in range(rows):
        y = vectors[k].component
        for b in range(k):
            left = blocks[block_index(k, b)]
            if left.used != 0:
                subtract_times(y, left.entry, vectors[b].component)
        multiply(blocks[block_index(k, k)].entry, y)
    for s in range(rows):
        k = rows - 1 - s
        x = vectors[k].component
        for b in range(k):
            left = blocks[block_index(k, b)]
            if left.used != 0:
                pivot = blocks[block_index(b, b)].entry
                subtract_scaled(vectors[b].component, pivot, left.entry, x)
