"""Memory of a heap: allocation, room for lists that have grown, and the order of bodies."""

from typing import Any

import numpy as np

from physics.compiler.jit import LANES, aligned_zeros
from physics.granular.classes import Bodies
from physics.granular.pair_forces import BLOCK, ROWS
from physics.granular.tables import (
    BODY,
    CENTER,
    CLASS,
    COUNTS,
    EVALUATION,
    HIGH,
    INVERSE_MASS,
    LEVEL,
    LOW,
    MOTION,
    MOVES,
    REBUILDS,
    RESULTS,
    SCALES,
    SHEAR_LOAD,
    SKIN,
    SLABS,
    TICKET,
    TICKETS,
    VALID,
    WEIGHT,
    Constants,
    Heap,
    HeapFeatures,
    Scratch,
)
from physics.model.build import per_world_dtype
from physics.model.free_memory import check_memory
from physics.model.tables import DYNAMIC, DYNAMIC_PER_WORLD
from physics.model.workspace import SOLID

Array = np.ndarray

# pairs a particle for which there is room at first, and room beyond what was needed when it grows
_FIRST_PAIRS, _SPARE = 3.0, 1.1
# cells a particle
_CELLS = 3
# the grid covers all but this fraction of the bodies, on either side of each axis
_OUTSIDE = 0.002


