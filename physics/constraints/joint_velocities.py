"""Joints while impulses of contacts change velocities: they keep the rates J v that they had.

`begin_hold` notes these rates. `hold` follows each sweep over the contacts: it finds the impulses
along the rows that restore the rates, for all joints at once. `end_hold` adds the sum of these
impulses to the forces, or to the momenta. A motor acts up to its limit, and a limit that is touched
only pushes; which of them act depends on what the velocities mean.
"""

from physics.compiler.jit import LANES, at, stage
from physics.constraints.envelope import factor, solve
from physics.constraints.joint_forces import TOUCHED, bound_changes
from physics.constraints.rows import add_along_row
from physics.model.features import cached_by_features
from physics.model.tables import EQUALITY, MOTOR


@stage
def _rate(work, A, B, i):
    """J v of a row in a lane."""
    n, s, t = work.direction, work.moment_a, work.moment_b
    v, u, o, w = A.velocity, B.velocity, A.angular_velocity, B.angular_velocity
    rate = 0.0
    for c in range(3):
        rate += n[c, i] * (v[c, i] - u[c, i]) + s[c, i] * o[c, i] - t[c, i] * w[c, i]
    return rate


@stage
def _apply(model, row, work, A, B):
    """Changes the velocities of both bodies by the impulses in `change`."""
    n, turn_a, turn_b = work.direction, work.turn_a, work.turn_b
    ma = model.dynamic[row.a].inverse_mass
    for i in range(LANES):
        x = work.change[i]
        for c in range(3):
            A.velocity[c, i] += x * at(ma, i) * n[c, i]
            A.angular_velocity[c, i] += x * turn_a[c, i]
    if row.b < model.dynamic.shape[0]:
        mb = model.dynamic[row.b].inverse_mass
        for i in range(LANES):
            x = work.change[i]
            for c in range(3):
                B.velocity[c, i] -= x * at(mb, i) * n[c, i]
                B.angular_velocity[c, i] -= x * turn_b[c, i]


@cached_by_features
def make_begin_hold(features):
    """Stage that notes the rates of all joints."""
    joints = features.joints

    @stage
    def begin_hold(model, workspace, limits, motor_time):
        """Which bounds act: `limits`; and of motors the force in `motor_time` s, 0: none."""
        if joints:
            for r in range(model.joint_row.shape[0]):
                row, work = model.joint_row[r], workspace.joint[r]
                A, B = workspace.solid[row.a], workspace.solid[row.b]
                for i in range(LANES):
                    work.allowed[i] = 1
                    work.aim[i] = _rate(work, A, B, i)
                    work.force[i] = motor_time * work.known_force[i]
                    if row.role == MOTOR:
                        work.allowed[i] = 1 if motor_time > 0.0 else 0
                        work.aim[i] = work.rate[i]
                    elif row.role != EQUALITY:
                        touched = work.value[i] <= TOUCHED * at(row.scale, i)
                        work.allowed[i] = 1 if limits and touched else 0
                        work.aim[i] = 0.0

    return begin_hold


@cached_by_features
def make_hold(features):
    """Stage that restores the rates in the lanes of a mask [LANES]."""
    joints = features.joints

    @stage
    def hold(model, workspace, mask, motor_time, lane):
        """Adds the work of the impulses in J to `lane.impact_work`."""
        if joints:
            rows, bounded = model.joint_row.shape[0], 0
            for r in range(rows):
                bounded += 0 if model.joint_row[r].role == EQUALITY else 1
                for i in range(LANES):
                    workspace.joint[r].active[i] = workspace.joint[r].allowed[i]
            for i in range(LANES):
                lane.joint_unconverged[i] = 1 if mask[i] != 0 else 0
            for _ in range(bounded + 1):
                if bounded > 0:
                    factor(model, workspace)
                for r in range(rows):
                    row, work = model.joint_row[r], workspace.joint[r]
                    A, B = workspace.solid[row.a], workspace.solid[row.b]
                    for i in range(LANES):
                        acts = (work.active[i] != 0) & (lane.joint_unconverged[i] != 0)
                        work.lacking[i] = work.aim[i] - _rate(work, A, B, i) if acts else 0.0
                        work.change[i] = work.lacking[i]
                solve(model, workspace)
                left = bound_changes(model, workspace, motor_time)
                for r in range(rows):
                    row, work = model.joint_row[r], workspace.joint[r]
                    A, B = workspace.solid[row.a], workspace.solid[row.b]
                    for i in range(LANES):
                        x = work.change[i]
                        work.impulse[i] += x
                        lane.impact_work[i] += x * (work.aim[i] - 0.5 * work.lacking[i])
                    _apply(model, row, work, A, B)
                if left == 0:
                    break

    return hold


@cached_by_features
def make_clear_hold(features):
    """Stage that sets the sums of the impulses to zero."""
    joints = features.joints

    @stage
    def clear_hold(model, workspace):
        if joints:
            for r in range(model.joint_row.shape[0]):
                for i in range(LANES):
                    workspace.joint[r].impulse[i] = 0.0

    return clear_hold


@cached_by_features
def make_end_hold(features):
    """Stage that adds the sums of the impulses to the momenta; or over h > 0 s to the forces."""
    joints = features.joints

    @stage
    def end_hold(model, workspace, h):
        if joints:
            for r in range(model.joint_row.shape[0]):
                row, work = model.joint_row[r], workspace.joint[r]
                A, B = workspace.solid[row.a], workspace.solid[row.b]
                x = work.impulse
                if h > 0.0:
                    for i in range(LANES):
                        x[i] = x[i] / h
                    add_along_row(work, x, A.force, A.torque, B.force, B.torque)
                else:
                    P, L, Q, M = A.momentum, A.angular_momentum, B.momentum, B.angular_momentum
                    add_along_row(work, x, P, L, Q, M)

    return end_hold
