"""Substeps of one world of many bodies with the impulse law, by several threads.

The steps of `impulse.solver`, but swept colour by colour: the pairs of one colour share no body, so
they are solved at once, by any number of threads, with the same result. Those that found no colour
are solved one after the other.

Instantaneous collisions are local: only pairs with a body whose velocity a collision has changed
take part, while in worlds side by side all contacts of a world do. The energy that restitution may
return is that of the whole world's collisions in a substep, with the largest restitution among
them.
"""

import math
from functools import cache

from physics.compiler.atomics import wait_for_all
from physics.compiler.code_cache import SOURCES
from physics.compiler.jit import large_entry, sequence, stage
from physics.impulse.restitution import MAX_SWEEPS
from physics.integrators.kick import make_kick
from physics.manybody.blocks import (
    add_contacts,
    block_model,
    block_workspace,
    change_velocities,
    known_forces,
    make_move_block,
    make_place_block,
    write_tensors,
)
from physics.manybody.impulse_batches import (
    make_book_impacts,
    make_find_batch_impacts,
    make_finish_batch,
    make_impact_batch,
    make_list_contacts,
    make_prepare_batch,
    make_push_out_batch,
    make_restitution_batch,
    make_sweep_batch,
    make_warm_batch,
    stir,
)
from physics.manybody.spring_steps import BATCHES, REFRESH, RESUME, STEP
from physics.manybody.tables import MOST_COLOURS
from physics.model.features import EULER, Features, cached_by_features
from physics.model.state import STARTS_ANEW

# what a call continues with, besides those of the spring law: there is room for all contact rows
ROWS = 3
# numbers that each thread writes for the others
SHARED = 16


@stage
def of_thread(first, last, thread, threads):
    """Where the part of a thread begins and ends."""
    count = last - first
    return first + count * thread // threads, first + count * (thread + 1) // threads


@stage
def part_of_colour(crowd, colour, thread, threads):
    """Which entries of `Crowd.order` of a colour a thread works on, and whether there are any.

    Pairs without a colour are left to the first thread.
    """
    begin, end = crowd.colour_first[colour], crowd.colour_first[colour + 1]
    if colour < MOST_COLOURS:
        first, last = of_thread(begin, end, thread, threads)
    else:
        first, last = begin, end if thread == 0 else begin
    return first, last, end > begin


@stage
def total(shared, threads, column):
    """Sum of what the threads have counted."""
    found = 0.0
    for t in range(threads):
        found += shared[t, column]
    return found


@stage
def largest(shared, threads, column):
    """The largest of what the threads have found."""
    found = 0.0
    for t in range(threads):
        found = max(found, shared[t, column])
    return found


@stage
def all_work(crowd, pairs, barrier, thread, threads, shared):
    """J of all impact impulses since it was last asked for; in the order of the batches."""
    if thread == 0:
        work = 0.0
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if pairs.busy[b] != 0:
                for i in range(pairs.impact_work.shape[1]):
                    work += pairs.impact_work[b, i]
                    pairs.impact_work[b, i] = 0.0
        shared[0, 4] = work
    wait_for_all(barrier, 0, threads)
    work = shared[0, 4]
    wait_for_all(barrier, 0, threads)
    return work


