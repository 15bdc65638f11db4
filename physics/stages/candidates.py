"""Candidates: the samples of a side that are nearer to its surface than the skin.

A list stays complete while owner and surface together have moved no further than the skin; with an
empty list, no further than the nearest sample's distance. Each side keeps that allowance in
`travel`, spends it with every drift, and is searched again when the next step might outrun it. What
a contact remembers moves along from list to list. Slots behind the end of a list hold zeros, whose
weight of zero makes them no contact.
"""

import math
from functools import cache

from physics.group import count_slots
from physics.jit import LANES, kernel, stage
from physics.shapes import BOX, CAPSULE, PLANE, SPHERE
from physics.stages.relative import relative_pose
from physics.stages.surfaces import box_distance, capsule_distance, sphere_distance


@cache
def make_search(features):
    """Kernel that makes the list of candidates of one side anew, in one lane."""
    friction = features.friction
    sphere, box, capsule = features.sphere, features.box, features.capsule
    particles = features.particles

    @kernel
    def distance(side, x, y, z):
        kind, a, b, c = side.kind, side.core[0], side.core[1], side.core[2]
        d = z
        if box and kind == BOX:
            d = box_distance(x, y, z, a, b, c, 0.0, side.radius, side.sharp != 0)[0]
        if sphere and kind == SPHERE:
            d = sphere_distance(x, y, z, a, b, c)[0]
        if capsule and kind == CAPSULE:
            d = capsule_distance(x, y, z, a, b, c)[0]
        return d

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
        row.impact_speed[i] = old[cursor].impact_speed if known else 0.0
        row.load[i] = old[cursor].load if known else 0.0
        if friction:
            row.slid[i] = old[cursor].slid if known else 0.0
            for axis in range(3):
                row.shear[axis, i] = old[cursor].shear[axis] if known else 0.0
        if box:
            row.face[i] = old[cursor].face if known else 0.0
        return cursor

    @kernel
    def remember(row, i, key, memory):
        """Notes what a candidate remembers."""
        memory.sample_id = key
        memory.impact_speed = row.impact_speed[i]
        memory.load = row.load[i]
        if friction:
            memory.slid = row.slid[i]
            for axis in range(3):
                memory.shear[axis] = row.shear[axis, i]
        if box:
            memory.face = row.face[i]

    @kernel
    def clear(row, i):
        """Leaves a lane of a slot without a candidate."""
        row.weight[i] = 0.0
        row.impact_speed[i] = 0.0
        row.load[i] = 0.0
        if box:
            row.face[i] = 0.0
        if friction:
            row.slid[i] = 0.0
        for axis in range(3):
            row.sample[axis, i] = 0.0
            if friction:
                row.shear[axis, i] = 0.0
            if particles:
                row.partner[axis, i] = 0.0

    @kernel
    def list_samples(model, state, work, g, k, i, seen, count):
        """Fills the list from the samples; `count` entries of work.old are known from before."""
        side, old = model.side[k], work.old
        first, room = side.first_slot, side.slot_count
        candidate = state.candidate[g, first : first + room]
        ids = state.sample_id[g, first : first + room]
        R, c = seen.rotation, seen.position
        height = side.core[0] if side.kind == PLANE else 0.0
        radius, skin = side.radius, side.skin
        n = 0
        cursor = 0
        nearest = 1e300
        for s in range(side.sample_count):
            sample = model.sample[side.first_sample + s]
            sx, sy, sz, weight = sample[0], sample[1], sample[2], sample[3]
            x = R[0, i] * sx + R[1, i] * sy + R[2, i] * sz + c[0, i]
            y = R[3, i] * sx + R[4, i] * sy + R[5, i] * sz + c[1, i]
            z = R[6, i] * sx + R[7, i] * sy + R[8, i] * sz + c[2, i] - height
            if particles and side.partner_count > 0:
                for j in range(side.partner_count):
                    p = model.sample[side.first_partner + j]
                    ux, uy, uz = x - p[0], y - p[1], z - p[2]
                    gap = math.sqrt(ux * ux + uy * uy + uz * uz) - radius
                    if gap < skin and n == room:
                        state.world[g * LANES + i].overflow = 1
                    elif gap < skin:
                        key = s * side.partner_count + j
                        shared = min(weight, p[3])
                        cursor = keep(candidate[n], i, old, cursor, count, key, sx, sy, sz, shared)
                        for axis in range(3):
                            candidate[n].partner[axis, i] = p[axis]
                        ids[n, i] = key
                        n += 1
                    elif gap < nearest:
                        nearest = gap
            else:
                gap = distance(side, x, y, z) - radius
                if gap < skin:
                    cursor = keep(candidate[n], i, old, cursor, count, s, sx, sy, sz, weight)
                    ids[n, i] = s
                    n += 1
                elif gap < nearest:
                    nearest = gap
        return n, skin if n > 0 else nearest

    @kernel
    def search(model, state, work, g, k, i, seen, lasting):
        """`seen`: the owner in the frame of the surface. `lasting`: contacts keep their memory."""
        side, meeting = model.side[k], work.side[k]
        first, before = side.first_slot, meeting.count[i]
        c = seen.position
        # far apart as a whole: bounding spheres, or a bounding sphere over a plane
        if side.kind == PLANE:
            gap = c[2, i] - side.core[0] - side.owner_reach
        else:
            far = math.sqrt(c[0, i] * c[0, i] + c[1, i] * c[1, i] + c[2, i] * c[2, i])
            gap = far - side.owner_reach - side.surface_reach
        count = 0
        travel = gap
        if not gap > side.skin:
            known = before if lasting else 0
            for n in range(known):
                key = state.sample_id[g, first + n, i]
                remember(state.candidate[g, first + n], i, key, work.old[n])
            count, travel = list_samples(model, state, work, g, k, i, seen, known)
        # a state set from outside may follow one that had diverged, and left anything in a slot
        for n in range(count, before if lasting else side.slot_count):
            clear(state.candidate[g, first + n], i)
        meeting.count[i] = count
        meeting.travel[i] = travel

    return search


