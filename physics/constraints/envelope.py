"""Direct solution of the coupled rows: J W J^T x = y, W the inverse masses of the bodies.

The matrix is factored as L D L^T within its envelope: row r has entries from column `first` on,
and the factor fills no others. A row whose pivot vanishes depends on the rows before it, as in a
planar linkage, which three rows per loop hold twice; it is left out, and so are rows that aren't
active. Both are marked by an inverse pivot of zero.
"""

from physics.compiler.jit import LANES, at, stage

# relative to the diagonal, smallest pivot of a row that doesn't depend on others: round-off
_INDEPENDENT = 1e-11


@stage
def _add_mobility(out, sign, inverse_mass, one, moment, other, turn):
    """Adds what a unit along one row does to the rate of another, by a body that they share."""
    for i in range(LANES):
        rate = at(inverse_mass, i) * (
            one[0, i] * other[0, i] + one[1, i] * other[1, i] + one[2, i] * other[2, i]
        )
        rate += moment[0, i] * turn[0, i] + moment[1, i] * turn[1, i] + moment[2, i] * turn[2, i]
        out[i] += sign * rate


@stage
def _write_entry(model, workspace, r, c, out):
    """Writes entry (r, c) of the matrix."""
    one, other = model.joint_row[r], model.joint_row[c]
    this, that = workspace.joint[r], workspace.joint[c]
    for i in range(LANES):
        out[i] = 0.0
    n, m = this.direction, that.direction
    ma = model.dynamic[one.a].inverse_mass
    if one.a == other.a:
        _add_mobility(out, 1.0, ma, n, this.moment_a, m, that.turn_a)
    if one.a == other.b:
        _add_mobility(out, -1.0, ma, n, this.moment_a, m, that.turn_b)
    if one.b < model.dynamic.shape[0]:
        mb = model.dynamic[one.b].inverse_mass
        if one.b == other.a:
            _add_mobility(out, -1.0, mb, n, this.moment_b, m, that.turn_a)
        if one.b == other.b:
            _add_mobility(out, 1.0, mb, n, this.moment_b, m, that.turn_b)


@stage
def factor(model, workspace):
    """Factors the matrix of the active rows."""
    entries = workspace.joint_factor
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        first, start = row.first, row.entry - row.first
        for c in range(first, r):
            g = entries[start + c]
            _write_entry(model, workspace, r, c, g)
            column = model.joint_row[c]
            for k in range(max(first, column.first), c):
                left, upper = entries[start + k], entries[column.entry + k - column.first]
                for i in range(LANES):
                    g[i] -= left[i] * upper[i]
        pivot, diagonal = work.inverse_pivot, work.change
        _write_entry(model, workspace, r, r, pivot)
        for i in range(LANES):
            diagonal[i] = pivot[i]
        for c in range(first, r):
            g, inverse = entries[start + c], workspace.joint[c].inverse_pivot
            for i in range(LANES):
                scaled = g[i] * inverse[i]
                pivot[i] -= g[i] * scaled
                g[i] = scaled
        for i in range(LANES):
            independent = (work.active[i] != 0) & (pivot[i] > _INDEPENDENT * diagonal[i])
            pivot[i] = 1.0 / pivot[i] if independent else 0.0


@stage
def solve(model, workspace):
    """Replaces the right side in `change` by the solution; zero in rows that are left out."""
    entries, rows = workspace.joint_factor, model.joint_row.shape[0]
    for r in range(rows):
        row, y = model.joint_row[r], workspace.joint[r].change
        for c in range(row.first, r):
            left, before = entries[row.entry + c - row.first], workspace.joint[c].change
            for i in range(LANES):
                y[i] -= left[i] * before[i]
    for r in range(rows):
        work = workspace.joint[r]
        for i in range(LANES):
            work.change[i] *= work.inverse_pivot[i]
    for s in range(rows):
        r = rows - 1 - s
        row, x = model.joint_row[r], workspace.joint[r].change
        for c in range(row.first, r):
            left, before = entries[row.entry + c - row.first], workspace.joint[c].change
            for i in range(LANES):
                before[i] -= left[i] * x[i]
