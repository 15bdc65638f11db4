"""What the impulse law does with one batch of pairs: contact rows, impacts, sweeps, forces.

Velocities stand in `Crowd.frame`. A batch copies those of its solids to its lanes, changes them,
and copies them back. Batches of one colour share no body, so they may be worked on in any order,
and at once. Statics don't change, and are shared by all.
"""

from physics.collision.compound_frames import make_compound_frames
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, sequence, stage
from physics.impulse.contact_rows import make_contact_rows
from physics.impulse.point_impulses import operands_of
from physics.impulse.restitution import (
    TOLERANCE,
    apply_restitution,
    make_apply_impacts,
    make_find_impacts,
    make_impact_sweep,
    remove_push_out,
)
from physics.impulse.solver import make_store_forces, make_warm_start
from physics.impulse.sweep import make_sweep
from physics.manybody.batches import (
    gather_columns,
    gather_pose,
    gather_velocity,
    make_find_candidates,
    mark_lanes,
    model_of,
    record_first_touch,
    state_of,
    workspace_of,
)
from physics.manybody.tables import ANGULAR_VELOCITY, VELOCITY
from physics.model.features import cached_by_features
from physics.model.lanes import update_previous
from physics.model.workspace import FREE, GIVEN, MEETS
from physics.step.event_steps import expect_impacts


@stage
def batch_of(all_model, workspace, rows, crowd, pairs, b):
    """The tables of batch b, and a thread's working memory with its contact rows."""
    kind = crowd.pair_kind[pairs.kind[b]]
    first_row, row_count = pairs.first_row[b], pairs.row_count[b]
    mine = workspace_of(workspace, pairs, kind, b, rows, first_row, row_count)
    return model_of(all_model, kind), mine


@stage
def gather_speeds(crowd, pairs, b, workspace):
    """Velocities of a batch's solids."""
    for side in range(2):
        places = pairs.first[b] if side == 0 else pairs.second[b]
        solid = workspace.solid[side]
        gather_columns(crowd.frame, places, VELOCITY, 3, solid.velocity)
        gather_columns(crowd.frame, places, ANGULAR_VELOCITY, 3, solid.angular_velocity)


@stage
def gather_tensors(crowd, pairs, b, workspace):
    """Inverse inertia tensors of a batch's solids."""
    gather_columns(crowd.tensor, pairs.first[b], 0, 6, workspace.tensor[0].component)
    gather_columns(crowd.tensor, pairs.second[b], 0, 6, workspace.tensor[1].component)


@stage
def scatter_speeds(crowd, pairs, b, workspace):
    """The reverse of `gather_speeds`, for bodies."""
    bodies = crowd.incident_first.shape[0] - 1
    for side in range(2):
        places = pairs.first[b] if side == 0 else pairs.second[b]
        v, omega = workspace.solid[side].velocity, workspace.solid[side].angular_velocity
        for i in range(LANES):
            p = places[i]
            if p >= 0 and p < bodies:
                for c in range(3):
                    crowd.frame[p, VELOCITY + c] = v[c, i]
                    crowd.frame[p, ANGULAR_VELOCITY + c] = omega[c, i]


@stage
def mark_phase(clock, meets):
    """Tells the stages of a lane group whether all its pairs are at an impact."""
    for i in range(LANES):
        clock.phase[i] = MEETS if meets else FREE


@cached_by_features
def make_list_contacts(features):
    """Sequence that renews the lists of a batch, and counts the contact rows that it needs.

    `meets`: at an impact within a substep.
    """
    find_candidates, timed = make_find_candidates(features), features.finds_impacts

    @sequence
    def list_contacts(all_model, state, workspace, crowd, pairs, b, starts_collision_step, meets):
        if timed:  # what touches is kept where a manifold is chosen
            mark_phase(workspace.clock[0], meets)
        kind = crowd.pair_kind[pairs.kind[b]]
        model = bundle(model_of(all_model, kind))
        mine = bundle(workspace_of(workspace, pairs, kind, b, workspace.contact_row, 0, 0))
        own = bundle(state_of(state, pairs, kind, b))
        found = find_candidates(model, own, mine, crowd, pairs, b, starts_collision_step)
        if not found and pairs.busy[b] != 0:
            for i in range(LANES):
                for c in range(12):
                    pairs.wrench[b, i, c] = 0.0
        pairs.busy[b] = 1 if found else 0
        count = 0
        for k in range(mine.half_pair.shape[0]):
            mine.half_pair[k].first_row = count
            count += mine.half_pair[k].slots
        pairs.row_count[b] = count

    return list_contacts


@cached_by_features
def make_prepare_batch(features):
    """Sequence that writes the contact rows of a batch; `meets`: at an impact within a substep."""
    contact_rows, compound_frames = make_contact_rows(features), make_compound_frames(features)
    timed = features.finds_impacts

    @sequence
    def prepare_batch(all_model, state, workspace, rows, crowd, pairs, b, h, remembers, meets):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        own = bundle(state_of(state, pairs, crowd.pair_kind[pairs.kind[b]], b))
        mark_lanes(workspace.lane[0], pairs.first[b], remembers)
        gather_pose(crowd.frame, pairs.first[b], workspace.solid[0])
        gather_pose(crowd.frame, pairs.second[b], workspace.solid[1])
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        compound_frames(model, mine)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                contact_rows(model, own, mine, 0, k, workspace.lane[0].updates_memory, h)
        if timed:
            mark_phase(workspace.clock[0], meets)
            expect_impacts(model, mine, not meets)

    return prepare_batch


