"""Broadphase: which half-pairs need a new list of candidates.

A list is complete while no sample outside of it can touch: until owner and surface have moved
relative to each other by the skin or, if the list is empty, by a lower bound of the distance of the
nearest sample. Over a plane only motion along its normal counts. Rotation counts as far as it moves
the core, which is the shape without its rounding: a ball that rolls on a plane needs no new list.
`remaining_skin` is how much of that distance is left. Every drift reduces it. A list is replaced
when less is left than the last drift took: the next drift is expected to take as much, and forces
are computed right after it.
"""

from physics.collision.candidate_list import make_clear, make_search
from physics.collision.manifold import make_manifold_reduction
from physics.collision.relative_frame import relative_pose
from physics.compiler.jit import LANES, at, stage
from physics.model.features import cached_by_features
from physics.model.lanes import count_slots
from physics.model.state import STARTS_ANEW
from physics.scene.shapes import PLANE

# fraction of the skin; a list with less than that left is renewed when a collision step starts, in
# all lanes at once rather than one by one within it
RENEWAL = 0.5


@cached_by_features
def make_search_half_pair(features):
    """Stage that searches a half-pair in the lanes that need it."""
    search = make_search(features)
    reduce_manifold = make_manifold_reduction(features, make_clear(features))
    impulse, compound = features.impulse, features.compound

    @stage
    def relative_pose_of(workspace, half_pair, relative):
        """The owner's pose in the frame of the surface; for a plane that is the world frame."""
        if half_pair.kind == PLANE:
            return workspace.solid[half_pair.owner]
        frame = half_pair.frame if compound else half_pair.surface
        relative_pose(workspace.solid[half_pair.owner], workspace.solid[frame], relative)
        return relative

    @stage
    def search_half_pair(model, state, workspace, g, k, least):
        """Searches lanes with less skin left than the last drift took, or than `least` * the skin.

        The impulse law keeps at most four candidates of two faces (a manifold), chosen from both
        half-pairs of the pair, so it searches both.
        """
        half_pair, live = model.half_pair[k], workspace.half_pair[k]
        reverse = half_pair.reverse if impulse else -1
        relative = relative_pose_of(workspace, half_pair, workspace.relative[0])
        if reverse >= 0:
            reverse_half_pair = model.half_pair[reverse]
            back = relative_pose_of(workspace, reverse_half_pair, workspace.relative[1])
        else:
            back = relative
        for i in range(LANES):
            motion, left = live.relative_motion[i], live.remaining_skin[i]
            if workspace.lane[0].active[i] and left < max(least * at(half_pair.skin, i), motion):
                search(model, state, workspace, g, k, i, relative, 0, motion)
                if reverse >= 0:
                    first_point = live.count[i]
                    search(model, state, workspace, g, reverse, i, back, first_point, motion)
                if impulse and reduce_manifold(model, state, workspace, g, k, i) and reverse >= 0:
                    # as far as a point that slips off the other face is still on its round edge
                    most = 0.5 * at(half_pair.radius, i)
                    live.remaining_skin[i] = min(live.remaining_skin[i], most)
                    reverse_live = workspace.half_pair[reverse]
                    reverse_live.remaining_skin[i] = min(reverse_live.remaining_skin[i], most)
        count_slots(workspace, k)
        if reverse >= 0:
            count_slots(workspace, reverse)

    return search_half_pair


@stage
def renewal(half_pair, impulse):
    """Fraction of the skin with less of which a list is renewed when a collision step starts.

    None of two faces': four points last only for a small shift, see `search_half_pair`.
    """
    return 0.0 if impulse and half_pair.reverse >= 0 else RENEWAL


@stage
def spend_skin(solid, other, half_pair, live, least):
    """Reduces the remaining skin by the relative motion of the last drift.

    The bound of that motion in m is the sum of absolute values along the axes, which needs no root,
    and of what rotation adds; over a plane the world's z axis alone counts. Returns the number of
    lanes with less skin left than the motion, or than `least` times the skin.
    """
    displacement, rotation_bound = solid.displacement, solid.rotation_bound
    other_displacement, other_bound = other.displacement, other.rotation_bound
    relative_motion, remaining_skin = live.relative_motion, live.remaining_skin
    skin, exhausted = half_pair.skin, 0
    across = 0.0 if half_pair.kind == PLANE else 1.0
    # a single loop for both: LLVM unrolls shorter ones instead of vectorising them
    for i in range(LANES):
        dx = displacement[0, i] - other_displacement[0, i]
        dy = displacement[1, i] - other_displacement[1, i]
        dz = displacement[2, i] - other_displacement[2, i]
        motion = across * (abs(dx) + abs(dy)) + abs(dz) + rotation_bound[i] + other_bound[i]
        left = remaining_skin[i] - motion
        relative_motion[i] = motion
        remaining_skin[i] = left
        exhausted += 1 if left < max(motion, least * at(skin, i)) else 0
    return exhausted


