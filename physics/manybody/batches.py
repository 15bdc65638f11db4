"""Pair batches: a batch is worked on as the lane group of a scene of two solids.

What a half-pair needs of its two solids is copied from `Crowd.frame` into two rows of the working
memory, one lane per pair. Then the stages for worlds side by side do the rest.
"""

from physics.collision.broadphase import (
    make_search_half_pair,
    renewal,
    spare_spin,
    spend_skin,
)
from physics.collision.compound_frames import make_compound_frames
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, sequence, stage
from physics.manybody.tables import (
    ANGULAR_VELOCITY,
    DISPLACEMENT,
    POSITION,
    ROTATION,
    ROTATION_BOUND,
    VELOCITY,
)
from physics.model.features import cached_by_features
from physics.model.state import State
from physics.model.tables import Model
from physics.model.workspace import NORMAL_SUMS, Workspace
from physics.spring.contacts import make_pair_contacts
from physics.spring.mass_splitting import pair_normal, pair_parts, splits_mass


@stage
def model_of(model, kind):
    """The tables of one kind of pair."""
    first, part, solid = kind.first_half_pair, kind.first_part, kind.first_dynamic
    return Model(
        model.dynamic[solid : solid + 2],
        model.half_pair[first : first + kind.half_pair_count],
        model.compound_part[part : part + kind.part_count],
        model.hidden_face,
        model.static,
        model.sample,
        model.field,
        model.joint_row,
        model.grid,
        model.grid_value,
        model.surface_point,
    )


@stage
def workspace_of(workspace, pairs, kind, b, rows, first_row, row_count):
    """A thread's working memory with the half-pairs of batch b, and its contact rows."""
    first = pairs.first_work[b]
    return Workspace(
        workspace.solid,
        workspace.relative,
        pairs.work[first : first + kind.half_pair_count],
        workspace.lane,
        workspace.old,
        workspace.saved_memory,
        workspace.separation,
        workspace.tensor,
        rows[first_row : first_row + row_count],
        workspace.manifold,
        workspace.joint,
        workspace.joint_factor,
        workspace.start,
        workspace.trial,
        workspace.pace,
        pairs.timing[first : first + kind.half_pair_count],
        workspace.clock,
        workspace.kept,
        workspace.servo,
        workspace.response_row,
        workspace.block,
        workspace.block_vector,
        workspace.contact_sum,
        workspace.search,
    )


@stage
def state_of(state, pairs, kind, b):
    """The state with the candidates of batch b as those of lane group 0."""
    first = pairs.first_slot[b]
    return State(
        state.dynamic,
        state.half_pair,
        state.touch,
        state.world,
        pairs.sample_id[:, first : first + kind.slot_count],
        pairs.candidate[:, first : first + kind.slot_count],
        state.wrench,
        state.motor,
        state.pace,
        state.place,
        state.resident,
        state.servo,
    )


@stage
def gather_columns(frame, places, first, count, target):
    """Copies columns of solids, one lane each, into a field [count, LANES]; zeros in free lanes."""
    for i in range(LANES):
        p = places[i]
        for c in range(count):
            target[c, i] = frame[p, first + c] if p >= 0 else 0.0


@stage
def gather_motion(frame, places, solid):
    """How far the last drift moved each solid."""
    gather_columns(frame, places, DISPLACEMENT, 3, solid.displacement)
    for i in range(LANES):
        solid.rotation_bound[i] = frame[places[i], ROTATION_BOUND] if places[i] >= 0 else 0.0


@stage
def gather_pose(frame, places, solid):
    """Positions and rotation matrices."""
    gather_columns(frame, places, POSITION, 3, solid.position)
    gather_columns(frame, places, ROTATION, 9, solid.rotation)


@stage
def gather_velocity(frame, places, solid):
    """Velocities and angular velocities; clears the sums of forces."""
    gather_columns(frame, places, VELOCITY, 3, solid.velocity)
    gather_columns(frame, places, ANGULAR_VELOCITY, 3, solid.angular_velocity)
    for c in range(3):
        for i in range(LANES):
            solid.force[c, i] = 0.0
        for i in range(LANES):
            solid.torque[c, i] = 0.0


@stage
def mark_lanes(lane, places, remembers):
    """Lanes that hold a pair are active, and remember what they do unless a query asks."""
    for i in range(LANES):
        present = 1 if places[i] >= 0 else 0
        lane.active[i] = present
        lane.updates_memory[i] = present if remembers else 0
        lane.world[i] = present - 1


@stage
def has_candidates(workspace):
    """Whether any lane of a batch has candidates for contact."""
    slots = 0
    for k in range(workspace.half_pair.shape[0]):
        slots += workspace.half_pair[k].slots
    return slots > 0


