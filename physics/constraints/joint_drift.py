"""Drift of bodies with joints: impulses before it make the constraints hold after it.

This is the first half of RATTLE (Andersen 1983): the impulses act along the constraints of the
start of the step, and are found by Newton's method with the matrix of the start. A limit acts in
the same way where the step would pass it, and only pushes.
"""

from physics.compiler.jit import LANES, stage
from physics.constraints.envelope import factor, solve
from physics.constraints.rows import add_along_row, linearise_rows, measure_rows
from physics.integrators.drift import make_drift
from physics.model.features import cached_by_features
from physics.model.tables import EQUALITY, MOTOR
from physics.motion.kinematics import write_rotation

# relative to the lengths that a value is computed from: round-off
EXACT = 1e-13
# Newton's method gains a factor of about the angle of a step with each iteration
_MOST_ITERATIONS = 8


@stage
def write_rotations(model, workspace):
    """Writes the rotation matrices of all bodies, and the pose of the world."""
    for m in range(model.dynamic.shape[0]):
        if model.dynamic[m].is_body:
            for i in range(LANES):
                write_rotation(workspace.solid[m], i)


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
def _save_poses(model, workspace):
    for m in range(model.dynamic.shape[0]):
        _copy_pose(workspace.solid[m], workspace.start_pose[m])


@stage
def _restore_poses(model, workspace):
    for m in range(model.dynamic.shape[0]):
        _copy_pose(workspace.start_pose[m], workspace.solid[m])


@stage
def _copy_pose(source, target):
    for i in range(LANES):
        for c in range(3):
            target.position[c, i] = source.position[c, i]
        for c in range(4):
            target.orientation[c, i] = source.orientation[c, i]


@stage
def _find_violations(model, workspace):
    """Marks rows that must act, and lanes that have any; returns the number of such lanes.

    An equality acts always. A limit acts where it is passed, or where it has pushed too far.
    """
    lane = workspace.lane[0]
    for i in range(LANES):
        lane.joint_unconverged[i] = 0
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        if row.role == MOTOR:
            continue
        position = workspace.solid[row.a].position
        for i in range(LANES):
            far = abs(position[0, i]) + abs(position[1, i]) + abs(position[2, i])
            C, most = work.value[i], EXACT * (row.scale + far)
            if row.role == EQUALITY:
                violated = abs(C) > most
            else:
                violated = (-most > C) | ((work.force[i] > 0.0) & (most < C))
                work.active[i] = 1 if (-most > C) | (work.force[i] > 0.0) else 0
            violated = violated & (lane.active[i] != 0)
            lane.joint_unconverged[i] = 1 if violated else lane.joint_unconverged[i]
    left = 0
    for i in range(LANES):
        left += lane.joint_unconverged[i]
    return left


@stage
def _correct_momenta(model, workspace, time):
    """One iteration: impulses that remove the present values in `time` s, in unconverged lanes."""
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


@cached_by_features
def make_joint_drift(features):
    """Stage that moves and rotates all dynamic bodies, with joints if there are any."""
    joints, drift = features.joints, make_drift(features)

    @stage
    def joint_drift(model, workspace, time):
        if not joints:
            drift(model, workspace, time)
        else:
            write_world_frame(workspace)
            write_rotations(model, workspace)
            linearise_rows(model, workspace)
            _save_poses(model, workspace)
            limits = 0
            for r in range(model.joint_row.shape[0]):
                row, work = model.joint_row[r], workspace.joint[r]
                limits += 1 if row.role not in (EQUALITY, MOTOR) else 0
                for i in range(LANES):
                    work.force[i] = 0.0  # here: the impulse so far, N s
                    work.active[i] = 1 if row.role == EQUALITY else 0
            for iteration in range(_MOST_ITERATIONS):
                if iteration > 0:
                    if iteration == 1 or limits > 0:
                        factor(model, workspace)
                    _correct_momenta(model, workspace, time)
                    _restore_poses(model, workspace)
                drift(model, workspace, time)
                write_rotations(model, workspace)
                measure_rows(model, workspace)
                if _find_violations(model, workspace) == 0:
                    break

    return joint_drift
