"""Candidates: the samples of a side that are nearer to its surface than the skin.

A list stays complete while owner and surface, as seen from each other, have moved no further than
the skin; with an empty list, no further than the nearest sample's distance. Over a plane only the
way along its normal counts, and of a turn what it moves of the cores, for roundings turn in place:
a ball that rolls is listed once. Each side keeps that allowance in `travel`, spends it with every
drift, and is searched again when the next step might outrun it. What a contact remembers moves
along from list to list. Slots behind the end of a list hold zeros, whose weight of zero makes them
no contact.
"""

import math
from functools import cache

from physics.collision.contact_point import ALMOST
from physics.collision.distances import box_distance, capsule_distance, sphere_distance
from physics.collision.manifold import make_choose, note
from physics.collision.relative_frame import relative_pose
from physics.collision.separations import gap_along_axes, make_measure
from physics.jit import LANES, at, kernel, stage
from physics.model.lanes import count_slots
from physics.scene.shapes import BOX, CAPSULE, PLANE, SPHERE


@cache
def make_search(features):
    """Kernels that make the list of candidates of one side anew, and clear a slot, in one lane."""
    friction = features.friction and not features.viscous  # what it remembers
    impulse, resistance = features.impulse, features.resistance
    sphere, box, capsule = features.sphere, features.box, features.capsule
    particles, varied = features.particles, features.varied
    measure = make_measure(features)

    @kernel
    def distance(side, i, x, y, z):
        kind, core = side.kind, side.core
        a, b, c = at(core[0], i), at(core[1], i), at(core[2], i)
        d, nx, ny, nz = z, 0.0, 0.0, 1.0
        if box and kind == BOX:
            sharp = side.sharp != 0
            d, nx, ny, nz, _ = box_distance(x, y, z, a, b, c, 0.0, at(side.radius, i), sharp)
        if sphere and kind == SPHERE:
            d, nx, ny, nz = sphere_distance(x, y, z, a, b, c)
        if capsule and kind == CAPSULE:
            d, nx, ny, nz = capsule_distance(x, y, z, a, b, c)
        return d, nx, ny, nz

    @kernel
    def keep(row, i, old, cursor, count, key, x, y, z, weight):
        """Writes a candidate, with the memory of the old list's entry of the same key."""
        while cursor < count and old[cursor].sample_id < key:
            cursor += 1
        known = cursor < count and old[cursor].sample_id == key
        row.sample[0, i] = x
        row.sample[1, i] = y
        row.sample[2, i] = z
        row.weight[i] = weight
        row.load[i] = old[cursor].load if known else 0.0
        if not impulse:
            row.impact_speed[i] = old[cursor].impact_speed if known else 0.0
            row.approach[i] = old[cursor].approach if known else 0.0
        for axis in range(3):
            if impulse:
                row.blow[axis, i] = 0.0
            if friction:
                row.shear[axis, i] = old[cursor].shear[axis] if known else 0.0
            if friction and impulse:
                row.pull[axis, i] = old[cursor].pull[axis] if known else 0.0
            if resistance:
                row.twist[axis, i] = old[cursor].twist[axis] if known else 0.0
        if box:
            row.face[i] = old[cursor].face if known else 0.0
        return cursor

    @kernel
    def remember(row, i, key, memory):
        """Notes what a candidate remembers."""
        memory.sample_id = key
        memory.load = row.load[i]
        if not impulse:
            memory.impact_speed = row.impact_speed[i]
            memory.approach = row.approach[i]
        for axis in range(3):
            if friction:
                memory.shear[axis] = row.shear[axis, i]
            if friction and impulse:
                memory.pull[axis] = row.pull[axis, i]
            if resistance:
                memory.twist[axis] = row.twist[axis, i]
        if box:
            memory.face = row.face[i]

    @kernel
    def clear(row, i):
        """Leaves a lane of a slot without a candidate."""
        row.weight[i] = 0.0
        row.load[i] = 0.0
        if not impulse:
            row.impact_speed[i] = 0.0
            row.approach[i] = 0.0
        if box:
            row.face[i] = 0.0
        for axis in range(3):
            row.sample[axis, i] = 0.0
            if impulse:
                row.blow[axis, i] = 0.0
            if friction:
                row.shear[axis, i] = 0.0
            if friction and impulse:
                row.pull[axis, i] = 0.0
            if resistance:
                row.twist[axis, i] = 0.0
            if particles:
                row.partner[axis, i] = 0.0

    @kernel
    def list_samples(model, state, work, g, k, i, seen, count, near, reach):
        """Fills the list from the samples; `count` entries of work.old are known from before.

        `near`: where work.near begins for this side. `reach`: m, of the gaps to list.
        """
        side, old = model.side[k], work.old
        first, room = side.first_slot, side.slot_count
        candidate = state.candidate[g, first : first + room]
        ids = state.sample_id[g, first : first + room]
        R, c = seen.rotation, seen.position
        height = at(side.core[0], i) if side.kind == PLANE else 0.0
        radius, share = at(side.radius, i), at(side.share, i)
        n = 0
        cursor = 0
        nearest = 1e300
        pairs = particles and side.partner_count > 0
        if not pairs:
            measure(model, side, i, seen, work.gap)
        for s in range(side.sample_count):
            gap = 0.0 if pairs else work.gap[s]
            if not pairs and not gap < reach:
                nearest = min(nearest, gap)
                continue
            sample = model.sample[:, side.first_sample + s]
            sx, sy, sz, weight = sample[0], sample[1], sample[2], share * sample[3]
            if varied:
                size = at(side.owner_size, i)
                sx, sy, sz = size * sx, size * sy, size * sz
            x = R[0, i] * sx + R[1, i] * sy + R[2, i] * sz + c[0, i]
            y = R[3, i] * sx + R[4, i] * sy + R[5, i] * sz + c[1, i]
            z = R[6, i] * sx + R[7, i] * sy + R[8, i] * sz + c[2, i] - height
            if pairs:
                for j in range(side.partner_count):
                    p = model.sample[:, side.first_partner + j]
                    px, py, pz = p[0], p[1], p[2]
                    if varied:
                        size = at(side.surface_size, i)
                        px, py, pz = size * px, size * py, size * pz
                    ux, uy, uz = x - px, y - py, z - pz
                    gap = math.sqrt(ux * ux + uy * uy + uz * uz) - radius
                    if gap < reach and n == room:
                        state.world[g * LANES + i].overflow = 1
                    elif gap < reach:
                        key = s * side.partner_count + j
                        shared = min(weight, p[3])
                        cursor = keep(candidate[n], i, old, cursor, count, key, sx, sy, sz, shared)
                        candidate[n].partner[0, i] = px
                        candidate[n].partner[1, i] = py
                        candidate[n].partner[2, i] = pz
                        ids[n, i] = key
                        n += 1
                    elif gap < nearest:
                        nearest = gap
            else:
                if impulse:
                    _, nx, ny, nz = distance(side, i, x, y, z)
                    note(
                        work.near[near + n],
                        work.solid[side.frame],
                        i,
                        x,
                        y,
                        z + height,
                        nx,
                        ny,
                        nz,
                        gap,
                    )
                cursor = keep(candidate[n], i, old, cursor, count, s, sx, sy, sz, weight)
                ids[n, i] = s
                n += 1
        return n, reach if n > 0 else nearest

    @kernel
    def search(model, state, work, g, k, i, seen, near, path):
        """`seen`: the owner in the frame of the surface. `near`: see `list_samples`.

        `path`: m that the two have moved in the last drift.
        """
        side, meeting = model.side[k], work.side[k]
        first, before = side.first_slot, meeting.count[i]
        c = seen.position
        # far apart as a whole: bounding spheres, or a bounding sphere over a plane
        if side.kind == PLANE:
            gap = c[2, i] - at(side.core[0], i) - at(side.owner_reach, i)
        else:
            far = math.sqrt(c[0, i] * c[0, i] + c[1, i] * c[1, i] + c[2, i] * c[2, i])
            gap = far - at(side.owner_reach, i) - at(side.surface_reach, i)
        if side.partner_count == 0:
            gap = max(gap, gap_along_axes(side, i, seen))
        reach = at(side.skin, i)
        if impulse and side.partner_count == 0:
            # what is met by the middle of the next drift collides before it overlaps; beyond what
            # `find` of impacts accepts, by more than round-off
            reach = max(reach, 0.5 * path + 2.0 * ALMOST)
        count = 0
        travel = gap
        if not gap > reach:
            for n in range(before):
                key = state.sample_id[g, first + n, i]
                remember(state.candidate[g, first + n], i, key, work.old[n])
            count, travel = list_samples(model, state, work, g, k, i, seen, before, near, reach)
        for n in range(count, before):
            clear(state.candidate[g, first + n], i)
        meeting.count[i] = count
        meeting.travel[i] = travel
        if count == 0:
            meeting.bore[i] = 0.0
            meeting.pressed[i] = 0.0

    return search, clear


