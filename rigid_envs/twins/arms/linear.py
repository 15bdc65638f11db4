"""Small symmetric systems of equations, by Cholesky's factors, in `LANES` worlds side by side."""

import math

from physics.compiler.jit import LANES, stage


@stage
def factor(matrix, count):
    """Replaces the lower half of positive definite matrices by their Cholesky factors.

    The diagonals become those of the factors, inverted. The upper half isn't touched.

    Args:
        matrix: [count, count, LANES] in its upper left corner.
        count: of rows.
    """
    for i in range(count):
        for j in range(i + 1):
            for k in range(j):
                for lane in range(LANES):
                    matrix[i, j, lane] -= matrix[i, k, lane] * matrix[j, k, lane]
            for lane in range(LANES):
                if i == j:
                    matrix[i, i, lane] = 1.0 / math.sqrt(matrix[i, i, lane])
                else:
                    matrix[i, j, lane] *= matrix[j, j, lane]


@stage
def solve(factored, x, count):
    """Replaces x [count, LANES] by the solution of the systems whose right-hand sides it is."""
    for i in range(count):
        for k in range(i):
            for lane in range(LANES):
                x[i, lane] -= factored[i, k, lane] * x[k, lane]
        for lane in range(LANES):
            x[i, lane] *= factored[i, i, lane]
    for i in range(count - 1, -1, -1):
        for k in range(i + 1, count):
            for lane in range(LANES):
                x[i, lane] -= factored[k, i, lane] * x[k, lane]
        for lane in range(LANES):
            x[i, lane] *= factored[i, i, lane]
