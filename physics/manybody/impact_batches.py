"""What an instantaneous collision does with one batch of pairs, see `impulse.restitution`.

Only pairs with a body whose velocity a collision has changed take part; bodies carry the stamp of
the last sweep that changed them.
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
    """Whether a body of a pair has changed its velocity since a sweep."""
    bodies, p, q = crowd.stirred.shape[0], pairs.first[b, i], pairs.second[b, i]
    one = p >= 0 and crowd.stirred[p] >= since
    return one or (q >= 0 and q < bodies and crowd.stirred[q] >= since)


@cached_by_features
def make_half_impulse_batch(features):
    """Sequence that adds the half impulses of a batch, a part of the last ones, or removes them."""

    @sequence
    def half_impulse_batch(all_model, workspace, rows, crowd, pairs, b, part, attempt):
        """`attempt`: see `add_half_impulses`."""
        everyone = workspace.lane[0].colliding
        for i in range(LANES):
            everyone[i] = 1
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                add_half_impulses(operands_of(model, mine, k), everyone, part, attempt)
        scatter_speeds(crowd, pairs, b, workspace)
        return 0

    return half_impulse_batch


@cached_by_features
def make_push_out_batch(features):
    """Sequence that removes the velocity that pushed bodies apart, where one of them collides."""

    @sequence
    def push_out_batch(all_model, workspace, rows, crowd, pairs, b, since):
        lane, some = workspace.lane[0], 0
        for i in range(LANES):
            lane.colliding[i] = 1 if is_stirred(crowd, pairs, b, i, since) else 0
            some += lane.colliding[i]
        if some == 0:
            return 0
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                remove_push_out(operands_of(model, mine, k), lane.colliding)
        scatter_speeds(crowd, pairs, b, workspace)
        return 0

    return push_out_batch


@cached_by_features
def make_impact_batch(features):
    """Sequence of one sweep of the impacts of a batch: of the pairs with a body that changed."""
    impact_sweep = make_impact_sweep(features)

    @sequence
    def impact_batch(all_model, workspace, rows, crowd, pairs, b, since, stamp, fastest):
        """Bodies whose velocity changes by more than round-off are stirred at `stamp`."""
        lane, some = workspace.lane[0], 0
        for i in range(LANES):
            lane.unconverged[i] = 1 if is_stirred(crowd, pairs, b, i, since) else 0
            lane.largest_change[i] = 0.0
            lane.impact_work[i] = 0.0
            pairs.colliding[b, i] = max(pairs.colliding[b, i], lane.unconverged[i])
            some += lane.unconverged[i]
        if some == 0:
            return 0
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                pair, mu = operands_of(model, mine, k), model.half_pair[k].friction
                impact_sweep(pair, mu, lane)
        scatter_speeds(crowd, pairs, b, workspace)
        moved = 0
        for i in range(LANES):
            pairs.impact_work[b, i] += lane.impact_work[i]
            if lane.largest_change[i] > TOLERANCE * fastest:
                stir(crowd, pairs.first[b, i], stamp)
                stir(crowd, pairs.second[b, i], stamp)
                moved += 1
        return moved

    return impact_batch


@stage
def takes_part(pairs, b):
    """Whether any pair of a batch collides or has been swept since."""
    some = 0
    for i in range(LANES):
        some += pairs.colliding[b, i]
    return some > 0


@stage
def stir_batch(crowd, pairs, b, stamp):
    """Notes that the velocities of a batch's pairs that take part have changed."""
    for i in range(LANES):
        if pairs.colliding[b, i] != 0:
            stir(crowd, pairs.first[b, i], stamp)
            stir(crowd, pairs.second[b, i], stamp)


@cached_by_features
def make_restitution_batch(features):
    """Sequence that applies restitution to the pairs of a batch that take part."""

    @sequence
    def restitution_batch(all_model, workspace, rows, crowd, pairs, b, extremes, stamp):
        """Writes the largest restitution of the thread so far."""
        if not takes_part(pairs, b):
            return 0
        lane = workspace.lane[0]
        for i in range(LANES):
            lane.impact_restitution[i] = 0.0
            lane.impact_work[i] = 0.0
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                apply_restitution(operands_of(model, mine, k), lane)
        scatter_speeds(crowd, pairs, b, workspace)
        for i in range(LANES):
            pairs.impact_work[b, i] += lane.impact_work[i]
            extremes[RESTITUTION] = max(extremes[RESTITUTION], lane.impact_restitution[i])
        stir_batch(crowd, pairs, b, stamp)
        return 0

    return restitution_batch


@cached_by_features
def make_end_work_batch(features):
    """Sequence that writes the work of `add_end_work` of a batch to `impact_work`."""

    @sequence
    def end_work_batch(all_model, workspace, rows, crowd, pairs, b):
        if not takes_part(pairs, b):
            return
        lane = workspace.lane[0]
        for i in range(LANES):
            lane.end_work[i] = 0.0
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                add_end_work(operands_of(model, mine, k), lane)
        for i in range(LANES):
            pairs.impact_work[b, i] = lane.end_work[i]

    return end_work_batch


@cached_by_features
def make_scale_batch(features):
    """Sequence that takes back all but a fraction of the impulses since compression."""

    @sequence
    def scale_batch(all_model, workspace, rows, crowd, pairs, b, scale, stamp):
        if not takes_part(pairs, b):
            return 0
        lane = workspace.lane[0]
        for i in range(LANES):
            lane.restitution_scale[i] = scale
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                scale_impacts(operands_of(model, mine, k), lane)
        scatter_speeds(crowd, pairs, b, workspace)
        stir_batch(crowd, pairs, b, stamp)
        return 0

    return scale_batch


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