@stage
def record_first_touch(workspace, time):
    """Time in s at which the pairs of a batch first touched since they are near each other."""
    first = workspace.half_pair[0].first_touch
    for k in range(workspace.half_pair.shape[0]):
        force = workspace.half_pair[k].previous_normal_force
        for i in range(LANES):
            first[i] = first[i] if (force[i] <= 0.0) | (first[i] <= time) else time


@cached_by_features
def make_find_candidates(features):
    """Sequence that renews the lists of a batch that need it; returns whether any isn't empty.

    Poses are gathered only where they are needed: most pairs that are near each other don't touch.
    """
    search_half_pair = make_search_half_pair(features)
    compound_frames = make_compound_frames(features)
    compound, impulse, axial = features.compound, features.impulse, features.axial

    @sequence
    def find_candidates(model, state, workspace, crowd, pairs, b, starts_collision_step):
        first, second = pairs.first[b], pairs.second[b]
        one, two = workspace.solid[0], workspace.solid[1]
        gather_motion(crowd.frame, first, one)
        gather_motion(crowd.frame, second, two)
        if axial:
            gather_pose(crowd.frame, first, one)
            gather_velocity(crowd.frame, first, one)
            gather_pose(crowd.frame, second, two)
            gather_velocity(crowd.frame, second, two)
        exhausted = 0
        for k in range(model.half_pair.shape[0]):
            half_pair, live = model.half_pair[k], workspace.half_pair[k]
            least = renewal(half_pair, impulse) if starts_collision_step else 0.0
            owner, surface = workspace.solid[half_pair.owner], workspace.solid[half_pair.surface]
            lacking = spend_skin(owner, surface, half_pair, live, least)
            if axial and half_pair.axial != 0:
                lacking = spare_spin(owner, half_pair, live, least)
            exhausted += lacking
        if exhausted == 0 and not has_candidates(workspace):
            return False
        mark_lanes(workspace.lane[0], first, True)
        if not axial:
            gather_pose(crowd.frame, first, one)
            gather_pose(crowd.frame, second, two)
        if compound and not axial:
            gather_velocity(crowd.frame, first, one)
            gather_velocity(crowd.frame, second, two)
        compound_frames(model, workspace)
        if exhausted > 0:
            for k in range(model.half_pair.shape[0]):
                renewed = renewal(model.half_pair[k], impulse) if starts_collision_step else 0.0
                search_half_pair(model, state, workspace, 0, k, renewed)
        return has_candidates(workspace)

    return find_candidates


@cached_by_features
def make_batch_forces(features):
    """Sequence that finds the contacts of a batch and writes the wrenches on its solids."""
    find_candidates, contacts = make_find_candidates(features), make_pair_contacts(features)
    splits = splits_mass(features)

    @sequence
    def batch_forces(
        all_model, state, workspace, crowd, pairs, b, h, refresh, elapsed, starts_collision_step,
        remembers,
    ):  # fmt: skip
        kind = crowd.pair_kind[pairs.kind[b]]
        model = bundle(model_of(all_model, kind))
        mine = bundle(workspace_of(workspace, pairs, kind, b, workspace.contact_row, 0, 0))
        own = bundle(state_of(state, pairs, kind, b))
        touching = find_candidates(model, own, mine, crowd, pairs, b, starts_collision_step)
        wrench, last = pairs.wrench[b], kind.half_pair_count - 1
        if touching:
            one, two = workspace.solid[0], workspace.solid[1]
            mark_lanes(workspace.lane[0], pairs.first[b], remembers)
            gather_velocity(crowd.frame, pairs.first[b], one)
            gather_velocity(crowd.frame, pairs.second[b], two)
            if splits:
                gather_columns(crowd.normals, pairs.first[b], 0, NORMAL_SUMS, one.normals)
                gather_columns(crowd.normals, pairs.second[b], 0, NORMAL_SUMS, two.normals)
                one.partners, two.partners = 2, 2  # or more
                pair_normal(model, mine, last)
                pair_parts(model, mine, last)
            contacts(model, own, mine, 0, h, refresh, elapsed)
            if remembers:
                record_first_touch(mine, state.world[0].time + elapsed)
            for i in range(LANES):
                for c in range(3):
                    wrench[i, c] = one.force[c, i]
                    wrench[i, 3 + c] = one.torque[c, i]
                    wrench[i, 6 + c] = two.force[c, i]
                    wrench[i, 9 + c] = two.torque[c, i]
            if splits:
                pair_normal(model, mine, last)  # for the next step
            pairs.busy[b] = 1
        elif pairs.busy[b] != 0:
            for i in range(LANES):
                for c in range(12):
                    wrench[i, c] = 0.0
            pairs.busy[b] = 0

    return batch_forces
