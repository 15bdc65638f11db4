"""What an instantaneous collision does with one batch of pairs, see `impulse.restitution`.

Only pairs with a body whose velocity a collision has changed take part; bodies carry the stamp of
the last operation that changed them.
"""

from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, sequence, stage
from physics.impulse.impact_points import (
    add_half_impulses,
    make_find_impacts,
    make_impact_sweep,
    remove_push_out,
)
from physics.impulse.point_impulses import operands_of
from physics.impulse.restitution import (
    TOLERANCE,
    add_end_work,
    apply_restitution,
    make_apply_impacts,
    scale_impacts,
)
from physics.manybody.impulse_batches import (
    batch_of,
    gather_speeds,
    gather_tensors,
    scatter_speeds,
)
from physics.manybody.team import FASTEST, RESTITUTION
from physics.model.features import cached_by_features
from physics.model.workspace import GIVEN

# what a collision does with all pairs, see `impact_steps.make_collide`
LOOK_BACK, FIND, ADD_HALVES, REMOVE_PUSH_OUT, SWEEP = range(5)
RESTITUTE, ADD_WORK, SCALE, REMOVE_HALVES, DONE = range(5, 10)


@cached_by_features
def make_find_batch_impacts(features):
    """Sequence that notes the colliding points of a batch.

    Returns the number of pairs with any, and writes the fastest approach in m/s of the thread so
    far. `lags`: with velocities of half a substep ago; `part`: see `restitution.make_find_impacts`.
    """
    find_impacts = make_find_impacts(features)

    @sequence
    def find_batch_impacts(all_model, workspace, rows, crowd, pairs, b, h, extremes, lags, part):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        lane = workspace.lane[0]
        gather_speeds(crowd, pairs, b, workspace)
        for i in range(LANES):
            lane.colliding[i] = 0
            lane.fastest_approach[i] = 0.0
            pairs.impact_work[b, i] = 0.0
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                pair = operands_of(model, mine, k)
                find_impacts(mine, k, pair, model.half_pair[k], h, lags, part)
        found = 0
        for i in range(LANES):
            found += lane.colliding[i]
            pairs.colliding[b, i] = lane.colliding[i]
            extremes[FASTEST] = max(extremes[FASTEST], lane.fastest_approach[i])
        return found

    return find_batch_impacts


@stage
def stir(crowd, p, stamp):
    """Notes that the velocity of a body has changed."""
    if p >= 0 and p < crowd.stirred.shape[0]:
        crowd.stirred[p] = stamp


@stage
def is_stirred(crowd, pairs, b, i, since):
    """Whether a body of a pair has changed its velocity since a stamp."""
    bodies, p, q = crowd.stirred.shape[0], pairs.first[b, i], pairs.second[b, i]
    one = p >= 0 and crowd.stirred[p] >= since
    return one or (q >= 0 and q < bodies and crowd.stirred[q] >= since)


@stage
def begin_operation(workspace, crowd, pairs, b, operation, value, stamp):
    """Marks the lanes of a batch that take part in `LANE.unconverged`; returns how many do."""
    lane, some = workspace.lane[0], 0
    for i in range(LANES):
        involved = True
        if operation in (REMOVE_PUSH_OUT, SWEEP):
            involved = is_stirred(crowd, pairs, b, i, stamp)
        elif operation != ADD_HALVES:
            involved = pairs.colliding[b, i] != 0
        lane.unconverged[i] = 1 if involved else 0
        lane.largest_change[i] = 0.0
        lane.impact_restitution[i] = 0.0
        lane.impact_work[i] = 0.0
        lane.end_work[i] = 0.0
        lane.restitution_scale[i] = value
        some += lane.unconverged[i]
    return some


@stage
def end_operation(workspace, crowd, pairs, b, operation, value, stamp, extremes):
    """Notes the work and which bodies have changed; returns the number of pairs that have."""
    lane, changed = workspace.lane[0], 0
    for i in range(LANES):
        pairs.impact_work[b, i] += lane.impact_work[i] + lane.end_work[i]
        extremes[RESTITUTION] = max(extremes[RESTITUTION], lane.impact_restitution[i])
        if operation == SWEEP:
            pairs.colliding[b, i] = max(pairs.colliding[b, i], lane.unconverged[i])
            changes = lane.largest_change[i] > TOLERANCE * value
        else:
            changes = operation in (RESTITUTE, SCALE) and lane.unconverged[i] != 0
        if changes:
            stir(crowd, pairs.first[b, i], stamp + 1)
            stir(crowd, pairs.second[b, i], stamp + 1)
            changed += 1
    return changed


@cached_by_features
def make_impact_batch(features):
    """Sequence of any operation on a batch but FIND: all share what copies the velocities."""
    impact_sweep = make_impact_sweep(features)

    @sequence
    def impact_batch(
        all_model, workspace, rows, crowd, pairs, b, operation, value, stamp, extremes
    ):
        """Stirs bodies whose velocities change, at `stamp` + 1; returns the number of such pairs.

        With SWEEP a change of round-off doesn't count.

        `value`: with SWEEP the fastest approach in m/s, with SCALE the fraction of the impulses
        that is left, with ADD_HALVES and REMOVE_HALVES the part of the last impulses; `extremes`:
        of the thread.
        """
        involved = begin_operation(workspace, crowd, pairs, b, operation, value, stamp)
        if involved == 0 and operation != REMOVE_HALVES:  # that undoes what all have got
            return 0
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine, lane = bundle(tables), bundle(arrays), workspace.lane[0]
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots == 0:
                continue
            pair = operands_of(model, mine, k)
            if operation == SWEEP:
                impact_sweep(pair, model.half_pair[k].friction, lane)
            elif operation == RESTITUTE:
                apply_restitution(pair, lane)
            elif operation == ADD_WORK:
                add_end_work(pair, lane)
            elif operation == SCALE:
                scale_impacts(pair, lane)
            elif operation == REMOVE_PUSH_OUT:
                remove_push_out(pair, lane.unconverged)
            else:
                add_half_impulses(pair, lane.unconverged, value, operation == ADD_HALVES)
        scatter_speeds(crowd, pairs, b, workspace)
        return end_operation(workspace, crowd, pairs, b, operation, value, stamp, extremes)

    return impact_batch


@cached_by_features
def make_book_impacts(features):
    """Sequence that adds up the impact impulses of a batch, for the momenta of its solids.

    With time control, those of a refresh are known apart from the forces, see `Workspace.kept`.
    """
    apply_impacts, timed = make_apply_impacts(features), features.finds_impacts

    @sequence
    def book_impacts(all_model, workspace, rows, crowd, pairs, b, refresh):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        one, two = workspace.solid[0], workspace.solid[1]
        if timed and refresh:
            one, two = workspace.kept[GIVEN, 0], workspace.kept[GIVEN, 1]
        for c in range(3):
            for i in range(LANES):
                one.momentum[c, i] = 0.0
                one.angular_momentum[c, i] = 0.0
                two.momentum[c, i] = 0.0
                two.angular_momentum[c, i] = 0.0
        apply_impacts(model, mine, refresh)
        for i in range(LANES):
            for c in range(3):
                pairs.wrench[b, i, c] = one.momentum[c, i]
                pairs.wrench[b, i, 3 + c] = one.angular_momentum[c, i]
                pairs.wrench[b, i, 6 + c] = two.momentum[c, i]
                pairs.wrench[b, i, 9 + c] = two.angular_momentum[c, i]

    return book_impacts
