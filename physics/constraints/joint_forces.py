"""Forces of joints, limits and motors at the end of a drift: the second half of RATTLE.

While forces are computed, velocities are those of half a step ago, u = v(t - h/2). The half kick
that follows changes them by W F h/2, with the inverse masses W. The force x along the rows of a
joint makes it hold for the velocities at the end of the step, J v(t) = 0:

    J W J^T x = -2/h J u - J W F.

The next half kick begins with the same force. The drift after it corrects it along the joint's
rows, see `joint_drift`, but not along the direction that a joint leaves free. There the velocity
after the whole kick counts: a motor makes it J v(t + h/2) = r, its set velocity, and a limit that
is touched makes it at least 0,

    J W J^T x = (r - J u)/h - J W F.

A force beyond the motor's limit, or one with which a limit would pull, is set to its bound, and the
other rows are solved again. A motor that would drive beyond a limit brakes there. In a refresh
there was no drift: then x makes J dv/dt + dJ/dt v = 0, and a motor's velocity counts after the half
kick that follows.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.constraints.convective import make_convective_rates
from physics.constraints.envelope import factor, solve
from physics.constraints.joint_drift import write_world_frame
from physics.constraints.rows import add_along_row, add_rates_of_momenta, linearise_rows
from physics.model.features import cached_by_features
from physics.model.tables import ANGLE, EQUALITY, MOTOR

# relative to the lengths that a value is computed from: a limit that is nearer is touched
TOUCHED = 1e-9
# of a servo, times the substep: from 1 on it would overshoot
HIGHEST_SERVO = 0.5


@stage
def _start(model, state, workspace, h):
    """Marks the rows that act and reads the motors' velocities; returns the number with bounds."""
    bounded = 0
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        bounded += 0 if row.role == EQUALITY else 1
        for i in range(LANES):
            low, high = at(row.limits[0], i), at(row.limits[1], i)
            margin = TOUCHED * at(row.scale, i)
            work.force[i] = 0.0
            work.rate[i] = 0.0
            work.active[i] = 1
            if row.role == MOTOR:
                w = workspace.lane[0].world[i]
                rate = 0.0
                if w >= 0:
                    rate = state.motor[w, row.motor, 0]
                    aim = state.motor[w, row.motor, 1] - at(row.middle, i)
                    left = min(max(aim, low), high) - work.value[i]
                    if row.kind == ANGLE and high == math.inf:  # the shorter way
                        left -= 2.0 * math.pi * math.floor(left / (2.0 * math.pi) + 0.5)
                    # its velocity is reached within a substep: more than that would overshoot
                    frequency = min(at(row.frequency, i), HIGHEST_SERVO / h)
                    rate = frequency * left if aim == aim else rate  # NaN: no servo
                rate = max(rate, 0.0) if work.value[i] <= low + margin else rate
                rate = min(rate, 0.0) if work.value[i] >= high - margin else rate
                work.rate[i] = rate
            elif row.role != EQUALITY:
                work.active[i] = 1 if work.value[i] <= margin else 0
    return bounded


@stage
def _write_right_side(model, workspace, h, drifted):
    """Writes what forces along the rows have to change."""
    per_half = 2.0 / drifted if drifted > 0.0 else 0.0
    per_kick = 1.0 / drifted if drifted > 0.0 else 2.0 / h
    unconverged = workspace.lane[0].joint_unconverged
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        A, B = workspace.solid[row.a], workspace.solid[row.b]
        factor_of_rate = per_half if row.role == EQUALITY else per_kick
        y = work.change
        for i in range(LANES):
            y[i] = factor_of_rate * work.rate[i] - work.convective[i]
        P, L, Q, M = A.momentum, A.angular_momentum, B.momentum, B.angular_momentum
        add_rates_of_momenta(model, row, work, P, L, Q, M, -factor_of_rate, y)
        add_rates_of_momenta(model, row, work, A.force, A.torque, B.force, B.torque, -1.0, y)
        for i in range(LANES):
            acts = (work.active[i] != 0) & (unconverged[i] != 0)
            y[i] = y[i] if acts else 0.0


@stage
def bound_changes(model, workspace, per_force):
    """Sets rows beyond their bounds to the bound, and ends lanes in which none is.

    In a lane with such rows nothing else changes yet. Returns the number of lanes that are left.

    Args:
        model: of the lane group.
        workspace: of the lane group; `force` holds what acts along each row so far.
        per_force: s if the amounts are impulses; 1 for forces.
    """
    lane = workspace.lane[0]
    beyond = lane.joint_beyond
    for i in range(LANES):
        beyond[i] = 0
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        if row.role == EQUALITY:
            continue
        for i in range(LANES):
            most = per_force * at(row.force_limit, i)
            new = work.force[i] + work.change[i]
            bound = max(new, 0.0) if row.role != MOTOR else min(max(new, -most), most)
            out = (bound != new) & (work.active[i] != 0)
            work.active[i] = 0 if out else work.active[i]
            work.change[i] = bound - work.force[i] if out else work.change[i]
            work.clamped[i] = 1 if out else 0
            beyond[i] = 1 if out else beyond[i]
    left = 0
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        for i in range(LANES):
            kept = (beyond[i] == 0) | ((row.role != EQUALITY) & (work.clamped[i] != 0))
            work.change[i] = work.change[i] if kept else 0.0
            work.force[i] += work.change[i]
    for i in range(LANES):
        lane.joint_unconverged[i] = lane.joint_unconverged[i] if beyond[i] != 0 else 0
        left += lane.joint_unconverged[i]
    return left


@cached_by_features
def make_joint_forces(features):
    """Stage that adds the forces along all rows of joints."""
    joints = features.joints
    convective_rates = make_convective_rates(features)

    @stage
    def joint_forces(model, state, workspace, h, drifted):
        """`h`: s, the step; `drifted`: s, what the last drift took, 0 in a refresh."""
        if joints:
            lane = workspace.lane[0]
            write_world_frame(workspace)
            linearise_rows(model, workspace)
            convective_rates(model, workspace, drifted)
            bounded = _start(model, state, workspace, h)
            for i in range(LANES):
                lane.joint_unconverged[i] = 1
            for _ in range(bounded + 1):  # each pass but the last bounds a row in every lane left
                factor(model, workspace)
                _write_right_side(model, workspace, h, drifted)
                solve(model, workspace)
                left = bound_changes(model, workspace, 1.0)
                for r in range(model.joint_row.shape[0]):
                    row, work = model.joint_row[r], workspace.joint[r]
                    A, B = workspace.solid[row.a], workspace.solid[row.b]
                    add_along_row(work, work.change, A.force, A.torque, B.force, B.torque)
                if left == 0:
                    break
            for r in range(model.joint_row.shape[0]):
                for i in range(LANES):
                    workspace.joint[r].known_force[i] = workspace.joint[r].force[i]

    return joint_forces