@cached_by_features
def make_collide(features):
    """Sequence of the instantaneous collisions of a substep, see `impulse.restitution`."""
    find_batch_impacts = make_find_batch_impacts(features)
    push_out_batch, impact_batch = make_push_out_batch(features), make_impact_batch(features)
    restitution_batch = make_restitution_batch(features)
    book_impacts = make_book_impacts(features)

    @sequence
    def find(model, workspace, rows, crowd, pairs, h, barrier, thread, threads, shared, stamp):
        """Number of colliding pairs; stirs their bodies at `stamp`."""
        mine = shared[thread]
        mine[0], mine[1], mine[2] = 0.0, 0.0, 0.0
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if n // BATCHES % threads == thread and pairs.busy[b] != 0:
                mine[2] += find_batch_impacts(model, workspace, rows, crowd, pairs, b, h, mine)
                for i in range(pairs.colliding.shape[1]):
                    if pairs.colliding[b, i] != 0:
                        stir(crowd, pairs.first[b, i], stamp)
                        stir(crowd, pairs.second[b, i], stamp)
        wait_for_all(barrier, 0, threads)
        found = total(shared, threads, 2)
        wait_for_all(barrier, 0, threads)
        return found

    @sequence
    def push_out(model, workspace, rows, crowd, pairs, since, barrier, thread, threads):
        for colour in range(MOST_COLOURS + 1):
            first, last, used = part_of_colour(crowd, colour, thread, threads)
            for n in range(first, last):
                if pairs.busy[crowd.order[n]] != 0:
                    push_out_batch(model, workspace, rows, crowd, pairs, crowd.order[n], since)
            if used:
                wait_for_all(barrier, 0, threads)

    @sequence
    def solve(
        model, workspace, rows, crowd, pairs, fastest, after, barrier, thread, threads, shared,
        stamp,
    ):  # fmt: skip
        """Sweeps until no velocity changes; only pairs with a body that the last sweep changed."""
        for _ in range(MAX_SWEEPS):
            moved = 0
            for colour in range(MOST_COLOURS + 1):
                first, last, used = part_of_colour(crowd, colour, thread, threads)
                for n in range(first, last):
                    b = crowd.order[n]
                    if pairs.busy[b] != 0:
                        moved += impact_batch(
                            model, workspace, rows, crowd, pairs, b, stamp, stamp + 1, after,
                            fastest,
                        )  # fmt: skip
                if used:
                    wait_for_all(barrier, 0, threads)
            stamp += 1
            shared[thread, 3] = moved
            wait_for_all(barrier, 0, threads)
            moves = total(shared, threads, 3)
            wait_for_all(barrier, 0, threads)
            if moves == 0.0:
                break
        return stamp

    @sequence
    def restitute(
        model, workspace, rows, crowd, pairs, rescale, scale, barrier, thread, threads, stamp
    ):
        for colour in range(MOST_COLOURS + 1):
            first, last, used = part_of_colour(crowd, colour, thread, threads)
            for n in range(first, last):
                b = crowd.order[n]
                if pairs.busy[b] != 0:
                    restitution_batch(
                        model, workspace, rows, crowd, pairs, b, rescale, scale, stamp
                    )
            if used:
                wait_for_all(barrier, 0, threads)

    @sequence
    def collide(
        model, workspace, rows, crowd, pairs, h, refresh, barrier, thread, threads, shared, stamp
    ):
        """Returns the last stamp, and whether anything has collided."""
        # each stage is called in one place: two calls would be compiled twice
        for attempt in range(2):
            stamp += 1
            found = find(
                model, workspace, rows, crowd, pairs, h, barrier, thread, threads, shared, stamp
            )
            if found == 0.0:
                return stamp, False
            if attempt == 0:
                push_out(model, workspace, rows, crowd, pairs, stamp, barrier, thread, threads)
        fastest, e = largest(shared, threads, 0), largest(shared, threads, 1)
        wait_for_all(barrier, 0, threads)
        for after in range(2):
            stamp = solve(
                model, workspace, rows, crowd, pairs, fastest, after == 1, barrier, thread,
                threads, shared, stamp,
            )  # fmt: skip
            if after == 1:
                break
            work = all_work(crowd, pairs, barrier, thread, threads, shared)
            allowed, scale = e * e * max(-work, 0.0), 1.0
            stamp += 1
            for rescale in range(2):
                restitute(
                    model, workspace, rows, crowd, pairs, rescale == 1, scale, barrier, thread,
                    threads, stamp,
                )  # fmt: skip
                gained = all_work(crowd, pairs, barrier, thread, threads, shared)
                scale = math.sqrt(allowed / gained) if gained > allowed else 1.0
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if n // BATCHES % threads == thread and pairs.busy[b] != 0:
                book_impacts(model, workspace, rows, crowd, pairs, b, refresh)
        wait_for_all(barrier, 0, threads)
        return stamp, True

    return collide


@cached_by_features
def make_sweeps(features):
    """Sequences of a sweep over all contacts, and of the first guess."""
    sweep_batch, warm_batch = make_sweep_batch(features), make_warm_batch(features)

    @sequence
    def sweep_all(model, workspace, rows, crowd, pairs, h, soft, barrier, thread, threads):
        for colour in range(MOST_COLOURS + 1):
            first, last, used = part_of_colour(crowd, colour, thread, threads)
            for n in range(first, last):
                b = crowd.order[n]
                if pairs.busy[b] != 0:
                    sweep_batch(model, workspace, rows, crowd, pairs, b, h, soft)
            if used:
                wait_for_all(barrier, 0, threads)

    @sequence
    def warm_all(model, workspace, rows, crowd, pairs, barrier, thread, threads):
        for colour in range(MOST_COLOURS + 1):
            first, last, used = part_of_colour(crowd, colour, thread, threads)
            for n in range(first, last):
                b = crowd.order[n]
                if pairs.busy[b] != 0:
                    warm_batch(model, workspace, rows, crowd, pairs, b)
            if used:
                wait_for_all(barrier, 0, threads)

    return sweep_all, warm_all


@stage
def place_rows(crowd, pairs):
    """Gives each batch its contact rows; returns how many there are."""
    count = 0
    for n in range(crowd.order.shape[0]):
        b = crowd.order[n]
        pairs.first_row[b] = count
        count += pairs.row_count[b] if pairs.busy[b] != 0 else 0
    return count


