"""Motors of the Panda's arm, and the table that its fingers meet, as Bullet computes them.

In a substep a motor takes away a part of its angle's error, as far as its torque allows. The table
is a spring and damper, and its friction at most a part of the force in the substep before. So the
impulses of all of them lie between limits: a linear complementarity problem.
"""

import math

import numpy as np

from physics.compiler.jit import LANES, sequence, stage
from rigid_envs.twins.arms.linear import factor, solve
from rigid_envs.twins.arms.work import JOINTS

SUBSTEPS, SUBSTEP = 20, 0.002  # in a step; s
PIECES = 4  # of a step, for each of which the mass matrix is computed
TORQUE = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 120.0, 120.0])  # N m, largest of the motors
GAIN = 0.1  # part of an angle's error that a motor takes away in a substep
ROUNDS = 8  # of finding the rows at a limit, at most
# the fingers' tip on the table: how far it is below the hand's point, m; stiffness of both fingers
# in N/m, their damping in N s/m, and friction. Bullet makes of the first two which part of a depth
# is pushed out in a substep, and how much velocity in m/s an impulse in N s leaves
TIP, STIFFNESS, DAMPER, TABLE_FRICTION = 0.0083, 60e3, 2e3, 0.5
PUSHED_OUT = SUBSTEP * STIFFNESS / (SUBSTEP * STIFFNESS + DAMPER)
SOFTNESS = 1.0 / (SUBSTEP * (SUBSTEP * STIFFNESS + DAMPER))
SLIP = 0.01  # of a row of friction, relative; motors and friction would contradict each other
NEARBY = 0.03  # m, of a tip that may reach the table in a piece of a step


@sequence
def touch(work):
    """Finds hands that may meet the table in this piece of a step; writes the rows of `drive`.

    A row's velocity is that of a hinge, or of the fingers' tip along z, x or y. Row r of
    `work.along` is how hinges answer an impulse of row r.

    Returns:
        How many rows there are: those of the table are left out if no hand is near it.
    """
    J, along, response = work.jacobian, work.along, work.response
    near = 0.0
    for lane in range(LANES):
        gap = work.origin[JOINTS, 2, lane] - TIP - work.support[lane]
        work.gap[lane] = gap
        near += 1.0 if gap < NEARBY else 0.0
    rows = JOINTS + 3 if near > 0.0 else JOINTS
    for r in range(JOINTS):
        for i in range(JOINTS):
            for lane in range(LANES):
                along[r, i, lane] = work.inverse[0, r, i, lane]
                response[r, i, lane] = work.inverse[0, r, i, lane]
    for r in range(JOINTS, rows):
        for i in range(JOINTS):
            for lane in range(LANES):  # the tip is below the hand's point: d = (0, 0, -TIP)
                x = J[0, i, lane] - TIP * J[4, i, lane]
                y = J[1, i, lane] + TIP * J[3, i, lane]
                z = J[2, i, lane]
                work.contact[r - JOINTS, i, lane] = (
                    z if r == JOINTS else x if r == JOINTS + 1 else y
                )
        for i in range(JOINTS):
            for lane in range(LANES):
                along[r, i, lane] = 0.0
            for j in range(JOINTS):
                for lane in range(LANES):
                    along[r, i, lane] += (
                        work.inverse[0, i, j, lane] * work.contact[r - JOINTS, j, lane]
                    )
            for lane in range(LANES):
                response[r, i, lane] = along[r, i, lane]
                response[i, r, lane] = along[r, i, lane]
        for k in range(JOINTS, r + 1):
            for lane in range(LANES):
                response[r, k, lane] = 0.0
            for j in range(JOINTS):
                for lane in range(LANES):
                    response[r, k, lane] += work.contact[k - JOINTS, j, lane] * along[r, j, lane]
            for lane in range(LANES):
                if k == r:
                    soft = SOFTNESS if r == JOINTS else SLIP * response[r, r, lane]
                    response[r, r, lane] += soft
                response[k, r, lane] = response[r, k, lane]
    return rows


