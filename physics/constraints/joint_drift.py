"""Drift of bodies with joints: impulses before it make the constraints hold after it.

This is the first half of RATTLE (Andersen 1983): the impulses act along the constraints of the
start of the step, and are found by Newton's method with the matrix of the start. A limit acts in
the same way where the step would pass it, and only pushes. Where this doesn't converge, see
`projection`.
"""

import math

from physics.compiler.jit import LANES, stage
from physics.constraints.envelope import factor
from physics.constraints.projection import make_projection, write_rotations
from physics.constraints.rows import linearise_rows, measure_rows
from physics.constraints.violations import EXACT, NEARLY_EXACT, correct_momenta, find_violations
from physics.integrators.drift import make_drift
from physics.model.features import cached_by_features
from physics.model.tables import EQUALITY, MOTOR

# Newton's method gains a factor of about the angle of a step with each iteration
_MOST_ITERATIONS = 30


@stage
def write_world_frame(workspace):
    """Writes the row that stands for the world, the last one."""
    world = workspace.solid[workspace.solid.shape[0] - 1]
    for i in range(LANES):
        for c in range(3):
            world.position[c, i] = 0.0
        for c in range(9):
            world.rotation[c, i] = 1.0 if c % 4 == 0 else 0.0


@stage
def _save(model, workspace):
    for m in range(model.dynamic.shape[0]):
        solid, start = workspace.solid[m], workspace.start[m]
        _copy_pose(solid, start)
        for i in range(LANES):
            for c in range(3):
                start.momentum[c, i] = solid.momentum[c, i]
                start.angular_momentum[c, i] = solid.angular_momentum[c, i]


@stage
def _restore_poses(model, workspace):
    for m in range(model.dynamic.shape[0]):
        _copy_pose(workspace.start[m], workspace.solid[m])


@stage
def _copy_pose(source, target):
    for i in range(LANES):
        for c in range(3):
            target.position[c, i] = source.position[c, i]
        for c in range(4):
            target.orientation[c, i] = source.orientation[c, i]


@stage
def _take_impulses_back(model, workspace):
    """Restores the momenta of unconverged lanes."""
    unconverged = workspace.lane[0].joint_unconverged
    for m in range(model.dynamic.shape[0]):
        solid, start = workspace.solid[m], workspace.start[m]
        P, L = solid.momentum, solid.angular_momentum
        for i in range(LANES):
            for c in range(3):
                P[c, i] = start.momentum[c, i] if unconverged[i] != 0 else P[c, i]
                L[c, i] = start.angular_momentum[c, i] if unconverged[i] != 0 else L[c, i]
    for r in range(model.joint_row.shape[0]):
        force = workspace.joint[r].force
        for i in range(LANES):
            force[i] = 0.0 if unconverged[i] != 0 else force[i]


@stage
def _judge(lane):
    """Ends lanes whose violation hasn't at least halved; returns how many are left.

    A lane that has ended is judged again while others go on, and must end again.
    """
    left = 0
    for i in range(LANES):
        halved = lane.joint_residual[i] <= 0.5 * lane.joint_before[i] and lane.joint_stuck[i] == 0
        if lane.joint_unconverged[i] != 0 and not halved:
            lane.joint_stuck[i] |= 0 if lane.joint_residual[i] <= NEARLY_EXACT else 1
            lane.joint_unconverged[i] = 0
        lane.joint_before[i] = lane.joint_residual[i]
        left += lane.joint_unconverged[i]
    return left


@cached_by_features
def make_joint_drift(features):
    """Stage that moves and rotates all dynamic bodies, with joints if there are any."""
    joints, drift = features.joints, make_drift(features)
    project = make_projection(features)

    @stage
    def joint_drift(model, workspace, time):
        if not joints:
            drift(model, workspace, time)
        else:
            write_world_frame(workspace)
            write_rotations(model, workspace)
            linearise_rows(model, workspace)
            _save(model, workspace)
            lane, limits = workspace.lane[0], 0
            for r in range(model.joint_row.shape[0]):
                row, work = model.joint_row[r], workspace.joint[r]
                limits += 1 if row.role not in (EQUALITY, MOTOR) else 0
                for i in range(LANES):
                    work.force[i] = 0.0  # here: the impulse so far, N s
                    work.active[i] = 1 if row.role == EQUALITY else 0
            for i in range(LANES):
                lane.joint_before[i], lane.joint_stuck[i] = math.inf, 0
            for iteration in range(_MOST_ITERATIONS):
                if iteration > 0:
                    if iteration == 1 or limits > 0:
                        factor(model, workspace)
                    correct_momenta(model, workspace, time)
                    _restore_poses(model, workspace)
                drift(model, workspace, time)
                write_rotations(model, workspace)
                measure_rows(model, workspace)
                find_violations(model, workspace, EXACT)
                if _judge(lane) == 0:
                    break
            stuck = 0
            for i in range(LANES):
                lane.joint_stuck[i] |= lane.joint_unconverged[i]
                lane.joint_unconverged[i] = lane.joint_stuck[i]
                stuck += lane.joint_stuck[i]
            if stuck > 0:
                _take_impulses_back(model, workspace)
                _restore_poses(model, workspace)
                drift(model, workspace, time)
                project(model, workspace, time)

    return joint_drift
