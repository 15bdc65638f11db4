"""Newton's method: the impulses of all contacts between bodies at once.

A sweep corrects one contact after another, so a load takes many substeps to reach the ground. Here
the contacts of a world are solved together. With their responses K, velocities J v, impulses p, and
what they lack, g = p(u) - p, where p(u) is the impulse of `contact_responses.py`,

    (M + sum J^T K J) dv = sum J^T g,    dp = g - K J dv

makes an energy of bodies and contacts less, which is convex while the limits of friction stay. So
a part of dp is applied, the limits follow the impulses, and the same is done again until nothing is
lacking. The matrix has two blocks of 3 x 3 per body.

A world isn't solved like this while an overlap is deeper than the rounding of edges: samples then
touch the wrong faces, and faces that push against each other can give any energy. Nor is it if the
iteration doesn't end in time, as in some impacts with friction. It gets a sweep instead, with the
softer contacts that suit sweeps.
"""

import math

from physics.compiler.jit import LANES, at, sequence, stage
from physics.impulse.blocks import factor, solve
from physics.impulse.contact_matrix import add_half_pair, set_masses, sum_contacts
from physics.impulse.contact_responses import ACCURACY, make_set_responses
from physics.impulse.newton_step import (
    begin_search,
    bisect_parts,
    make_add_slopes,
    make_apply_part,
    set_changes,
)
from physics.impulse.point_impulses import apply_impulse, operands_of, relative_velocity
from physics.impulse.sweep import anchor_kept, arrives
from physics.model.features import cached_by_features

# per substep, at most
ITERATIONS = 32


@stage
def mark_separating(pair, separates):
    """Marks worlds in which solids that press on each other separate, after a push apart.

    Also marks the points that are about to collide.
    """
    points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
    for n in range(points.shape[0]):
        point = points[n]
        for i in range(LANES):
            ux, uy, uz = relative_velocity(owner, surface, point, i)
            un = ux * point.normal[0, i] + uy * point.normal[1, i] + uz * point.normal[2, i]
            un -= point.last_bend[i]
            point.arrives[i] = arrives(point, i, un)
            point.approach[i] = -(un + point.last_bend[i])  # after impacts, before forces
            found = (point.normal_impulse[i] > 0.0) & (point.relaxed[i] == 0.0)
            found = found & (un > ACCURACY * point.rest_speed[i])
            separates[i] = 1 if found else separates[i]


@sequence
def find_separating(model, workspace):
    """Marks worlds that the relaxation must correct; how many."""
    moves, count = workspace.search[0].moves, 0
    for i in range(LANES):
        moves[i] = 0
    for k in range(model.half_pair.shape[0]):
        if workspace.half_pair[k].slots > 0:
            mark_separating(operands_of(model, workspace, k), moves)
    for i in range(LANES):
        count += moves[i]
    return count


@cached_by_features
def make_keep(features):
    """Stage that keeps the impulses of a half-pair for worlds that can't be solved."""
    friction = features.friction

    @stage
    def keep(pair, rows, first):
        points = pair.points
        for n in range(points.shape[0]):
            point, row = points[n], rows[first + n]
            for i in range(LANES):
                row.kept_normal[i] = point.normal_impulse[i]
                if friction:
                    tangential, kept = point.tangential_impulse, row.kept_tangential
                    kept[0, i] = tangential[0, i]
                    kept[1, i] = tangential[1, i]
                    kept[2, i] = tangential[2, i]

    return keep


@cached_by_features
def make_settle(features):
    """Stage that keeps impulses within their bounds to the last bit.

    Worlds that aren't solved get their impulses of before back, for a sweep.
    """
    friction = features.friction

    @stage
    def settle(pair, constants, rows, first, h, unsolved):
        points, frictions = pair.points, constants.friction
        for n in range(points.shape[0]):
            point, row = points[n], rows[first + n]
            for i in range(LANES):
                solved, before = unsolved[i] == 0, point.normal_impulse[i]
                new = max(before, 0.0) if solved else row.kept_normal[i]
                point.normal_impulse[i] = new
                step = new - before
                px = step * point.normal[0, i]
                py = step * point.normal[1, i]
                pz = step * point.normal[2, i]
                if friction:
                    tangential, anchor = point.tangential_impulse, point.anchor
                    kept = row.kept_tangential
                    tx, ty, tz = tangential[0, i], tangential[1, i], tangential[2, i]
                    limit = at(frictions, i) * new
                    size = math.sqrt(tx * tx + ty * ty + tz * tz)
                    held = anchor_kept(h, size > (1.0 - ACCURACY) * limit) if solved else 1.0
                    cut = limit / size if size > limit else 1.0
                    sx = cut * tx if solved else kept[0, i]
                    sy = cut * ty if solved else kept[1, i]
                    sz = cut * tz if solved else kept[2, i]
                    tangential[0, i] = sx
                    tangential[1, i] = sy
                    tangential[2, i] = sz
                    anchor[0, i] *= held
                    anchor[1, i] *= held
                    anchor[2, i] *= held
                    px += sx - tx
                    py += sy - ty
                    pz += sz - tz
                apply_impulse(pair, point, i, px, py, pz)

    return settle