@cache
def make_side_search(features):
    """Kernel that searches a side in the lanes that need it."""
    search, clear = make_search(features)
    choose = make_choose(features, clear)
    impulse, compound = features.impulse, features.compound

    @stage
    def look(work, side, seen):
        """Where a side's owner is, as seen from its surface; for a plane that is the world."""
        if side.kind == PLANE:
            return work.solid[side.owner]
        frame = side.frame if compound else side.surface
        relative_pose(work.solid[side.owner], work.solid[frame], seen)
        return seen

    @kernel
    def side_search(model, state, work, g, k, least):
        """In the active lanes whose travel is below `least` of the skin or the last drift's path.

        The impulse law chooses among the candidates of a pair, so both its sides are searched.
        """
        side, meeting = model.side[k], work.side[k]
        mirror = side.mirror if impulse else -1
        seen = look(work, side, work.relative[0])
        back = look(work, model.side[mirror], work.relative[1]) if mirror >= 0 else seen
        for i in range(LANES):
            path = meeting.path[i]
            if work.lane[0].active[i] and meeting.travel[i] < max(least * at(side.skin, i), path):
                search(model, state, work, g, k, i, seen, 0, path)
                if mirror >= 0:
                    search(model, state, work, g, mirror, i, back, meeting.count[i], path)
                if impulse:
                    choose(model, state, work, g, k, i)
        count_slots(work, k)
        if mirror >= 0:
            count_slots(work, mirror)

    return side_search


