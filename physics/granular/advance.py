"""The kernel: many steps of a heap in one call, which all threads make together.

A step has two parts that run in parallel: the forces between particles, slab by slab of pairs, and
the motion of bodies, slab by slab of bodies. Between them the threads wait for each other. Each
thread takes the slabs of its own share, then what is left of the others'. All threads read the same
numbers, so they agree on what comes next without talking to each other; thread 0 writes those that
belong to all.

A kernel can't allocate. Where a list has no room it returns, the caller makes room and calls it
again: it continues where it stopped.
"""

import math
from typing import Any

from physics.compiler.atomics import fetch_add, wait_for_all
from physics.compiler.jit import LANES, factory, large_entry, stage
from physics.granular.body_pass import (
    DRIFT,
    KICK,
    LOAD,
    STORE,
    SUM,
    first_not_finite,
    make_body_pass,
)
from physics.granular.grid import (
    count_particles,
    find_cells,
    particles_of_slab,
    set_up_grid,
    sort_particles,
)
from physics.granular.neighbors import make_find_neighbors
from physics.granular.pair_forces import make_pair_forces
from physics.granular.static_forces import make_find_statics
from physics.granular.tables import (
    BARRIER,
    DIVERGED,
    DONE,
    EVALUATION,
    LEAST_OF,
    MORE_FORCES,
    MORE_PAIRS,
    MORE_WALLS,
    MOST,
    MOST_OF,
    NEEDED,
    PARITY,
    REBUILDS,
    REFRESH,
    ROTATION,
    SINCE,
    SKIN,
    SLABS,
    SORT,
    STATUS,
    STEPS,
    TICKET,
    TICKETS,
    VALID,
    HeapFeatures,
)
from physics.model.features import cached_by_features

# Lists after which bodies are sorted again. Sorting takes as long as two or three lists
SORT_AFTER = 30
# The skin is adapted to how fast bodies move: a list should last for so many steps. With fewer
# the search dominates; with more, pairs that don't touch
_SHORT, _LONG = 16, 60
_WIDER, _NARROWER = 1.25, 0.8


@stage
def take(scratch, region, thread, threads, turn):
    """The next slab of a parallel region that no thread has taken, and from whose share.

    Each thread first takes its own share, the same in every region, which its cache holds; then
    what is left of the others' shares. `turn` says how many shares are finished, 0 at first; if no
    slab is left, it is the number of threads.
    """
    while turn < threads:
        owner = (thread + turn) % threads
        first, last = SLABS * owner // threads, SLABS * (owner + 1) // threads
        # in each region every thread finds each share finished once
        taken = fetch_add(scratch.sync, TICKET + TICKETS * owner, 1)
        slab = first + taken - region * (last - first + threads)
        if slab < last:
            return slab, turn
        turn += 1
    return SLABS, turn


@stage
def adapt_skin(heap, constants):
    """Makes the skin wider if the last list was short-lived, narrower if it lasted long."""
    steps, skin = heap.counts[SINCE], heap.scale[SKIN]
    if heap.counts[VALID] != 0:  # the list has been used up; it wasn't thrown away
        skin = skin * _WIDER if steps < _SHORT else (skin * _NARROWER if steps > _LONG else skin)
    heap.scale[SKIN] = min(max(skin, constants.skins[0]), constants.skins[1])


@stage
def is_used_up(heap, scratch):
    """Whether two particles may touch that are not listed as neighbours.

    The motion of a pair is measured relative to the middle of all displacements, which halves it
    while a heap falls, or where only few bodies move. Statics don't move, so next to them a body
    may move by the whole skin.
    """
    most, turned, skin, square = 0.0, 0.0, heap.scale[SKIN], 0.0
    moved = scratch.moved
    for slab in range(SLABS):
        for i in range(LANES):
            far = moved[slab, MOST, i]
            most = most if far <= most else far  # keeps NaN
            turned = max(turned, moved[slab, ROTATION, i])
    for axis in range(3):
        low, high = math.inf, -math.inf
        for slab in range(SLABS):
            for i in range(LANES):
                low = min(low, moved[slab, LEAST_OF + axis, i])
                high = max(high, moved[slab, MOST_OF + axis, i])
        square += (high - low) * (high - low)
    of_pair = min(most, 0.5 * math.sqrt(square) + turned)
    return not (most <= skin and of_pair <= 0.5 * skin)


@stage
def any_bad(scratch):
    """Whether some body isn't finite."""
    bad = False
    for slab in range(SLABS):
        bad = bad or scratch.bad[slab] >= 0
    return bad


