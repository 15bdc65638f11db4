"""Lane groups: sixteen worlds side by side, one per SIMD lane, as the kernels work on them.

State keeps bodies world by world. A kernel loads LANES of them at a time into a `Workspace`,
whose arrays have the lane as their last axis, advances them together and stores them. What every
substep does loops over the lanes without a branch, so LLVM turns the loop into vector instructions;
what is rare goes lane by lane. Lanes never mix: a world's result does not depend on the worlds in
the other lanes.
"""

from physics.compiler.jit import LANES, at, stage
from physics.model.features import Features, cached_by_features
from physics.model.state import FIRST_POSITION, FIRST_TOUCH, NORMAL_FORCE
from physics.model.tables import Model


@cached_by_features
def make_constants(features: Features):
    """Stage that returns the model of lane group g: one row per dynamic body and half-pair."""
    per_world_parameters = features.per_world_parameters

    @stage
    def constants(model, g):
        if per_world_parameters:
            return Model(
                model.dynamic[g],
                model.half_pair[g],
                model.compound_part[g],
                model.hidden_face,
                model.static,
                model.sample,
                model.field,
                model.joint_row,
                model.grid,
                model.grid_value,
                model.surface_point,
            )
        return model

    return constants


@stage
def load_forces(state, workspace, m, i):
    """Loads force and torque of dynamic body m into lane i."""
    row, solid = state.dynamic[workspace.lane[0].world[i], m], workspace.solid[m]
    for c in range(3):
        solid.force[c, i] = row.force[c]
        solid.torque[c, i] = row.torque[c]


@stage
def count_slots(workspace, k):
    """Updates the length of the longest list of half-pair k."""
    half_pair = workspace.half_pair[k]
    slots = 0
    for i in range(LANES):
        slots = max(slots, half_pair.count[i])
    half_pair.slots = slots


@stage
def count_untouched(workspace, k):
    """Updates the number of lanes in which half-pair k had no contact before this call."""
    half_pair, start = workspace.half_pair[k], workspace.lane[0].start
    untouched = 0
    for i in range(LANES):
        untouched += 0 if half_pair.first_touch[i] <= start[i] else 1
    half_pair.untouched = untouched


@stage
def load(model, state, workspace, chosen, g):
    """Loads the chosen worlds of group g into the lanes; the other lanes rest at the origin.

    Returns how many there are; loads nothing if there are none.
    """
    lane, count = workspace.lane[0], 0
    for i in range(LANES):
        w = state.resident[g * LANES + i]
        lane.world[i] = w
        if w >= 0 and chosen[w] and state.world[w].diverged == 0:
            count += 1
    if count == 0:
        return 0
    for i in range(LANES):
        w = lane.world[i]
        active = w >= 0 and chosen[w] and state.world[w].diverged == 0
        lane.active[i] = 1 if active else 0
        lane.updates_memory[i] = 1 if active else 0
        lane.needs_refresh[i] = state.world[w].needs_refresh if active else 0
        lane.start[i] = state.world[w].time if active else 0.0
        for m in range(model.dynamic.shape[0]):
            solid = workspace.solid[m]
            # how far the last drift moved the solid, for the broadphase: there was none yet
            solid.rotation_bound[i] = 0.0
            for c in range(3):
                solid.displacement[c, i] = 0.0
            if active:
                row = state.dynamic[w, m]
                for c in range(3):
                    solid.position[c, i] = row.position[c]
                    solid.momentum[c, i] = row.momentum[c]
                    solid.angular_momentum[c, i] = row.angular_momentum[c]
                    solid.reference[c, i] = row.reference[c]
                    solid.reference_velocity[c, i] = row.reference_velocity[c]
                solid.reference_time[i] = row.reference_time  # for which the set point still moves
                for c in range(4):
                    solid.orientation[c, i] = row.orientation[c]
                load_forces(state, workspace, m, i)
            else:
                for c in range(3):
                    solid.position[c, i] = 0.0
                    solid.momentum[c, i] = 0.0
                    solid.angular_momentum[c, i] = 0.0
                    solid.reference[c, i] = 0.0
                    solid.reference_velocity[c, i] = 0.0
                    solid.force[c, i] = 0.0
                    solid.torque[c, i] = 0.0
                solid.reference_time[i] = 0.0
                for c in range(4):
                    solid.orientation[c, i] = 1.0 if c == 3 else 0.0
        for k in range(model.half_pair.shape[0]):
            half_pair = workspace.half_pair[k]
            if active:
                saved = state.half_pair[w, k]
                half_pair.count[i] = saved.count
                half_pair.remaining_skin[i] = saved.remaining_skin
                half_pair.first_touch[i] = state.touch[k, FIRST_TOUCH, w]
                half_pair.previous_normal_force[i] = state.touch[k, NORMAL_FORCE, w]
                half_pair.previous_weight[i] = saved.previous_weight
                half_pair.previous_impact[i] = saved.previous_impact
                half_pair.previous_closing[i] = saved.previous_closing
                for c in range(3):
                    half_pair.previous_normal[c, i] = saved.previous_normal[c]
            else:
                half_pair.count[i] = 0
                half_pair.remaining_skin[i] = 1e300
                half_pair.first_touch[i] = 0.0
                half_pair.previous_normal_force[i] = 0.0
                half_pair.previous_weight[i] = 0.0
                half_pair.previous_impact[i] = 0.0
                half_pair.previous_closing[i] = 0.0
                for c in range(3):
                    half_pair.previous_normal[c, i] = 0.0
    for m in range(model.dynamic.shape[0]):
        weight = workspace.solid[m].weight
        for c in range(3):
            value = model.dynamic[m].weight[c]
            for i in range(LANES):
                weight[c, i] = at(value, i)
    for k in range(model.half_pair.shape[0]):
        count_slots(workspace, k)
        count_untouched(workspace, k)
    return count