def allocate(
    bodies: Bodies, constants: Constants, features: HeapFeatures, in_particle_geometry: bool
) -> Heap:
    """A heap in which nothing is listed yet, and nothing is anywhere."""
    count, n, radii = len(bodies.particles), int(bodies.particles.sum()), bodies.radii
    groups = -(-count // LANES)
    lists, places = 1 + features.history, groups * LANES
    room = int(_FIRST_PAIRS * n / SLABS) + LANES
    remembered = features.history
    index = np.arange(count)
    first = np.zeros(places + 1, np.int32)
    first[1 : count + 1] = np.cumsum(bodies.particles)
    first[count + 1 :] = n
    particle = aligned_zeros((n, 4), np.dtype(float))
    particle[:, 3] = radii
    motion = aligned_zeros((places, MOTION), np.dtype(float))
    motion[:count, INVERSE_MASS] = bodies.dynamic["inverse_mass"]
    motion[:count, CLASS] = bodies.class_of
    motion[:count, WEIGHT] = bodies.weight
    return Heap(
        order=index,
        rank=index + count * (bodies.is_ball & (not in_particle_geometry)),
        dynamic=_dynamic(bodies, index, groups),
        reach=_reach(bodies, index, places),
        first=first,
        body_of=np.repeat(index.astype(np.int32), bodies.particles),
        level_of=_levels(radii)[0].astype(np.uint8),
        local=bodies.local.copy(),
        body=aligned_zeros(groups, BODY),
        particle=particle,
        motion=motion,
        pair=np.zeros((lists, SLABS, room, 2), np.uint32),
        pair_count=np.zeros((lists, SLABS), np.int64),
        pair_range=np.zeros((lists, n if remembered else 0, 2), np.int32),
        shear=np.zeros((lists, SLABS * room if remembered else 0, 4)),
        wall=np.zeros((lists, SLABS, LANES, 2), np.uint32),
        wall_count=np.zeros((lists, SLABS), np.int64),
        wall_range=np.zeros((lists, n if remembered else 0, 2), np.int32),
        wall_shear=np.zeros((lists, SLABS * LANES if remembered else 0, 4)),
        force_range=np.zeros((SLABS, 3), np.int64),
        counts=_first_counts(),
        scale=_first_scale(constants),
    )


def _first_counts() -> Array:
    counts = np.zeros(COUNTS, np.int64)
    counts[REBUILDS] = np.iinfo(np.int32).max  # bodies have not been sorted yet
    return counts


def _first_scale(constants: Constants) -> Array:
    scale = np.zeros(SCALES)
    scale[SKIN] = constants.skins.mean()
    return scale


def _dynamic(bodies: Bodies, order: Array, groups: int) -> Array:
    """Rows of DYNAMIC for the stages of the engine: one, or one per lane group of places."""
    if bodies.equal:
        return bodies.dynamic[:1].copy()
    table = aligned_zeros(groups, per_world_dtype(DYNAMIC, DYNAMIC_PER_WORLD))
    for name in DYNAMIC.names or ():
        values = bodies.dynamic[name][order]
        if name in DYNAMIC_PER_WORLD:
            filler = np.ones_like(values[:1]) * values[-1]  # lanes without a body
            padded = np.concatenate([values, np.repeat(filler, groups * LANES - len(values), 0)])
            table[name] = np.moveaxis(padded.reshape(groups, LANES, *values.shape[1:]), 1, -1)
        else:
            table[name] = values[0]
    return table


def _reach(bodies: Bodies, order: Array, places: int) -> Array:
    """[places] m, from the centre to the farthest point of the surface."""
    reach = np.zeros(places)
    reach[: len(order)] = bodies.reach[order]
    return reach


def _levels(radii: Array) -> tuple[Array, Array]:
    """Level [n] of each particle, and the largest radius [levels] of each; each halves the size."""
    level = np.floor(np.log2(radii.max() / radii) + 1e-12).astype(int)
    used, level = np.unique(level, return_inverse=True)
    return level, np.array([radii[level == k].max() for k in range(len(used))])


def scratch_for(heap: Heap, radii: Array, threads: int) -> Scratch:
    """Working memory of a heap."""
    n = len(heap.particle)
    largest = _levels(radii)[1]
    level = np.zeros(len(largest), LEVEL)
    level["largest_radius"] = largest
    return Scratch(
        solid=aligned_zeros(threads, SOLID),
        block=aligned_zeros((threads, ROWS * BLOCK), np.dtype(float)),
        touching=np.zeros((threads, heap.pair.shape[2]), np.uint32),
        near=np.zeros((threads, n + LANES), np.uint32),
        force=np.zeros((len(heap.motion), 8)),
        cell_of=np.zeros(n, np.int32),
        cell_range=np.zeros((SLABS, 2), np.int64),
        cell_start=np.zeros(_CELLS * n + 64 * len(level), np.int32),
        level=level,
        sorted_particle=aligned_zeros((n, 4), np.dtype(float)),
        sorted_index=np.zeros(n, np.int32),
        moved=aligned_zeros((SLABS, MOVES, LANES), np.dtype(float)),
        bad=np.zeros(SLABS, np.int64),
        total=np.zeros(SLABS, np.int64),
        wall_total=np.zeros(SLABS, np.int64),
        result=np.zeros(RESULTS, np.int64),
        sync=aligned_zeros(TICKET + TICKETS * threads, np.dtype(np.int64)),
    )


def with_room_for_pairs(heap: Heap, needed: int) -> Heap:
    """The same heap with room for more pairs in each slab."""
    pair, shear, ranges = _grown(heap.pair, heap.shear, heap.pair_range, needed)
    return heap._replace(pair=pair, shear=shear, pair_range=ranges)


def with_room_for_walls(heap: Heap, needed: int) -> Heap:
    """The same heap with room for more pairs with statics in each slab."""
    wall, shear, ranges = _grown(heap.wall, heap.wall_shear, heap.wall_range, needed)
    return heap._replace(wall=wall, wall_shear=shear, wall_range=ranges)


def _grown(pairs: Array, shear: Array, ranges: Array, needed: int) -> tuple[Array, Array, Array]:
    lists, slabs, before, _ = pairs.shape
    room = int(_SPARE * needed) + LANES
    row = pairs.dtype.itemsize * 2 + (shear.dtype.itemsize * 4 if shear.size else 0)
    check_memory(lists * slabs * room * row, "the lists of particles that are near each other")
    more = np.zeros((lists, slabs, room, 2), pairs.dtype)
    more[:, :, :before] = pairs
    if shear.size == 0:
        return more, shear, ranges
    springs = np.zeros((lists, slabs, room, 4))
    springs[:, :, :before] = shear.reshape(lists, slabs, before, 4)
    slab, place = np.divmod(ranges[..., 0], before)
    moved = np.stack([slab * room + place, ranges[..., 1]], axis=-1).astype(ranges.dtype)
    return more, springs.reshape(lists, slabs * room, 4), moved


def cover(heap: Heap, radii: Array) -> None:
    """Lets the grid cover the heap as it is now."""
    centers = heap.motion[: len(heap.order), CENTER : CENTER + 3]
    finite = centers[np.isfinite(centers).all(axis=1)]
    margin = 2.0 * radii.max()
    low, high = (
        np.quantile(finite, [_OUTSIDE, 1.0 - _OUTSIDE], axis=0) if len(finite) else np.zeros((2, 3))
    )
    heap.scale[LOW : LOW + 3], heap.scale[HIGH : HIGH + 3] = low - margin, high + margin


def sort(heap: Heap, bodies: Bodies) -> Heap:
    """The same heap with its bodies sorted by where they are, so neighbours are near in memory.

    Everything moves with them, history included. The list must be made again afterwards. The large
    arrays are sorted in place, so a heap that is interrupted here must be allocated again.
    """
    radii = bodies.radii
    cover(heap, radii)
    count = len(heap.order)
    before = heap.order
    cell = 4.0 * radii.max()
    centers = heap.motion[:count, CENTER : CENTER + 3]
    cells = np.floor(np.clip(np.nan_to_num((centers - heap.scale[LOW]) / cell), -1e6, 1e6))
    places = np.lexsort(cells.T[::-1])  # by x, then y, then z
    order = before[places]
    first = np.zeros_like(heap.first)
    first[1 : count + 1] = np.cumsum(bodies.particles[order])
    first[count + 1 :] = first[count]
    counts = bodies.particles[order]
    particles = np.repeat(heap.first[places], counts) + _within(counts)
    where = np.empty(len(particles), heap.pair.dtype)  # new index of each particle
    where[particles] = np.arange(len(particles), dtype=where.dtype)

    def moved(pairs: Array) -> Array:
        # without history nothing of the old list is read again
        return np.asarray(where[pairs]) if heap.shear.size else pairs

    wall = heap.wall.copy()
    wall[..., 0] = moved(np.minimum(wall[..., 0], len(where) - 1))
    heap.motion[:count] = heap.motion[places]
    heap.particle[:] = heap.particle[particles]
    _sort_rows(heap.body, places)
    heap.counts[REBUILDS] = heap.counts[VALID] = 0
    return heap._replace(
        order=order,
        rank=heap.rank[places],
        dynamic=_dynamic(bodies, order, len(heap.body)),
        reach=_reach(bodies, order, len(heap.reach)),
        first=first,
        body_of=np.repeat(np.arange(count, dtype=np.int32), counts),
        level_of=heap.level_of[particles],
        local=heap.local if bodies.equal else heap.local[particles],
        pair=moved(heap.pair),
        pair_range=_of_particles(heap.pair_range, particles),
        wall=wall,
        wall_range=_of_particles(heap.wall_range, particles),
    )


def _within(counts: Array) -> Array:
    ends = np.cumsum(counts)
    return np.arange(ends[-1]) - np.repeat(ends - counts, counts)


def _of_particles(ranges: Array, particles: Array) -> Array:
    """Rows of particles in another order; `take`, because kernels need C order."""
    return np.take(ranges, particles, axis=1) if ranges.size else ranges


def _sort_rows(body: Array, places: Array) -> None:
    """Sorts the lanes of rows of BODY; lanes without a body stay."""
    every = np.concatenate([places, np.arange(len(places), len(body) * LANES)])
    group, lane = np.divmod(every, LANES)
    for name in BODY.names or ():
        values: Any = body[name][group, :, lane]
        body[name] = np.moveaxis(values.reshape(len(body), LANES, -1), 1, 2)


def forget(heap: Heap) -> None:
    """Contacts remember nothing, and the list must be made again."""
    heap.motion[:, SHEAR_LOAD] = 0.0
    heap.counts[EVALUATION] += 1
    heap.counts[VALID] = 0