@stage
def path_over_plane(shift, swing, path):
    """How far a solid has moved at most along the normal of a plane, which is the world's z."""
    for i in range(LANES):
        path[i] = abs(shift[2, i]) + swing[i]


@stage
def path_apart(shift, other_shift, swing, other_swing, path):
    """How far two solids have moved at most, as seen from each other.

    The sum of absolute values is never less than the length, and needs no root.
    """
    for i in range(LANES):
        dx = shift[0, i] - other_shift[0, i]
        dy = shift[1, i] - other_shift[1, i]
        dz = shift[2, i] - other_shift[2, i]
        path[i] = abs(dx) + abs(dy) + abs(dz) + swing[i] + other_swing[i]


@cache
def make_candidates(features):
    """Stage that spends the allowance of the last drift and searches where it is used up.

    The first substep of a collision step makes anew what is half used up: `opens`.
    """
    side_search = make_side_search(features)

    @stage
    def candidates(model, state, work, g, opens):
        for k in range(model.side.shape[0]):
            side, meeting = model.side[k], work.side[k]
            least, skin = 0.5 if opens else 0.0, side.skin
            owner, surface = work.solid[side.owner], work.solid[side.surface]
            if side.kind == PLANE:
                path_over_plane(owner.shift, owner.swing, meeting.path)
            else:
                path_apart(owner.shift, surface.shift, owner.swing, surface.swing, meeting.path)
            travel, path = meeting.travel, meeting.path
            spent = 0
            for i in range(LANES):
                left = travel[i] - path[i]
                travel[i] = left
                spent += 1 if left < max(path[i], least * at(skin, i)) else 0
            if spent > 0:
                side_search(model, state, work, g, k, least)

    return candidates


@cache
def make_forget(features):
    """Stage that clears what contacts remember in lanes that were set from outside."""
    clear = make_search(features)[1]

    @stage
    def forget(model, state, work, g):
        lane = work.lane[0]
        for k in range(model.side.shape[0]):
            side, meeting = model.side[k], work.side[k]
            for i in range(LANES):
                if lane.stale[i]:
                    # such a state may follow one that had diverged, and left anything in a slot
                    for n in range(side.slot_count):
                        clear(state.candidate[g, side.first_slot + n], i)
                    meeting.count[i] = 0
                    meeting.travel[i] = -1.0
                    meeting.bore[i] = 0.0
                    meeting.pressed[i] = 0.0
        for i in range(LANES):
            lane.keeps[i] = lane.stale[i]

    return forget
