"""Neighbours: pairs of particles of two bodies, within the skin of touching.

A slab searches from an equal part of the particles sorted by cell. Of two particles of a level the
one that comes first finds the other: in its own cell and the next one, and in four columns of
cells. Particles of coarser levels are found from the finer ones, in all nine columns.

The searches don't know beforehand how many they find. A slab without room only counts; the caller
then makes room and the search starts again, with the old list still there.

With history, the spring of each contact moves from the old list to the new. Only pairs that touch
now are looked up: others lose theirs in the next step.
"""

from physics.compiler.jit import stage
from physics.granular.grid import cell_of, cells_begin
from physics.granular.tables import PARITY, SKIN, SLABS
from physics.model.features import cached_by_features


@stage
def find_old(pairs, ranges, n, owner, surface):
    """Index of a pair in the flattened old list among those found from particle n, or -1."""
    first = ranges[n, 0]
    for k in range(first, first + ranges[n, 1]):
        if pairs[k, 0] == owner and pairs[k, 1] == surface:
            return k
    return -1


@stage
def keep_shear(old, new, k, evaluation):
    """Copies what contact k of the old list remembers; it must have touched in the last step."""
    if k >= 0 and old[k, 3] == evaluation:
        new[0], new[1], new[2] = old[k, 0], old[k, 1], old[k, 2]
        new[3] = evaluation


@stage
def collect(points, near, found, p, first, last, skin):
    """Appends those of the sorted particles first <= q < last that are near p; returns how many.

    `points`: flat.
    """
    x, y, z, reach = points[4 * p], points[4 * p + 1], points[4 * p + 2], points[4 * p + 3] + skin
    for q in range(first, last):
        dx, dy, dz = points[4 * q] - x, points[4 * q + 1] - y, points[4 * q + 2] - z
        most = points[4 * q + 3] + reach
        near[found] = q
        found += 1 if dx * dx + dy * dy + dz * dz < most * most else 0
    return found


@cached_by_features
def make_find_neighbors(features):
    """Stage that searches from the sorted particles of a slab and writes its part of the list."""
    history = features.history

    @stage
    def collect_all(heap, scratch, near, p, index):
        """Numbers of the sorted particles near p, each pair once; returns how many."""
        skin, start = heap.scale[SKIN], scratch.cell_start
        flat = scratch.sorted_particle.reshape(4 * scratch.sorted_particle.shape[0])
        own = heap.level_of[index]
        cell, level = scratch.cell_of[index], scratch.level[own]
        across_y = level.count[2] + 2
        across_x = across_y * (level.count[1] + 2)
        found = collect(flat, near, 0, p, p + 1, start[cell + 1], skin)
        for column in range(4):
            c = cell + (across_y if column == 0 else across_x + (column - 2) * across_y)
            begin, end = cells_begin(scratch, c - 1), start[c + 1]
            found = collect(flat, near, found, p, begin, end, skin)
        points = scratch.sorted_particle
        for k in range(own):
            level = scratch.level[k]
            across_y = level.count[2] + 2
            across_x = across_y * (level.count[1] + 2)
            cell = cell_of(level, heap.scale, points[p, 0], points[p, 1], points[p, 2])
            for column in range(9):
                c = cell + (column // 3 - 1) * across_x + (column % 3 - 1) * across_y
                begin, end = cells_begin(scratch, c - 1), start[c + 1]
                found = collect(flat, near, found, p, begin, end, skin)
        return found

    @stage
    def find_neighbors(heap, scratch, thread, slab, evaluation):
        n = scratch.sorted_index.shape[0]
        lists, near = heap.pair.shape[0], scratch.near[thread]
        old, new = heap.counts[PARITY] % lists, (heap.counts[PARITY] + 1) % lists
        pair, room = heap.pair[new, slab], heap.pair.shape[2]
        flat = heap.pair[old].reshape(SLABS * room, 2)
        points = scratch.sorted_particle
        low, high, total = heap.motion.shape[0], 0, 0
        for p in range(n * slab // SLABS, n * (slab + 1) // SLABS):
            i = scratch.sorted_index[p]
            found = collect_all(heap, scratch, near, p, i)
            a, begin = heap.body_of[i], total
            for m in range(found):
                q = near[m]
                j = scratch.sorted_index[q]
                b = heap.body_of[j]
                if a != b:
                    if total < room:
                        first = heap.rank[a] < heap.rank[b]
                        owner, surface = i if first else j, j if first else i
                        pair[total, 0] = owner
                        pair[total, 1] = surface
                        if history:
                            k = slab * room + total
                            heap.shear[new, k, 3] = -1.0
                            x, y = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
                            z, reach = points[q, 2] - points[p, 2], points[q, 3] + points[p, 3]
                            if x * x + y * y + z * z < reach * reach:
                                ranges = heap.pair_range[old]
                                at = find_old(flat, ranges, i, owner, surface)
                                if at < 0:
                                    at = find_old(flat, ranges, j, owner, surface)
                                keep_shear(heap.shear[old], heap.shear[new, k], at, evaluation)
                    total += 1
                    low, high = min(low, min(a, b)), max(high, max(a, b))
            if history:
                heap.pair_range[new, i, 0] = slab * room + begin
                heap.pair_range[new, i, 1] = total - begin
        heap.pair_count[new, slab] = min(total, room)
        scratch.total[slab] = total
        heap.force_range[slab, 0] = min(low, high)
        heap.force_range[slab, 1] = high + 1 if total > 0 else min(low, high)

    return find_neighbors