@cached_by_features
def make_rebuild(features):
    """Stage that makes the list of neighbours again; returns DONE or why it couldn't."""
    find_neighbors, find_statics = make_find_neighbors(features), make_find_statics(features)

    @stage
    def rebuild(heap, constants, scratch, thread, threads, region, evaluation):
        groups = heap.body.shape[0]
        wait_for_all(scratch.sync, BARRIER, threads)  # until all know that the list is used up
        if thread == 0:
            adapt_skin(heap, constants)
            scratch.result[NEEDED] = set_up_grid(heap, scratch)
        wait_for_all(scratch.sync, BARRIER, threads)
        cells = scratch.result[NEEDED]
        turn = 0
        while True:
            slab, turn = take(scratch, region, thread, threads, turn)
            if slab >= SLABS:
                break
            first, last = groups * slab // SLABS, groups * (slab + 1) // SLABS
            scratch.bad[slab] = -1
            for group in range(first, last):
                if scratch.bad[slab] < 0:
                    scratch.bad[slab] = first_not_finite(heap.body[group], group)
            if scratch.bad[slab] < 0:
                begin, end = particles_of_slab(heap, slab)
                find_cells(heap, scratch, slab, begin, end)
                find_statics(
                    heap, constants, scratch, thread, slab, first * LANES, last * LANES, evaluation
                )
                for group in range(first, last):
                    row = heap.body[group]
                    for c in range(3):
                        for i in range(LANES):
                            row.listed_position[c, i] = row.position[c, i]
                    for c in range(4):
                        for i in range(LANES):
                            row.listed_orientation[c, i] = row.orientation[c, i]
        wait_for_all(scratch.sync, BARRIER, threads)
        if any_bad(scratch):
            return DIVERGED
        turn = 0
        while True:
            slab, turn = take(scratch, region + 1, thread, threads, turn)
            if slab >= SLABS:
                break
            count_particles(heap, scratch, slab, cells)
        wait_for_all(scratch.sync, BARRIER, threads)
        turn = 0
        while True:
            slab, turn = take(scratch, region + 2, thread, threads, turn)
            if slab >= SLABS:
                break
            sort_particles(heap, scratch, slab, cells)
        wait_for_all(scratch.sync, BARRIER, threads)
        turn = 0
        while True:
            slab, turn = take(scratch, region + 3, thread, threads, turn)
            if slab >= SLABS:
                break
            find_neighbors(heap, scratch, thread, slab, evaluation)
        wait_for_all(scratch.sync, BARRIER, threads)
        most, most_walls, forces = 0, 0, 0
        for slab in range(SLABS):
            most = max(most, scratch.total[slab])
            most_walls = max(most_walls, scratch.wall_total[slab])
            forces += heap.force_range[slab, 1] - heap.force_range[slab, 0]
        status, needed = DONE, 0
        if most > heap.pair.shape[2]:
            status, needed = MORE_PAIRS, most
        elif most_walls > heap.wall.shape[2]:
            status, needed = MORE_WALLS, most_walls
        elif forces > scratch.force.shape[0]:
            status, needed = MORE_FORCES, forces
        if thread == 0:
            scratch.result[NEEDED] = needed
            if status == DONE:
                heap.counts[PARITY] = 1 - heap.counts[PARITY]
                heap.counts[REBUILDS] += 1
                heap.counts[SINCE] = 0
                heap.counts[VALID] = 1
                begin = 0
                for slab in range(SLABS):
                    heap.force_range[slab, 2] = begin
                    begin += heap.force_range[slab, 1] - heap.force_range[slab, 0]
            else:  # the skin was adapted already
                heap.counts[VALID] = 0
        wait_for_all(scratch.sync, BARRIER, threads)
        return status

    return rebuild


@factory
def make_advance(features: HeapFeatures) -> Any:
    """Entry point: advances a heap by `steps` steps of `h` s; all threads call it together.

    With `resume` it continues after a return for more room. Otherwise it loads `states`, and first
    computes their forces if `Scratch.result[REFRESH]` is set. A call for no threads does nothing.
    """
    body_pass, pair_forces = make_body_pass(features), make_pair_forces(features)
    rebuild = make_rebuild(features)

    @large_entry
    def advance(heap, constants, scratch, states, thread, threads, h, steps, resume):
        if threads == 0:  # the first call compiles, which must be over when threads wait
            return 0
        done, region = scratch.result[STEPS], 0
        refresh = scratch.result[REFRESH] != 0
        what = LOAD | (0 if refresh or steps == 0 else DRIFT)
        what |= STORE if not refresh and steps == 0 else 0
        skip, status = resume != 0, DONE
        # of contacts that last: the number of the evaluation in which they touched last
        evaluation = heap.counts[EVALUATION]
        while True:
            if not skip:
                turn = 0
                while True:
                    slab, turn = take(scratch, region, thread, threads, turn)
                    if slab >= SLABS:
                        break
                    body_pass(heap, constants, scratch, states, thread, slab, what, h, evaluation)
                region += 1
                if what & SUM:
                    if refresh:
                        refresh = False
                    else:
                        done += 1
                        evaluation += 1
                wait_for_all(scratch.sync, BARRIER, threads)
                if what & STORE:
                    status = DIVERGED if any_bad(scratch) else DONE
                    break
            skip = False
            if heap.counts[VALID] == 0 or is_used_up(heap, scratch):
                status = SORT
                if heap.counts[REBUILDS] < SORT_AFTER:
                    status = rebuild(heap, constants, scratch, thread, threads, region, evaluation)
                    region += 4
                if status != DONE:
                    break
            turn = 0
            while True:
                slab, turn = take(scratch, region, thread, threads, turn)
                if slab >= SLABS:
                    break
                pair_forces(
                    heap, constants, scratch, thread, slab, 0.0 if refresh else h, evaluation
                )
            region += 1
            wait_for_all(scratch.sync, BARRIER, threads)
            last = done + (0 if refresh else 1) >= steps
            what = SUM | (0 if refresh else KICK) | (STORE if last else DRIFT)
            if thread == 0:
                heap.counts[SINCE] += 1
        # all threads have read what they need of `result` before
        wait_for_all(scratch.sync, BARRIER, threads)
        if thread == 0:
            scratch.result[STATUS] = status
            scratch.result[STEPS] = done
            heap.counts[EVALUATION] = evaluation
            scratch.result[REFRESH] = 1 if refresh else 0
        return 0

    return advance
