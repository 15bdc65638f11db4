"""Candidates: the samples of a side that are nearer to its surface than the skin.

A list stays complete while owner and surface together have moved no further than the skin; with an
empty list, no further than the nearest sample's distance. Each side keeps that allowance in
`travel`, spends it with every drift, and is searched again when the next step might outrun it. What
a contact remembers moves along from list to list.
"""

import math
from functools import cache

from physics.jit import LANES, kernel, stage
from physics.shapes import BOX, CAPSULE, PLANE, SPHERE
from physics.stages.kinematics import CENTER, PATH
from physics.stages.relative import OFFSET, relative_pose
from physics.stages.surfaces import box_distance, capsule_distance, sphere_distance

# columns of the scratch copy of an old list: what a candidate remembers, then its sample
OLD_ID = 5
OLD = 6


@cache
def make_search(features):
    """Kernel that makes the list of candidates of one side anew."""
    fields, partner = features.lane_fields, features.partner_field
    memories = 2 + 3 * features.friction
    sphere, box, capsule = features.sphere, features.box, features.capsule
    particles = features.particles

    @kernel
    def distance(side, x, y, z):
        kind, a, b, c = side.kind, side.core[0], side.core[1], side.core[2]
        d = z
        if box and kind == BOX:
            d = box_distance(x, y, z, a, b, c)[0]
        if sphere and kind == SPHERE:
            d = sphere_distance(x, y, z, a, b, c)[0]
        if capsule and kind == CAPSULE:
            d = capsule_distance(x, y, z, a, b, c)[0]
        return d

    @kernel
    def keep(state, w, base, n, room, key, cursor, count, old, x, y, z, weight):
        """Writes candidate n, with the memory of the old list's entry of the same key."""
        if n == room:
            state.world[w].overflow = 1
            return n, cursor
        while cursor < count and old[cursor, OLD_ID] < key:
            cursor += 1
        known = cursor < count and old[cursor, OLD_ID] == key
        o = (base + n // LANES) * fields * LANES + n % LANES
        state.lanes[o] = x
        state.lanes[o + LANES] = y
        state.lanes[o + 2 * LANES] = z
        state.lanes[o + 3 * LANES] = weight
        for m in range(memories):
            state.lanes[o + (4 + m) * LANES] = old[cursor, m] if known else 0.0
        return n + 1, cursor

    @kernel
    def search(model, state, frame, rel, old, w, k):
        chunks = state.sample_id.shape[1] // LANES
        base = w * chunks + model.side[k].first_chunk
        side, found = model.side[k], state.side[w, k]
        slot = side.first_chunk * LANES
        room = side.chunk_count * LANES
        count = found.count
        found.count = 0

        # far apart as a whole: bounding spheres, or a bounding sphere over a plane
        a, b = side.owner, side.surface
        reach = side.owner_reach
        if side.kind == PLANE:
            gap = frame[a, CENTER + 2] - side.core[0] - reach
        else:
            dx = frame[a, CENTER] - frame[b, CENTER]
            dy = frame[a, CENTER + 1] - frame[b, CENTER + 1]
            dz = frame[a, CENTER + 2] - frame[b, CENTER + 2]
            gap = math.sqrt(dx * dx + dy * dy + dz * dz) - reach - side.surface_reach
        skin = side.skin
        if gap > skin:
            found.travel = gap
            return

        for n in range(count):
            old[n, OLD_ID] = state.sample_id[w, slot + n]
            o = (base + n // LANES) * fields * LANES + n % LANES
            for m in range(memories):
                old[n, m] = state.lanes[o + (4 + m) * LANES]

        relative_pose(model, frame, rel, k)
        radius = side.radius
        n = 0
        cursor = 0
        nearest = 1e300
        for i in range(side.sample_count):
            s = side.first_sample + i
            sx, sy, sz = model.sample[s, 0], model.sample[s, 1], model.sample[s, 2]
            weight = model.sample[s, 3]
            x = rel[0] * sx + rel[1] * sy + rel[2] * sz + rel[OFFSET]
            y = rel[3] * sx + rel[4] * sy + rel[5] * sz + rel[OFFSET + 1]
            z = rel[6] * sx + rel[7] * sy + rel[8] * sz + rel[OFFSET + 2]
            if particles and side.partner_count > 0:
                for j in range(side.partner_count):
                    p = side.first_partner + j
                    ux = x - model.sample[p, 0]
                    uy = y - model.sample[p, 1]
                    uz = z - model.sample[p, 2]
                    gap = math.sqrt(ux * ux + uy * uy + uz * uz) - radius
                    if gap < skin:
                        key = i * side.partner_count + j
                        m = n
                        shared = min(weight, model.sample[p, 3])
                        n, cursor = keep(
                            state, w, base, n, room, key, cursor, count, old, sx, sy, sz, shared
                        )
                        if n > m:
                            state.sample_id[w, slot + m] = key
                            o = (base + m // LANES) * fields * LANES + m % LANES
                            for c in range(3):
                                state.lanes[o + (partner + c) * LANES] = model.sample[p, c]
                    elif gap < nearest:
                        nearest = gap
            else:
                gap = distance(side, x, y, z) - radius
                if gap < skin:
                    m = n
                    n, cursor = keep(
                        state, w, base, n, room, i, cursor, count, old, sx, sy, sz, weight
                    )
                    if n > m:
                        state.sample_id[w, slot + m] = i
                elif gap < nearest:
                    nearest = gap
        found.count = n
        found.travel = skin if n > 0 else nearest
        # lanes without a candidate repeat the last one, weightless
        if n > 0:
            o = (base + (n - 1) // LANES) * fields * LANES
            last = (n - 1) % LANES
            for lane in range(last + 1, LANES):
                for f in range(fields):
                    weightless = f >= 3 and f < 4 + memories
                    state.lanes[o + f * LANES + lane] = (
                        0.0 if weightless else state.lanes[o + f * LANES + last]
                    )

    return search


@cache
def make_candidates(features):
    """Stage that spends the allowance of the last drift and searches where it is used up."""
    search = make_search(features)

    @stage
    def candidates(model, state, frame, rel, old, w):
        for k in range(model.side.shape[0]):
            side, found = model.side[k], state.side[w, k]
            path = frame[side.owner, PATH] + frame[side.surface, PATH]
            left = found.travel - path
            found.travel = left
            if left < path:
                search(model, state, frame, rel, old, w, k)

    return candidates


@cache
def make_collision_step(features):
    """What opens a collision step: every list that is half used up is made anew."""
    search = make_search(features)

    @kernel
    def collision_step(model, state, frame, rel, old, w):
        for k in range(model.side.shape[0]):
            if state.side[w, k].travel < 0.5 * model.side[k].skin:
                search(model, state, frame, rel, old, w, k)

    return collision_step
