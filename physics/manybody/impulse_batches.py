"""What the impulse law does with one batch of pairs: contact rows, sweeps, forces.

Velocities stand in `Crowd.frame`. A batch copies those of its solids to its lanes, changes them,
and copies them back. Batches of one colour share no body, so they may be worked on in any order,
and at once. Statics don't change, and are shared by all.
"""

from physics.collision.compound_frames import make_compound_frames
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, sequence, stage
from physics.impulse.contact_rows import make_contact_rows
from physics.impulse.point_impulses import operands_of
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
from physics.model.workspace import FREE, MEETS
from physics.step.event_steps import expect_impacts

# what the solver does in a substep, in this order: it sweeps without the forces of the substep and
# soft contacts, applies its first guess, and sweeps with both
RIGID, GUESS, SOFT = range(3)


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
def gather_forces(crowd, pairs, b, workspace):
    """Known forces on a batch's solids; 0 on statics."""
    for side in range(2):
        places, force = (
            pairs.first[b] if side == 0 else pairs.second[b],
            workspace.solid[side].force,
        )
        for i in range(LANES):
            p = places[i]
            dynamic = p >= 0 and p < crowd.body.shape[0]
            for c in range(3):
                force[c, i] = crowd.solid[p // LANES].force[c, p % LANES] if dynamic else 0.0


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
    """Sequence that writes the contact rows of a batch.

    `meets`: at an impact within a substep; `drifted`: see `LANE.drifted`.
    """
    contact_rows, compound_frames = make_contact_rows(features), make_compound_frames(features)
    timed = features.finds_impacts

    @sequence
    def prepare_batch(
        all_model, state, workspace, rows, crowd, pairs, b, h, remembers, meets, drifted
    ):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        own = bundle(state_of(state, pairs, crowd.pair_kind[pairs.kind[b]], b))
        mark_lanes(workspace.lane[0], pairs.first[b], remembers)
        gather_pose(crowd.frame, pairs.first[b], workspace.solid[0])
        gather_pose(crowd.frame, pairs.second[b], workspace.solid[1])
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        gather_forces(crowd, pairs, b, workspace)
        for i in range(LANES):
            workspace.lane[0].drifted[i] = drifted
        compound_frames(model, mine)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                contact_rows(model, own, mine, 0, k, workspace.lane[0].updates_memory, h)
        if timed:
            mark_phase(workspace.clock[0], meets)
            expect_impacts(model, mine, not meets)

    return prepare_batch


@cached_by_features
def make_solve_batch(features):
    """Sequence of one operation of the solver on a batch: a sweep, or the first guess."""
    sweep, warm_start = make_sweep(features), make_warm_start(features)

    @sequence
    def solve_batch(all_model, workspace, rows, crowd, pairs, b, h, operation):
        tables, arrays = batch_of(all_model, workspace, rows, crowd, pairs, b)
        model, mine = bundle(tables), bundle(arrays)
        gather_speeds(crowd, pairs, b, workspace)
        gather_tensors(crowd, pairs, b, workspace)
        for k in range(mine.half_pair.shape[0]):
            if mine.half_pair[k].slots > 0:
                pair, moves = operands_of(model, mine, k), mine.search[0].moves
                if operation == GUESS:
                    warm_start(pair)
                else:
                    sweep(pair, model.half_pair[k], h, operation == SOFT, moves)
        scatter_speeds(crowd, pairs, b, workspace)
        return 0

    return solve_batch


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
