"""Which rows of joints don't hold at the present poses, and the impulses that remove that."""

import math

from physics.compiler.jit import LANES, at, stage
from physics.constraints.envelope import solve
from physics.constraints.rows import add_along_row
from physics.model.tables import EQUALITY, MOTOR

# relative to the lengths that a value is computed from: round-off
EXACT = 1e-13
# the same of badly conditioned rows, at which an iteration may end
NEARLY_EXACT = 1e-11


@stage
def find_violations(model, workspace, tolerance):
    """Marks rows that must act, and lanes that have any; returns the number of such lanes.

    An equality acts always. A limit acts where it is passed, or where it has pushed too far. Writes
    the largest relative violation of each lane, infinity where a limit begins or ends to act.

    Args:
        model: of the lane group.
        workspace: of the lane group, with the values of all rows.
        tolerance: relative to the lengths that a value is computed from.
    """
    lane = workspace.lane[0]
    for i in range(LANES):
        lane.joint_unconverged[i] = 0
        lane.joint_residual[i] = 0.0
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        if row.role == MOTOR:
            continue
        position = workspace.solid[row.a].position
        for i in range(LANES):
            far = abs(position[0, i]) + abs(position[1, i]) + abs(position[2, i])
            C, size = work.value[i], at(row.scale, i) + far
            most = tolerance * size
            if row.role == EQUALITY:
                violated = not abs(C) <= most  # NaN counts
            else:
                violated = (-most > C) | ((work.force[i] > 0.0) & (most < C))
                acts = 1 if (-most > C) | (work.force[i] > 0.0) else 0
                if acts != work.active[i]:
                    lane.joint_residual[i] = math.inf
                work.active[i] = acts
            violated = violated & (lane.active[i] != 0)
            lane.joint_unconverged[i] = 1 if violated else lane.joint_unconverged[i]
            relative = abs(C) / size if violated else 0.0
            lane.joint_residual[i] = max(lane.joint_residual[i], relative)
    left = 0
    for i in range(LANES):
        left += lane.joint_unconverged[i]
    return left


@stage
def correct_momenta(model, workspace, time):
    """Impulses along the rows that remove the present values in `time` s, in unconverged lanes.

    To first order, if the factor is of the rows at which values change.
    """
    unconverged = workspace.lane[0].joint_unconverged
    for r in range(model.joint_row.shape[0]):
        work = workspace.joint[r]
        for i in range(LANES):
            acts = (unconverged[i] != 0) & (work.active[i] != 0)
            work.change[i] = -work.value[i] / time if acts else 0.0
    solve(model, workspace)
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        A, B = workspace.solid[row.a], workspace.solid[row.b]
        for i in range(LANES):
            change = work.change[i] if unconverged[i] != 0 else 0.0
            if row.role != EQUALITY:
                change = max(change, -work.force[i])  # a limit doesn't pull
            work.change[i] = change
            work.force[i] += change
        add_along_row(
            work, work.change, A.momentum, A.angular_momentum, B.momentum, B.angular_momentum
        )