@stage
def spare_spin(solid, half_pair, live, least):
    """Gives skin back that a spin about the owner's z axis took: it moves no sample that turns.

    As `spend_skin`, which it follows, it returns how many lanes have too little left.
    """
    R, w, rotation_bound = solid.rotation, solid.angular_velocity, solid.rotation_bound
    relative_motion, remaining_skin = live.relative_motion, live.remaining_skin
    skin, exhausted = half_pair.skin, 0
    for i in range(LANES):
        x, y, z = w[0, i], w[1, i], w[2, i]
        whole = abs(x) + abs(y) + abs(z)
        spin = x * R[2, i] + y * R[5, i] + z * R[8, i]
        x, y, z = x - spin * R[2, i], y - spin * R[5, i], z - spin * R[8, i]
        tilts = min((abs(x) + abs(y) + abs(z)) / max(whole, 1e-300), 1.0)
        spared = rotation_bound[i] * (1.0 - tilts)
        motion, left = relative_motion[i] - spared, remaining_skin[i] + spared
        relative_motion[i] = motion
        remaining_skin[i] = left
        exhausted += 1 if left < max(motion, least * at(skin, i)) else 0
    return exhausted


@cached_by_features
def make_broadphase(features):
    """Stage that reduces the remaining skin by the last drift and replaces lists that need it.

    The first substep of a collision step also replaces lists with less than half of their skin. The
    first collision step of a call of `advance` does not.
    """
    search_half_pair, impulse = make_search_half_pair(features), features.impulse
    axial = features.axial

    @stage
    def broadphase(model, state, workspace, g, starts_collision_step):
        for k in range(model.half_pair.shape[0]):
            half_pair, live = model.half_pair[k], workspace.half_pair[k]
            least = renewal(half_pair, impulse) if starts_collision_step else 0.0
            owner, surface = workspace.solid[half_pair.owner], workspace.solid[half_pair.surface]
            exhausted = spend_skin(owner, surface, half_pair, live, least)
            if axial and half_pair.axial != 0:
                exhausted = spare_spin(owner, half_pair, live, least)
            if exhausted > 0:
                search_half_pair(model, state, workspace, g, k, least)

    return broadphase


@cached_by_features
def make_forget(features):
    """Stage that clears lists and memories in lanes whose state was set from outside.

    In the refresh that follows only these lanes update their contact memory; `lanes.end_refresh`
    lets all active lanes do so again.
    """
    clear = make_clear(features)

    @stage
    def forget(model, state, workspace, g):
        lane = workspace.lane[0]
        for k in range(model.half_pair.shape[0]):
            half_pair, live = model.half_pair[k], workspace.half_pair[k]
            for i in range(LANES):
                if lane.needs_refresh[i] == STARTS_ANEW:
                    for n in range(live.count[i]):  # behind them slots are empty
                        clear(state.candidate[g, half_pair.first_slot + n], i)
                    live.count[i] = 0
                    live.remaining_skin[i] = -1.0  # below zero: the broadphase searches it
                    live.previous_weight[i] = 0.0
                    live.previous_impact[i] = 0.0
                    live.previous_closing[i] = 0.0
                    for c in range(3):
                        live.previous_normal[c, i] = 0.0
                    live.previous_normal_force[i] = 0.0
        for i in range(LANES):
            lane.updates_memory[i] = 1 if lane.needs_refresh[i] == STARTS_ANEW else 0

    return forget


@cached_by_features
def make_clear_rest(features):
    """Stage that empties the slots behind the lists of lane i, whose world has diverged.

    The impulse law works on all slots up to the longest list of a group, and NaN velocities leave
    NaN in those that should be empty. Neither `forget` nor `lane_order` looks there.
    """
    clear, impulse = make_clear(features), features.impulse

    @stage
    def clear_rest(model, state, workspace, g, i):
        if impulse:
            for k in range(model.half_pair.shape[0]):
                half_pair = model.half_pair[k]
                for n in range(workspace.half_pair[k].count[i], half_pair.slot_count):
                    clear(state.candidate[g, half_pair.first_slot + n], i)

    return clear_rest