@stage
def find_waiting(lane):
    """Finds out whether a lane has a world that isn't advanced now."""
    waiting = 0
    for i in range(LANES):
        waiting += 1 if (lane.active[i] == 0) & (lane.world[i] >= 0) else 0
    lane.waiting = waiting


@stage
def all_update(updates_memory):
    """Whether every lane updates its memory, as in nearly all steps of a full group."""
    updating = 0
    for i in range(LANES):
        updating += 1 if updates_memory[i] != 0 else 0
    return updating == LANES


@stage
def update_previous(previous, current, updates_memory, everyone):
    """Copies values [LANES] of this step to those of the last, in lanes that update their memory.

    `everyone`: `all_update`, for LLVM makes vector instructions of a copy without a condition only.
    """
    if everyone:
        for i in range(LANES):
            previous[i] = current[i]
    else:
        for i in range(LANES):
            previous[i] = current[i] if updates_memory[i] != 0 else previous[i]


@stage
def record_first_contact(model, state, workspace, k, normal_force, elapsed):
    """Records the first contact of a half-pair, in the lanes that have it now.

    That is its time, and where the pair's first solid was: bodies come before drives and statics.
    `normal_force`: [LANES] N.
    """
    live, updates_memory = workspace.half_pair[k], workspace.lane[0].updates_memory
    if live.untouched == 0:
        return
    first, half_pair, start = live.first_touch, model.half_pair[k], workspace.lane[0].start
    position = workspace.solid[min(half_pair.owner, half_pair.surface)].position
    world = workspace.lane[0].world
    for i in range(LANES):
        time = start[i] + elapsed
        # `first` is NaN before the first contact, so the comparison is false
        if normal_force[i] > 0.0 and not first[i] <= time and updates_memory[i] != 0:
            first[i] = time
            for c in range(3):
                state.touch[k, FIRST_POSITION + c, world[i]] = position[c, i]
    count_untouched(workspace, k)


@stage
def end_refresh(model, state, workspace):
    """Ends a refresh, which computes forces in the whole group: other lanes get theirs back.

    `broadphase.make_forget` had limited `updates_memory` to the lanes whose contacts begin afresh;
    now it holds for all active lanes again.
    """
    lane = workspace.lane[0]
    for i in range(LANES):
        lane.updates_memory[i] = lane.active[i]
        if lane.active[i] and lane.needs_refresh[i] == 0:
            for m in range(model.dynamic.shape[0]):
                load_forces(state, workspace, m, i)


@stage
def store(model, state, workspace, i, time):
    """Stores lane i into its world, at `time` s; quaternions with w >= 0."""
    w = workspace.lane[0].world[i]
    state.world[w].time = time
    for m in range(model.dynamic.shape[0]):
        solid, row = workspace.solid[m], state.dynamic[w, m]
        for c in range(3):
            row.position[c] = solid.position[c, i]
            row.momentum[c] = solid.momentum[c, i]
            row.angular_momentum[c] = solid.angular_momentum[c, i]
            row.reference[c] = solid.reference[c, i]
            row.force[c] = solid.force[c, i]
            row.torque[c] = solid.torque[c, i]
        row.reference_time = solid.reference_time[i]
        # q and -q are the same rotation
        sign = -1.0 if solid.orientation[3, i] < 0.0 else 1.0
        for c in range(4):
            row.orientation[c] = sign * solid.orientation[c, i]
    for k in range(model.half_pair.shape[0]):
        half_pair, saved = workspace.half_pair[k], state.half_pair[w, k]
        saved.count = half_pair.count[i]
        saved.remaining_skin = half_pair.remaining_skin[i]
        state.touch[k, FIRST_TOUCH, w] = half_pair.first_touch[i]
        # with impulses, reducing a manifold may have emptied a list after the search
        present = half_pair.count[i] > 0
        state.touch[k, NORMAL_FORCE, w] = half_pair.previous_normal_force[i] if present else 0.0
        saved.previous_weight = half_pair.previous_weight[i]
        saved.previous_impact = half_pair.previous_impact[i]
        saved.previous_closing = half_pair.previous_closing[i]
        for c in range(3):
            saved.previous_normal[c] = half_pair.previous_normal[c, i]
