"""Which worlds share a lane group: those in which the same solids are near each other.

A group works on a half-pair if any of its lanes has candidates there, and on as many slots as its
longest list. So a world in which a cube is gripped costs nearly as much in a group of sixteen as in
a group of its own. Worlds with the same set of listed half-pairs are therefore put side by side,
and among these worlds with as many candidates. No result depends on it: a lane doesn't know the
worlds beside it.

Worlds change places within a window of consecutive groups, which one thread advances next. Sorted
among all worlds, groups would save a tenth more slots, but their worlds' rows would be spread over
all of the memory, and two threads would write the same cache lines: Push was 6 % slower.

A world at a place that suits it stays; the others move to places that are free. What moves is the
column of the candidates, which are stored by lane; everything else is stored by world.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from physics.compiler.jit import LANES, entry, stage
from physics.model.features import Features
from physics.model.state import State
from physics.model.tables import Model

Array = np.ndarray

# calls of `advance` between two looks at an order that is good enough
PAUSE = 8
# lane groups that exchange worlds
_WINDOW = 16
# lane groups, at least: a sorted order of fewer has hardly any group of one set
_FEWEST_GROUPS = 8
# share of the slots that are empty: with fewer there is nothing to gain
_FEW_EMPTY = 1 / 8
# slots that a moved world must save, on average: moving it costs as much
_LEAST_GAIN = 0.1
# of a key: bits of the place, and of the number of candidates; the others are for the half-pairs
_PLACE_BITS, _NUMBER_BITS = (_WINDOW * LANES - 1).bit_length(), 8
_PLACE, _MOST = (1 << _PLACE_BITS) - 1, (1 << _NUMBER_BITS) - 1
_HALF_PAIR_BITS = 63 - _PLACE_BITS - _NUMBER_BITS


class Candidates(NamedTuple):
    """Candidates of some lane groups.

    Attributes:
        values: [groups, slots, columns, LANES].
        ids: [groups, slots, LANES] of their samples.
    """

    values: Array
    ids: Array

    @classmethod
    def of(cls, candidate: Array, ids: Array) -> "Candidates":
        """Rows [groups, slots] of CANDIDATE, as numbers."""
        columns = candidate.dtype.itemsize // (8 * LANES)
        return cls(candidate.view(np.float64).reshape(*candidate.shape, columns, LANES), ids)


class Scratch(NamedTuple):
    """Working memory of `sort_worlds`, for one thread.

    Attributes:
        key: [places] which half-pairs a world lists, and how many candidates.
        ordered: [places] keys in order, each with its place.
        source: [places] the place from which a place gets its world.
        counts: [places, half-pairs] candidates.
        candidates: of one world, in the first lane of one group.
    """

    key: Array
    ordered: Array
    source: Array
    counts: Array
    candidates: Candidates

    @classmethod
    def of(cls, model: Model, state: State) -> "Scratch":
        """For worlds of a model."""
        places, slots = _WINDOW * LANES, state.candidate.shape[1]
        key, ordered, source = np.zeros((3, places), dtype=np.int64)
        counts = np.zeros((places, len(model.half_pair)), dtype=np.int64)
        candidate = np.zeros((1, slots), dtype=state.candidate.dtype)
        ids = np.zeros((1, slots, LANES), dtype=state.sample_id.dtype)
        return cls(key, ordered, source, counts, Candidates.of(candidate, ids))


def can_sort(model: Model, features: Features, count: int) -> bool:
    """Whether worlds may change their lanes: with per-world parameters these would have to move."""
    enough = count >= _FEWEST_GROUPS * LANES and len(model.half_pair) > 0
    return enough and not features.per_world_parameters


def sort_worlds(model: Model, state: State, scratch: Scratch, first: int, last: int) -> int:
    """Moves worlds of groups first <= g < last such that those that are alike stand together.

    Returns the number of worlds that moved.
    """
    candidates = Candidates.of(state.candidate, state.sample_id)
    first_slot = model.half_pair["first_slot"].copy()  # an entry relies on one memory layout
    arrays = state.half_pair, first_slot, state.place, state.resident, candidates, scratch
    return int(make_sort()(*arrays, first, last))


@stage
def _slots(scratch, n):
    """Slots that groups work on, if `source` says which world stands at each of n places."""
    total = 0
    for k in range(scratch.counts.shape[1]):
        for start in range(0, n, LANES):
            longest = 0
            for j in range(start, min(start + LANES, n)):
                longest = max(longest, scratch.counts[scratch.source[j], k])
            total += longest
    return total


@stage
def _sort(values, n):
    """Sorts the first n numbers: Shell's method, without memory of its own."""
    gap = 1
    while gap < n // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for j in range(gap, n):
            value, i = values[j], j
            while i >= gap and values[i - gap] > value:
                values[i] = values[i - gap]
                i -= gap
            values[i] = value
        gap //= 3