@sequence
def drive(work, rows):
    """Motors drive the hinges to their aims for a piece of a step; the table stops hands.

    The velocity of a row at a limit of its impulse still lacks something in that direction. Which
    rows those are is found by trying: those that need more are put at the limit, those that would
    need less are freed.
    """
    impulse, lack, side, low, high = (
        work.impulse, work.lack, work.side, work.low, work.high,
    )  # fmt: skip
    speeds, bias, aim = work.speeds, work.bias, work.aim
    for r in range(rows):
        limit = TORQUE[r] * SUBSTEP if r < JOINTS else 0.0
        for lane in range(LANES):
            side[r, lane] = 0.0 if r < JOINTS else -1.0
            low[r, lane] = -limit
            high[r, lane] = math.inf if r == JOINTS else limit
    changed = True
    for _ in range(SUBSTEPS // PIECES):
        for i in range(JOINTS):
            for lane in range(LANES):
                work.angles[i, lane] += SUBSTEP * speeds[i, lane]
        for r in range(JOINTS, rows):
            for lane in range(LANES):
                lack[r, lane] = 0.0
            for i in range(JOINTS):
                for lane in range(LANES):
                    lack[r, lane] -= work.contact[r - JOINTS, i, lane] * speeds[i, lane]
        if rows > JOINTS:
            for lane in range(LANES):
                work.gap[lane] -= SUBSTEP * lack[JOINTS, lane]
                gap = work.gap[lane]
                lack[JOINTS, lane] -= (1.0 if gap > 0.0 else PUSHED_OUT) * gap / SUBSTEP
        for i in range(JOINTS):
            for lane in range(LANES):
                error = aim[i, lane] - work.angles[i, lane]
                lack[i, lane] = GAIN / SUBSTEP * error - speeds[i, lane]
        for r in range(rows):
            for j in range(JOINTS):
                for lane in range(LANES):
                    lack[r, lane] += SUBSTEP * work.along[r, j, lane] * bias[j, lane]
        for _ in range(ROUNDS):
            if changed:
                _factor_free(work, rows)
            _find_impulses(work, rows)
            changed = _find_sides(work, rows) > 0.0
            if not changed:
                break
        if rows > JOINTS:
            for lane in range(LANES):
                work.load[lane] += max(impulse[JOINTS, lane], 0.0) / (SUBSTEPS * SUBSTEP)
        for r in range(JOINTS + 1, rows):
            for lane in range(LANES):
                most = TABLE_FRICTION * max(impulse[JOINTS, lane], 0.0)
                low[r, lane], high[r, lane] = -most, most
        for i in range(JOINTS):
            for lane in range(LANES):
                impulse[i, lane] -= SUBSTEP * bias[i, lane]
        for i in range(JOINTS):
            for r in range(rows):
                for lane in range(LANES):
                    speeds[i, lane] += work.along[r, i, lane] * impulse[r, lane]


@stage
def _factor_free(work, rows):
    """Factors of the responses of the rows that are not at a limit."""
    for i in range(rows):
        for j in range(i + 1):
            for lane in range(LANES):
                free = (1.0 - abs(work.side[i, lane])) * (1.0 - abs(work.side[j, lane]))
                work.system[i, j, lane] = free * work.response[i, j, lane]
                if i == j:
                    work.system[i, j, lane] += 1.0 - free
    factor(work.system, rows)


@stage
def _find_impulses(work, rows):
    """Impulses [rows, LANES] in N m s or N s: limits of some rows, what the others then need."""
    impulse, side = work.impulse, work.side
    for r in range(rows):
        for lane in range(LANES):
            at_limit = work.low[r, lane] if side[r, lane] < 0.0 else work.high[r, lane]
            work.left[r, lane] = at_limit if side[r, lane] != 0.0 else 0.0
    for r in range(rows):
        for lane in range(LANES):
            impulse[r, lane] = work.lack[r, lane]
        for k in range(rows):
            for lane in range(LANES):
                impulse[r, lane] -= work.response[r, k, lane] * work.left[k, lane]
        for lane in range(LANES):
            impulse[r, lane] = impulse[r, lane] if side[r, lane] == 0.0 else work.left[r, lane]
    solve(work.system, impulse, rows)


@stage
def _find_sides(work, rows):
    """Corrects which rows are at a limit: -1, 0 or 1; returns how many it corrected."""
    impulse, left, side = work.impulse, work.left, work.side
    changes = 0.0
    for r in range(rows):
        for lane in range(LANES):
            left[r, lane] = work.lack[r, lane]
        for k in range(rows):
            for lane in range(LANES):
                left[r, lane] -= work.response[r, k, lane] * impulse[k, lane]
        for lane in range(LANES):
            old, new = side[r, lane], side[r, lane]
            new = 1.0 if old == 0.0 and impulse[r, lane] > work.high[r, lane] else new
            new = -1.0 if old == 0.0 and impulse[r, lane] < work.low[r, lane] else new
            free = work.low[r, lane] < work.high[r, lane]  # friction needs a force
            new = 0.0 if free and left[r, lane] * old < 0.0 else new
            side[r, lane] = new
            changes += abs(new - old)
    return changes
