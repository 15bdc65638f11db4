"""Projection of poses onto the joints, for lanes in which RATTLE's iteration doesn't converge.

RATTLE pushes along the constraints of the start of a step. Where they have turned far by its end,
that is no way to make them hold: a linkage that passes a change point, where its bars align, a
light link that carries a load a thousand times as heavy, or a body that turns by half a radian in a
step. Then the bodies drift freely, and Gauss-Newton steps along the constraints of the present
poses move them onto the joints by the shortest way in the metric of their masses:

    dx = W J^T y,    J W J^T y = -C,    and their momenta by J^T y/h.

It converges whatever the masses, and at a change point, too. It isn't symplectic: energy drifts in
the steps that need it. A lane in which it doesn't converge has a joint that can't hold; the
momentum of that joint's body becomes NaN, so that the world counts as diverged.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.constraints.envelope import factor
from physics.constraints.rows import linearise_rows, measure_rows
from physics.constraints.violations import EXACT, correct_momenta, find_violations
from physics.model.features import cached_by_features
from physics.model.tables import EQUALITY
from physics.motion.kinematics import write_rotation
from physics.motion.vectors import rotated, rotated_back
from physics.rotation import rotate_quaternion_far

_MOST_ITERATIONS = 20
# relative, as EXACT: a joint that is farther apart has failed
FAILED = 1e-7


@stage
def write_rotations(model, workspace):
    """Writes the rotation matrices of all bodies."""
    for m in range(model.dynamic.shape[0]):
        if model.dynamic[m].is_body:
            for i in range(LANES):
                write_rotation(workspace.solid[m], i)


@stage
def _move(model, workspace, time):
    """Moves bodies by what the last correction added to their momenta, in `time` s."""
    unconverged = workspace.lane[0].joint_unconverged
    for m in range(model.dynamic.shape[0]):
        solid, constants, before = workspace.solid[m], model.dynamic[m], workspace.start[m]
        c, q, R = solid.position, solid.orientation, solid.rotation
        P, L, j = solid.momentum, solid.angular_momentum, constants.inverse_inertia
        inverse_mass, reach = constants.inverse_mass, constants.core_reach
        for i in range(LANES):
            if unconverged[i] == 0:
                continue
            step = time * at(inverse_mass, i)
            for k in range(3):
                moved = step * (P[k, i] - before.momentum[k, i])
                c[k, i] += moved
                solid.displacement[k, i] += moved
            if constants.is_body:
                x, y, z = rotated_back(
                    R,
                    i,
                    L[0, i] - before.angular_momentum[0, i],
                    L[1, i] - before.angular_momentum[1, i],
                    L[2, i] - before.angular_momentum[2, i],
                )
                x, y, z = rotated(R, i, at(j[0], i) * x, at(j[1], i) * y, at(j[2], i) * z)
                x, y, z = time * x, time * y, time * z
                if x != 0.0 or y != 0.0 or z != 0.0:
                    far = rotate_quaternion_far(q[0, i], q[1, i], q[2, i], q[3, i], x, y, z)
                    for k in range(4):
                        q[k, i] = far[k]
                    turned = abs(x) + abs(y) + abs(z)  # at least the angle
                    solid.rotation_bound[i] += at(reach, i) * turned


@stage
def _leave_out_others(lane):
    """Leaves lanes as they are that need no projection; returns how many others are left."""
    left = 0
    for i in range(LANES):
        lane.joint_unconverged[i] &= lane.joint_stuck[i]
        left += lane.joint_unconverged[i]
    return left


@stage
def _save_momenta(model, workspace):
    for m in range(model.dynamic.shape[0]):
        solid, start = workspace.solid[m], workspace.start[m]
        for k in range(3):
            for i in range(LANES):
                start.momentum[k, i] = solid.momentum[k, i]
                start.angular_momentum[k, i] = solid.angular_momentum[k, i]


@stage
def _fail(model, workspace):
    """Makes unconverged lanes count as diverged, at the body of the first joint that fails.

    A limit that is still passed doesn't fail: it pushes back in the next step.
    """
    unconverged = workspace.lane[0].joint_unconverged
    for r in range(model.joint_row.shape[0]):
        row, work = model.joint_row[r], workspace.joint[r]
        momentum = workspace.solid[row.a].momentum
        position = workspace.solid[row.a].position
        for i in range(LANES):
            far = abs(position[0, i]) + abs(position[1, i]) + abs(position[2, i])
            holds = abs(work.value[i]) <= FAILED * (at(row.scale, i) + far)
            if unconverged[i] != 0 and row.role == EQUALITY and not holds:
                momentum[0, i] = math.nan
                unconverged[i] = 0


@cached_by_features
def make_projection(features):
    """Stage that moves the bodies of stuck lanes onto the joints, after a free drift."""

    @stage
    def project(model, workspace, time):
        for _ in range(_MOST_ITERATIONS):
            write_rotations(model, workspace)
            linearise_rows(model, workspace)
            find_violations(model, workspace, EXACT)
            if _leave_out_others(workspace.lane[0]) == 0:
                break
            factor(model, workspace)
            _save_momenta(model, workspace)
            correct_momenta(model, workspace, time)
            _move(model, workspace, time)
        write_rotations(model, workspace)
        measure_rows(model, workspace)
        find_violations(model, workspace, FAILED)
        if _leave_out_others(workspace.lane[0]) > 0:
            _fail(model, workspace)

    return project