@stage
def _find_sources(scratch, n):
    """Writes from which place each place gets its world; returns how many get another one."""
    key, ordered, source = scratch.key, scratch.ordered, scratch.source
    for j in range(n):
        ordered[j] = key[j] << _PLACE_BITS | j
    _sort(ordered, n)
    moved, other = 0, 0
    for j in range(n):
        source[j] = j
        if ordered[j] >> _PLACE_BITS == key[j]:
            continue
        # the next world, in order of its key, that isn't where its key belongs
        place = ordered[other] & _PLACE
        while ordered[place] >> _PLACE_BITS == key[place]:
            other += 1
            place = ordered[other] & _PLACE
        source[j] = place
        other += 1
        moved += 1
    return moved


@stage
def _copy(first_slot, counts, old, source, g, i, target, h, j):
    """Copies the candidates of lane i of group g to lane j of group h.

    `first_slot` and `counts` [half-pairs] say where they are, `old` how many lane j had until now:
    those that aren't overwritten are cleared.
    """
    for k in range(counts.shape[0]):
        end = first_slot[k] + counts[k]
        for s in range(first_slot[k], end):
            for c in range(source.values.shape[2]):
                target.values[h, s, c, j] = source.values[g, s, c, i]
            target.ids[h, s, j] = source.ids[g, s, i]
        for s in range(end, first_slot[k] + old[k]):
            for c in range(source.values.shape[2]):
                target.values[h, s, c, j] = 0.0


@stage
def _move(first_slot, place, resident, candidates, scratch, base, n):
    """Moves worlds of n places from `base` on to where `source` says, cycle by cycle."""
    counts, source, buffer = scratch.counts, scratch.source, scratch.candidates
    for start in range(n):
        if source[start] == start:
            continue
        of_start, world = counts[start], resident[base + start]
        g, i = (base + start) // LANES, (base + start) % LANES
        _copy(first_slot, of_start, of_start, candidates, g, i, buffer, 0, 0)
        to = start
        while source[to] != to:
            h, j = (base + to) // LANES, (base + to) % LANES
            other = source[to]
            source[to] = to
            if other == start:
                _copy(first_slot, of_start, counts[to], buffer, 0, 0, candidates, h, j)
                resident[base + to] = world
            else:
                g, i = (base + other) // LANES, (base + other) % LANES
                _copy(first_slot, counts[other], counts[to], candidates, g, i, candidates, h, j)
                resident[base + to] = resident[base + other]
            place[resident[base + to]] = base + to
            to = other


@cache
def make_sort() -> Any:
    """Entry point of `sort_worlds`."""

    @entry
    def sort(half_pair, first_slot, place, resident, candidates, scratch, first, last):
        key, counts, moved_worlds = scratch.key, scratch.counts, 0
        for g in range(first, last, _WINDOW):
            base = g * LANES
            n = min(place.shape[0], min(last, g + _WINDOW) * LANES) - base
            total = 0
            for j in range(n):
                w, listed, candidates_here = resident[base + j], 0, 0
                for k in range(counts.shape[1]):
                    found = half_pair[w, k].count
                    counts[j, k] = found
                    listed |= (1 if found > 0 else 0) << (k % _HALF_PAIR_BITS)
                    candidates_here += found
                key[j] = listed << _NUMBER_BITS | min(candidates_here, _MOST)
                scratch.source[j] = j
                total += candidates_here
            slots = _slots(scratch, n)
            if LANES * slots - total <= _FEW_EMPTY * LANES * slots:
                continue
            moved = _find_sources(scratch, n)
            if slots - _slots(scratch, n) > _LEAST_GAIN * moved:
                _move(first_slot, place, resident, candidates, scratch, base, n)
                moved_worlds += moved
        return moved_worlds

    return sort