@cached_by_features
def make_newton(features):
    """Sequence that solves for the impulses of all contacts; how many worlds need a sweep."""
    set_responses, apply_part = make_set_responses(features), make_apply_part(features)
    add_slopes, settle = make_add_slopes(features), make_settle(features)
    keep = make_keep(features)

    @sequence
    def find_unsolved(model, workspace, h):
        search, count = workspace.search[0], 0
        for i in range(LANES):
            search.deep[i] = 0
            search.lacking[i] = 0.0
            search.off[i] = 0.0
            search.scale[i] = 0.0
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                pair, rows = operands_of(model, workspace, k), workspace.response_row
                first = workspace.half_pair[k].first_row
                set_responses(pair, model.half_pair[k], rows, first, h, search)
        for i in range(LANES):
            lacks = search.lacking[i] > ACCURACY**2 * search.scale[i]
            search.unsolved[i] = 1 if lacks & (search.deep[i] == 0) else 0
            count += search.unsolved[i]
        return count

    @sequence
    def assemble(model, workspace, bodies):
        set_masses(model, workspace, bodies)
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                pair, rows = operands_of(model, workspace, k), workspace.response_row
                a, b = model.half_pair[k].owner, model.half_pair[k].surface
                sum_contacts(pair, rows, workspace.half_pair[k].first_row, workspace.contact_sum)
                add_half_pair(pair, workspace, a, b, bodies)

    @sequence
    def find_changes(model, workspace):
        x, slope = workspace.block_vector, workspace.search[0].slope
        for i in range(LANES):
            slope[i] = 0.0
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                pair, rows = operands_of(model, workspace, k), workspace.response_row
                a, b = 2 * model.half_pair[k].owner, 2 * model.half_pair[k].surface
                v, w, u, q = (
                    x[a].component,
                    x[a + 1].component,
                    x[b].component,
                    x[b + 1].component,
                )
                set_changes(pair, rows, workspace.half_pair[k].first_row, v, w, u, q, slope)

    @sequence
    def find_slopes(model, workspace):
        search = workspace.search[0]
        for i in range(LANES):
            search.slope[i] = 0.0
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                pair, rows = operands_of(model, workspace, k), workspace.response_row
                first = workspace.half_pair[k].first_row
                add_slopes(pair, rows, first, search.part, search.slope)

    @sequence
    def find_part(model, workspace):
        search = workspace.search[0]
        begin_search(search)
        for _ in range(ITERATIONS):
            find_slopes(model, workspace)
            if bisect_parts(search) == 0:
                return

    @sequence
    def newton(model, workspace, h):
        search, bodies, left = workspace.search[0], model.dynamic.shape[0], 0
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                pair, rows = operands_of(model, workspace, k), workspace.response_row
                keep(pair, rows, workspace.half_pair[k].first_row)
        for _ in range(ITERATIONS):
            if find_unsolved(model, workspace, h) == 0:
                break
            assemble(model, workspace, bodies)
            factor(workspace.block, workspace.contact_sum[4].entry, 2 * bodies)
            solve(workspace.block, workspace.block_vector, 2 * bodies)
            find_changes(model, workspace)
            find_part(model, workspace)
            for k in range(model.half_pair.shape[0]):
                if workspace.half_pair[k].slots > 0:
                    pair, rows = operands_of(model, workspace, k), workspace.response_row
                    apply_part(pair, rows, workspace.half_pair[k].first_row, search.part)
        for i in range(LANES):
            # what a sweep would change is squared, as all impulses are: more than one percent
            fails = (search.deep[i] != 0) | (search.off[i] > ACCURACY * search.scale[i])
            search.unsolved[i] = 1 if fails else 0
            search.moves[i] = search.unsolved[i]
            left += search.unsolved[i]
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                pair, rows = operands_of(model, workspace, k), workspace.response_row
                first = workspace.half_pair[k].first_row
                settle(pair, model.half_pair[k], rows, first, h, search.unsolved)
        return left

    return newton
