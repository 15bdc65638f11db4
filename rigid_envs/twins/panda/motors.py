"""Motors of the Panda's arm, and the table that its fingers meet, as Bullet computes them.

In a substep a motor takes away a part of its angle's error, as far as its torque allows. The table
is a spring and damper, and its friction at most a part of the force in the substep before. So the
impulses of all of them lie between limits: a linear complementarity problem.
"""

import math

import numpy as np

from physics.compiler.jit import LANES, sequence, stage
from rigid_envs.twins.arms.limits import limit_impulses, sweep
from rigid_envs.twins.arms.work import JOINTS, ROWS

SUBSTEPS, SUBSTEP = 20, 0.002  # in a step; s
PIECES = 4  # of a step, for each of which the mass matrix is computed
TORQUE = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 120.0, 120.0])  # N m, largest of the motors
GAIN = 0.1  # part of an angle's error that a motor takes away in a substep
# the fingers' tip on the table: how far it is below the hand's point, m (7.3 mm of the mesh,
# 1 mm of PyBullet's margin); stiffness of both fingers in N/m, their damping in N s/m, and
# friction. Bullet makes of stiffness and damping which part of a depth is pushed out in a
# substep, and how much velocity in m/s an impulse in N s leaves
TIP, STIFFNESS, DAMPER, TABLE_FRICTION = 0.0083, 60e3, 2e3, 0.5
PUSHED_OUT = SUBSTEP * STIFFNESS / (SUBSTEP * STIFFNESS + DAMPER)
SOFTNESS = 1.0 / (SUBSTEP * (SUBSTEP * STIFFNESS + DAMPER))
# 1/kg, of the rows of friction: motors and friction would contradict each other. Small: at the
# start of an episode a hand answers an impulse by 1.2 (along x) and 0.8 m/s (along y) per N s
SLIP = 0.002
STILL = 1e-3  # m/s, of a tip that friction holds
NEARBY = 0.03  # m, of a tip that may reach the table in a piece of a step


@sequence
def begin(work):
    """No motor is at its limit, and no hand on the table, at the start of a step."""
    for lane in range(LANES):
        work.pressed[lane] = 0.0
        for r in range(ROWS):
            work.sides[r, lane] = 0.0 if r < JOINTS else -1.0


@sequence
def drive(work):
    """Motors drive the hinges to their aims for a piece of a step; the table stops hands."""
    lack = work.lack
    for lane in range(LANES):
        rows = _begin_piece(work, lane)
        for _ in range(SUBSTEPS // PIECES):
            for i in range(JOINTS):
                work.angles[i, lane] += SUBSTEP * work.speeds[i, lane]
                error = work.aim[i, lane] - work.angles[i, lane]
                lack[i] = GAIN / SUBSTEP * error - work.speeds[i, lane]
            if rows > JOINTS:
                for r in range(JOINTS, rows):
                    lack[r] = 0.0
                    for i in range(JOINTS):
                        lack[r] -= work.contact[r - JOINTS, i] * work.speeds[i, lane]
                work.gap[lane] -= SUBSTEP * lack[JOINTS]
                part = 1.0 if work.gap[lane] > 0.0 else PUSHED_OUT
                lack[JOINTS] -= part * work.gap[lane] / SUBSTEP
                slip = math.sqrt(lack[JOINTS + 1] ** 2 + lack[JOINTS + 2] ** 2)
                for r in range(JOINTS + 1, rows):
                    work.high[r] = TABLE_FRICTION * work.pressed[lane]
                    if slip > STILL:  # along the slip
                        work.high[r] *= abs(lack[r]) / slip
                    work.low[r] = -work.high[r]
            limit_impulses(work, rows)
            for i in range(JOINTS):
                work.speeds[i, lane] += work.gain[i]
            if rows > JOINTS:
                work.pressed[lane] = max(work.impulse[JOINTS], 0.0)
                work.load[lane] += work.pressed[lane] / (SUBSTEPS * SUBSTEP)
        for r in range(rows):
            work.sides[r, lane] = work.side[r]


@stage
def _begin_piece(work, lane):
    """Writes the rows of `drive` in one world: of the motors, and of the table.

    A row's velocity is that of a hinge, or of the fingers' tip along z, x or y. With free motors
    the hinges have the speeds that are asked for, so the system of `limits` is known: minus the
    mass matrix for the motors, the table's softness for its rows, and its Jacobian in between. A
    motor's impulse is counted without what keeps the speed, so its limits aren't symmetric.

    Returns:
        How many rows there are: those of the table are left out where the hand isn't near it.
    """
    J, system, contact = work.jacobian, work.system, work.contact
    work.gap[lane] = work.origin[JOINTS, 2, lane] - TIP - work.support[lane]
    rows = JOINTS
    if work.gap[lane] < NEARBY:
        rows = JOINTS + 3
    for i in range(JOINTS):
        for k in range(JOINTS):
            system[i, k] = -work.mass_matrix[i, k, lane]
        hold = SUBSTEP * work.bias[i, lane]
        work.low[i], work.high[i] = -SUBSTEP * TORQUE[i] - hold, SUBSTEP * TORQUE[i] - hold
    for i in range(JOINTS):  # the tip is below the hand's point: d = (0, 0, -TIP)
        contact[0, i] = J[2, i, lane]
        contact[1, i] = J[0, i, lane] - TIP * J[4, i, lane]
        contact[2, i] = J[1, i, lane] + TIP * J[3, i, lane]
    if rows == JOINTS:
        work.pressed[lane] = 0.0
        for r in range(JOINTS, ROWS):
            work.sides[r, lane] = -1.0
            for k in range(ROWS):
                system[r, k] = 0.0
    else:
        work.low[JOINTS], work.high[JOINTS] = 0.0, math.inf
        for r in range(JOINTS, ROWS):
            for i in range(JOINTS):
                system[r, i] = system[i, r] = contact[r - JOINTS, i]
            for k in range(JOINTS, ROWS):
                system[r, k] = 0.0
            system[r, r] = SOFTNESS if r == JOINTS else SLIP
    for r in range(rows):
        work.side[r] = work.sides[r, lane]
        if r < JOINTS and work.side[r] != 0.0:
            sweep(work, rows, r, -1.0)
        if r >= JOINTS and work.side[r] == 0.0:
            sweep(work, rows, r, 1.0)
    return rows
