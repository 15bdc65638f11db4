"""Which worlds share a lane group: those in which the same solids are near each other.

A group works on a half-pair if any of its lanes has candidates there, and on as many slots as its
longest list. So a world in which a cube is gripped costs nearly as much in a group of sixteen as in
a group of its own. Worlds with the same set of listed half-pairs are therefore put side by side.
No result depends on it: a lane doesn't know the worlds beside it.

Places are given out in blocks, one for each set. A world that is in the block of its set stays;
the others move to places that are free. What moves is the column of the candidates, which are
stored by lane; everything else is stored by world.
"""

from functools import cache
from typing import Any

import numpy as np

from physics.compiler.code_cache import SOURCES
from physics.compiler.jit import LANES, entry
from physics.model.features import Features
from physics.model.state import State
from physics.model.tables import Model
from physics.step.threads import run_in_blocks

Array = np.ndarray

# calls of `advance` between two looks at an order that is good enough
PAUSE = 8
# lane groups, at least: a sorted order of fewer has hardly any group of one set
_FEWEST_GROUPS = 8
# half-pairs in each group, on average, that sorting must save: moving worlds costs as much
_LEAST_GAIN = 0.5


@cache
def _make_move() -> Any:
    """Entry point that moves the candidates of worlds between their lanes and a buffer."""
    sources = SOURCES

    @entry
    def move(values, ids, counts, first_slots, worlds, places, rows, buffer, id_buffer, out, a, b):
        """Moves them out of the lanes, which are left empty, or in again.

        Args:
            values: [groups, slots, columns, LANES] of all candidates.
            ids: [groups, slots, LANES] of their samples.
            counts: [w, half-pairs] of candidates.
            first_slots: [half-pairs].
            worlds: [n].
            places: [n] of these worlds.
            rows: [n] of the buffers, at which each world begins.
            buffer: [rows, columns].
            id_buffer: [rows].
            out: whether into the buffers; else out of them.
            a: first of the worlds to move.
            b: behind the last one.
        """
        _ = sources
        columns = values.shape[2]
        for j in range(a, b):
            g, i, row = places[j] // LANES, places[j] % LANES, rows[j]
            for k in range(first_slots.shape[0]):
                for s in range(first_slots[k], first_slots[k] + counts[worlds[j], k]):
                    if out:
                        for c in range(columns):
                            buffer[row, c] = values[g, s, c, i]
                            values[g, s, c, i] = 0.0
                        id_buffer[row] = ids[g, s, i]
                    else:
                        for c in range(columns):
                            values[g, s, c, i] = buffer[row, c]
                        ids[g, s, i] = id_buffer[row]
                    row += 1

    return move


def can_sort(features: Features, count: int) -> bool:
    """Whether worlds may change their lanes: with per-world parameters these would have to move."""
    return not features.per_world_parameters and count >= _FEWEST_GROUPS * LANES


def sort_worlds(model: Model, state: State, threads: int) -> int:
    """Moves worlds such that those with the same set of listed half-pairs stand together.

    Returns the number of worlds that moved.
    """
    sets = np.ascontiguousarray(state.world["listed"])
    ordered = np.sort(sets)
    saved = _work(sets[state.resident[: len(sets)]]) - _work(ordered)
    if saved * LANES <= _LEAST_GAIN * len(sets):
        return 0
    strays = np.flatnonzero(ordered[state.place] != sets)
    # of each block as many places are free as worlds of its set are elsewhere
    worlds = strays[np.argsort(sets[strays])]
    before, after = state.place[worlds], np.sort(state.place[strays])
    counts = state.half_pair["count"]
    ends = np.cumsum(counts[worlds].sum(axis=1))
    values = state.candidate.view(np.float64).reshape(*state.candidate.shape, -1, LANES)
    buffers = np.empty((ends[-1], values.shape[2])), np.empty(ends[-1], state.sample_id.dtype)
    rows, first_slots = ends - np.diff(ends, prepend=0), model.half_pair["first_slot"].copy()
    move = _make_move()
    for out, places in ((True, before), (False, after)):

        def run(a: int, b: int, out: bool = out, places: Array = places) -> int:
            kinds = (counts, first_slots, worlds, places, rows)
            move(values, state.sample_id, *kinds, *buffers, out, a, b)
            return 0

        run_in_blocks(run, len(worlds), threads)
    state.place[worlds], state.resident[after] = after, worlds
    return len(worlds)


def _work(sets: Array) -> int:
    """Number of half-pairs that groups work on, if worlds with these sets stand in this order."""
    of_groups = np.bitwise_or.reduceat(sets, np.arange(0, len(sets), LANES))
    return int(np.bitwise_count(of_groups).sum())