@cached_by_features
def make_find_batch_impacts(features):
    """Sequence that notes the colliding points of a batch.

    Returns the number of pairs with any, and writes the fastest approach in m/s, and the largest
    restitution, of the thread so far. `lags`: with velocities of half a substep ago.
    """
    find_impacts = make_find_impacts(features)

    @sequence
    def find_batch_impacts(all_model, workspace, rows, crowd, pairs, b, h, extremes, lags):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        lane = workspace.lane[0]
        gather_speeds(crowd, pairs, b, workspace)
        for i in range(LANES):
            lane.colliding[i] = 0
            lane.fastest_approach[i] = 0.0
            lane.impact_restitution[i] = 0.0
            pairs.impact_work[b, i] = 0.0
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                pair = operands_of(model, mine, k)
                find_impacts(mine, k, pair, model.half_pair[k], h, lags)
        found = 0
        for i in range(LANES):
            found += lane.colliding[i]
            pairs.colliding[b, i] = lane.colliding[i]
            extremes[0] = max(extremes[0], lane.fastest_approach[i])
            extremes[1] = max(extremes[1], lane.impact_restitution[i])
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
    def impact_batch(all_model, workspace, rows, crowd, pairs, b, since, stamp, after, fastest):
        """Bodies whose velocity changes by more than round-off are stirred at `stamp`."""
        lane, some = workspace.lane[0], 0
        for i in range(LANES):
            lane.unconverged[i] = 1 if is_stirred(crowd, pairs, b, i, since) else 0
            lane.largest_change[i] = 0.0
            lane.impact_work[i] = 0.0
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
                impact_sweep(pair, mu, lane, after)
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


@cached_by_features
def make_restitution_batch(features):
    """Sequence that applies restitution to the colliding pairs of a batch."""

    @sequence
    def restitution_batch(all_model, workspace, rows, crowd, pairs, b, rescale, scale, stamp):
        lane, some = workspace.lane[0], 0
        for i in range(LANES):
            lane.restitution_scale[i] = scale
            lane.impact_work[i] = 0.0
            some += pairs.colliding[b, i]
        if some == 0:
            return 0
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                apply_restitution(operands_of(model, mine, k), lane, rescale)
        scatter_speeds(crowd, pairs, b, workspace)
        for i in range(LANES):
            pairs.impact_work[b, i] += lane.impact_work[i]
            if pairs.colliding[b, i] != 0:
                stir(crowd, pairs.first[b, i], stamp)
                stir(crowd, pairs.second[b, i], stamp)
        return 0

    return restitution_batch


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


@cached_by_features
def make_sweep_batch(features):
    """Sequence of one sweep over the contacts of a batch."""
    sweep = make_sweep(features)

    @sequence
    def sweep_batch(all_model, workspace, rows, crowd, pairs, b, h, soft):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                moves = mine.search[0].moves
                sweep(operands_of(model, mine, k), model.half_pair[k], h, soft, moves)
        scatter_speeds(crowd, pairs, b, workspace)
        return 0

    return sweep_batch


@cached_by_features
def make_warm_batch(features):
    """Sequence that applies the first guess of a batch."""
    warm_start = make_warm_start(features)

    @sequence
    def warm_batch(all_model, workspace, rows, crowd, pairs, b):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                warm_start(operands_of(model, mine, k))
        scatter_speeds(crowd, pairs, b, workspace)
        return 0

    return warm_batch


@cached_by_features
def make_finish_batch(features):
    """Sequence that turns impulses of a batch into forces, and stores what contacts remember."""
    store_forces = make_store_forces(features)

    @sequence
    def finish_batch(all_model, state, workspace, rows, crowd, pairs, b, h, elapsed, remembers):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        own = bundle(state_of(state, pairs, crowd.pair_kind[pairs.kind[b]], b))
        one, two, lane = workspace.solid[0], workspace.solid[1], workspace.lane[0]
        mark_lanes(lane, pairs.first[b], remembers)
        gather_pose(crowd.frame, pairs.first[b], one)
        gather_pose(crowd.frame, pairs.second[b], two)
        gather_velocity(crowd.frame, pairs.first[b], one)
        gather_velocity(crowd.frame, pairs.second[b], two)
        for k in range(mine.half_pair.shape[0]):
            live, first = mine.half_pair[k], model.half_pair[k].first_slot
            if live.slots == 0:
                continue
            normal_force = one.normal_force_sum
            for i in range(LANES):
                normal_force[i] = 0.0
            candidate = own.candidate[0, first : first + live.slots]
            pair = operands_of(model, mine, k)
            store_forces(pair, candidate, lane.updates_memory, h, normal_force)
            update_previous(
                live.previous_normal_force, normal_force, lane.updates_memory, remembers
            )
        if remembers:
            record_first_touch(mine, state.world[0].time + elapsed)
        for i in range(LANES):
            for c in range(3):
                pairs.wrench[b, i, c] = one.force[c, i]
                pairs.wrench[b, i, 3 + c] = one.torque[c, i]
                pairs.wrench[b, i, 6 + c] = two.force[c, i]
                pairs.wrench[b, i, 9 + c] = two.torque[c, i]

    return finish_batch
