"""Substeps of one world of many bodies with the spring law, by several threads.

Each thread works on its part of the blocks and of the batches, and all wait for each other between
the two. Every batch writes its own wrenches, and every body adds up those of its pairs in a fixed
order, so the result does not depend on the number of threads.
"""

from functools import cache

from physics.compiler.atomics import wait_for_all
from physics.compiler.code_cache import SOURCES
from physics.compiler.jit import large_entry
from physics.integrators.kick import make_kick
from physics.manybody.batches import make_batch_forces
from physics.manybody.blocks import (
    add_contacts,
    block_model,
    block_workspace,
    known_forces,
    make_move_block,
    make_place_block,
)
from physics.model.features import EULER, Features
from physics.model.state import STARTS_ANEW

# what a call continues with, see `make_spring_steps`
STEP, RESUME, REFRESH = range(3)
# where the counts of the threads begin in the progress
FIRST_COUNT = 8
# consecutive batches that one thread takes
BATCHES = 4


@cache
def make_spring_steps(features: Features):
    """Entry point: substeps until all are done or pairs have to be searched again."""
    sources = SOURCES
    move_block, place_block = make_move_block(features), make_place_block(features)
    batch_forces, kick = make_batch_forces(features), make_kick(features)
    before = 1.0 if features.integrator == EULER else 0.5

    @large_entry
    def spring_steps(
        model, state, workspace, crowd, pairs, h, substeps, collision_substeps, progress, barrier,
        thread, threads,
    ):  # fmt: skip
        """All threads call it with the same arguments but their workspace and `thread`.

        progress: [FIRST_COUNT + threads] substeps done; STEP, RESUME after pairs have been searched
        or REFRESH, which computes forces only; 1: pairs have to be searched; at 6 why it refreshes;
        and from FIRST_COUNT on how many bodies of each thread have left their margin.
        """
        _ = sources
        blocks, batches = crowd.solid.shape[0], crowd.order.shape[0]
        first, last = thread * blocks // threads, (thread + 1) * blocks // threads
        done, phase = progress[0], progress[1]
        wait_for_all(barrier, 0, threads)  # before any thread writes the progress
        while done < substeps or phase != STEP:
            if phase == STEP:
                far = 0
                for m in range(first, last):
                    far += move_block(model, workspace, crowd, m, before * h, h)
                progress[FIRST_COUNT + thread] = far
                wait_for_all(barrier, 0, threads)
                far = 0
                for t in range(threads):
                    far += progress[FIRST_COUNT + t]
                if far > 0:
                    wait_for_all(barrier, 0, threads)
                    if thread == 0:
                        progress[0], progress[1], progress[2] = done, RESUME, 1
                    return
            elif phase == REFRESH:
                for m in range(first, last):
                    place_block(model, workspace, crowd, m)
                wait_for_all(barrier, 0, threads)
            step = 0.0 if phase == REFRESH else h
            elapsed = done * h + step
            # new forces alone change nothing that contacts remember
            remembers = phase != REFRESH or progress[6] == STARTS_ANEW
            starts = phase != REFRESH and done > 0 and done % collision_substeps == 0
            for n in range(batches):
                if n // BATCHES % threads == thread:
                    b = crowd.order[n]
                    batch_forces(
                        model, state, workspace, crowd, pairs, b, step, elapsed, starts, remembers
                    )
            wait_for_all(barrier, 0, threads)
            for m in range(first, last):
                known_forces(model, workspace, crowd, m)
                add_contacts(crowd, pairs, m, crowd.solid[m].force, crowd.solid[m].torque)
                if phase != REFRESH and before < 1.0:
                    own = block_model(model, crowd, m)
                    kick(own, block_workspace(workspace, crowd, m), 0.5 * h)
            done += 0 if phase == REFRESH else 1
            phase = STEP
        wait_for_all(barrier, 0, threads)
        if thread == 0:
            progress[0], progress[1], progress[2] = done, STEP, 0

    return spring_steps