@cache
def make_side_search(features):
    """Kernel that searches a side in the lanes that need it."""
    search = make_search(features)

    @kernel
    def side_search(model, state, work, g, k, least, lasting):
        """In the active lanes whose travel is below `least` [m] or the last drift's path."""
        side, meeting = model.side[k], work.side[k]
        owner, surface = work.solid[side.owner], work.solid[side.surface]
        seen = owner if side.kind == PLANE else work.relative[0]
        if side.kind != PLANE:
            relative_pose(owner, surface, seen)
        for i in range(LANES):
            path = owner.path[i] + surface.path[i]
            if work.lane[0].active[i] and meeting.travel[i] < max(least, path):
                search(model, state, work, g, k, i, seen, lasting)
        count_slots(work, k)

    return side_search


@cache
def make_candidates(features):
    """Stage that spends the allowance of the last drift and searches where it is used up."""
    side_search = make_side_search(features)

    @stage
    def candidates(model, state, work, g):
        for k in range(model.side.shape[0]):
            side = model.side[k]
            travel = work.side[k].travel
            first, second = work.solid[side.owner].path, work.solid[side.surface].path
            spent = 0
            for i in range(LANES):
                path = first[i] + second[i]
                left = travel[i] - path
                travel[i] = left
                spent += 1 if left < path else 0
            if spent > 0:
                side_search(model, state, work, g, k, 0.0, True)

    return candidates


@cache
def make_collision_step(features):
    """What opens a collision step: every list that is half used up is made anew."""
    side_search = make_side_search(features)

    @stage
    def collision_step(model, state, work, g):
        for k in range(model.side.shape[0]):
            travel, least = work.side[k].travel, 0.5 * model.side[k].skin
            spent = 0
            for i in range(LANES):
                spent += 1 if travel[i] < least else 0
            if spent > 0:
                side_search(model, state, work, g, k, least, True)

    return collision_step
