"""Impulses between limits in one world, by principal pivoting.

Impulses x of rows change the rows' velocities by A x, with A symmetric and positive definite. Each
row lacks some velocity. A free row gets it; a row at a limit of its impulse still lacks something
in the direction of that limit: a linear complementarity problem. Known are what free rows lack and
the impulses at limits, together g. Unknown are the impulses of free rows, -S g, and what the others
gain, S g, where S is A after a sweep of each free row. A sweep is undone by another one, so little
is computed when a row comes to its limit or leaves it.

Sources: Beaton, The use of special matrix operators in statistical calculus (1964), of the sweep;
Murty, Linear Complementarity (1988), chapter 4, of principal pivoting. Worlds aren't side by side
here, for some need one round and others five.
"""

from physics.compiler.jit import sequence, stage
from rigid_envs.twins.arms.work import ROWS, WIDTH

ROUNDS = 8  # of correcting which rows are at a limit, at most


@sequence
def limit_impulses(work, rows):
    """Writes impulses between `work.low` and `work.high`, and what rows gain by them.

    Args:
        work: `lack`, what rows lack; `side`, -1 or 1 for rows that are believed to be at that
            limit, 0 for free ones; `system`, S for these sides, finite also beyond the rows. Sides
            and S are corrected.
        rows: how many.
    """
    found, given = work.found, work.given
    for r in range(rows, ROWS):
        given[r] = 0.0
    for _ in range(ROUNDS):
        for r in range(rows):
            side, limit = work.side[r], work.low[r]
            if side > 0.0:
                limit = work.high[r]
            given[r] = work.lack[r] if side == 0.0 else limit
        for k in range(WIDTH):
            total = 0.0
            for r in range(ROWS):
                total += work.system[r, k] * given[r]
            found[k] = total
        turned = False
        for r in range(rows):
            side, lack, low, high = work.side[r], work.lack[r], work.low[r], work.high[r]
            new = side
            if side == 0.0:
                impulse, gain = -found[r], given[r]
                if impulse < low:
                    new = -1.0
                if impulse > high:
                    new = 1.0
            else:
                impulse, gain = given[r], found[r]
                if low < high and (lack - gain) * side < 0.0:  # friction needs a force
                    new = 0.0
            work.impulse[r], work.gain[r], work.new_side[r] = impulse, gain, new
            turned = turned or new != side
        if not turned:
            break
        for r in range(rows):
            if work.new_side[r] != work.side[r]:
                sweep(work, rows, r, 1.0 if work.new_side[r] == 0.0 else -1.0)
                work.side[r] = work.new_side[r]


@stage
def sweep(work, rows, r, sign):
    """Sweeps row r of `work.system`, or undoes that, with the sign -1."""
    system, column, scaled = work.system, work.column, work.scaled
    inverse = 1.0 / system[r, r]
    for k in range(WIDTH):
        column[k] = system[r, k]
        scaled[k] = inverse * column[k]
    scaled[r] = 1.0 - sign * inverse  # column r becomes sign * inverse times itself
    for i in range(rows):
        factor = column[i]
        for k in range(WIDTH):
            system[i, k] -= factor * scaled[k]
    for k in range(WIDTH):
        system[r, k] = sign * inverse * column[k]
    system[r, r] = -inverse