@cache
def make_impulse_steps(features: Features):
    """Entry point: as `make_spring_steps`, with contact rows that all threads share."""
    sources = SOURCES
    move_block, place_block = make_move_block(features), make_place_block(features)
    list_contacts, prepare_batch = make_list_contacts(features), make_prepare_batch(features)
    collide, kick = make_collide(features), make_kick(features)
    sweep_all, warm_all = make_sweeps(features)
    finish_batch = make_finish_batch(features)
    euler = features.integrator == EULER
    before, lag = (1.0, 0.0) if euler else (0.5, 0.5)

    @large_entry
    def impulse_steps(
        model, state, workspace, rows, crowd, pairs, h, substeps, collision_substeps, progress,
        barrier, shared, thread, threads,
    ):  # fmt: skip
        """`rows`: of CONTACT_ROW; `shared`: [threads, SHARED]; all else as `spring_steps`.

        progress[2] is 2 where there are not enough rows, and progress[3] says how many it takes.
        """
        _ = sources
        blocks, batches = crowd.solid.shape[0], crowd.order.shape[0]
        first, last = of_thread(0, blocks, thread, threads)
        done, phase, stamp = progress[0], progress[1], progress[4]
        wait_for_all(barrier, 0, threads)  # before any thread writes the progress
        while done < substeps or phase != STEP:
            refresh = phase == REFRESH or (phase == ROWS and progress[5] != 0)
            if phase == STEP:
                far = 0
                for m in range(first, last):
                    far += move_block(model, workspace, crowd, m, before * h, h)
                shared[thread, 5] = far
                wait_for_all(barrier, 0, threads)
                far = total(shared, threads, 5)
                wait_for_all(barrier, 0, threads)
                if far > 0:
                    if thread == 0:
                        progress[0], progress[1], progress[2] = done, RESUME, 1
                        progress[4] = stamp
                    return
            elif phase == REFRESH:
                for m in range(first, last):
                    place_block(model, workspace, crowd, m)
                wait_for_all(barrier, 0, threads)
            span, drifted = (before * h, 0.0) if refresh else (h, h)
            elapsed = done * h + drifted
            remembers = not refresh or progress[6] == STARTS_ANEW
            starts = not refresh and done > 0 and done % collision_substeps == 0
            if phase != ROWS:
                for n in range(batches):
                    if n // BATCHES % threads == thread:
                        list_contacts(model, state, workspace, crowd, pairs, crowd.order[n], starts)
            for m in range(first, last):
                write_tensors(crowd, m)
                known_forces(model, workspace, crowd, m)
            wait_for_all(barrier, 0, threads)
            if thread == 0:
                progress[3] = place_rows(crowd, pairs)
            wait_for_all(barrier, 0, threads)
            if progress[3] > rows.shape[0]:
                wait_for_all(barrier, 0, threads)
                if thread == 0:
                    progress[0], progress[1], progress[2] = done, ROWS, 2
                    progress[4], progress[5] = stamp, 1 if refresh else 0
                return
            for n in range(batches):
                b = crowd.order[n]
                if n // BATCHES % threads == thread and pairs.busy[b] != 0:
                    prepare_batch(model, state, workspace, rows, crowd, pairs, b, span, remembers)
            wait_for_all(barrier, 0, threads)
            # velocities are half a step old; bodies collide with the present ones
            for m in range(first, last):
                change_velocities(crowd, m, lag * drifted)
            wait_for_all(barrier, 0, threads)
            stamp, collided = collide(
                model, workspace, rows, crowd, pairs, span, drifted == 0.0, barrier, thread,
                threads, shared, stamp,
            )  # fmt: skip
            for m in range(first, last):
                if collided and not refresh:
                    solid = crowd.solid[m]
                    add_contacts(crowd, pairs, m, solid.momentum, solid.angular_momentum)
                change_velocities(crowd, m, -lag * drifted)
            wait_for_all(barrier, 0, threads)
            for soft in range(2):
                if soft == 1:
                    for m in range(first, last):
                        change_velocities(crowd, m, span)
                    wait_for_all(barrier, 0, threads)
                    warm_all(model, workspace, rows, crowd, pairs, barrier, thread, threads)
                sweep_all(
                    model, workspace, rows, crowd, pairs, span, soft == 1, barrier, thread, threads
                )
            for n in range(batches):
                b = crowd.order[n]
                if n // BATCHES % threads == thread and pairs.busy[b] != 0:
                    finish_batch(
                        model, state, workspace, rows, crowd, pairs, b, span, elapsed, remembers
                    )
            wait_for_all(barrier, 0, threads)
            for m in range(first, last):
                solid = crowd.solid[m]
                add_contacts(crowd, pairs, m, solid.force, solid.torque)
                if not refresh and not euler:
                    own = block_model(model, crowd, m)
                    kick(own, block_workspace(workspace, crowd, m), 0.5 * h)
            done += 0 if refresh else 1
            phase = STEP
        wait_for_all(barrier, 0, threads)
        if thread == 0:
            progress[0], progress[1], progress[2], progress[4] = done, STEP, 0, stamp

    return impulse_steps
