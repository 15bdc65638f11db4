"""The three layers of time: a frame holds collision steps, a collision step holds substeps.

Each layer asks the one below to advance by its own span. Fixed steps: a frame is cut into equal
substeps, grouped into collision steps of so many; a time that doesn't fit leaves no remainder, for
the substep is shortened until it does.
"""

import math
from functools import cache

from physics.collision.broadphase import make_forget
from physics.jit import LANES, SOURCES, entry, kernel, stage
from physics.model.features import Features
from physics.model.lanes import load, make_constants, store
from physics.motion.kinematics import place_statics, place_tools
from physics.step.readout import make_write_rows
from physics.step.substep import make_substep

# m, kg m/s or kg m^2/s in sum: beyond it a mover counts as diverged
LARGEST = 1e50


def cut(span: float, longest: float) -> int:
    """Number of equal substeps no longer than `longest` s that make up `span` s."""
    return max(1, math.ceil(span / longest * (1.0 - 1e-12)))


@kernel
def first_diverged(model, work, i):
    """Index of the first mover in lane i that isn't finite, plus 1; 0 if all are.

    Forces hold squares of squares of speeds: a state that is too large for these counts as well.
    """
    for m in range(model.mover.shape[0]):
        solid = work.solid[m]
        total = 0.0
        for c in range(3):
            total += abs(solid.position[c, i])
            total += abs(solid.momentum[c, i]) + abs(solid.angular_momentum[c, i])
        if not total < LARGEST:
            return m + 1
    return 0


@cache
def make_write_back(features: Features):
    """Stage that writes lanes back to their worlds: the diverged ones, and in the end all."""
    write_rows = make_write_rows(features)

    @stage
    def write_back(model, state, work, table, g, elapsed, last):
        lane = work.lane[0]
        for i in range(LANES):
            if lane.active[i]:
                diverged = first_diverged(model, work, i)
                if last or diverged != 0:
                    w = g * LANES + i
                    store(model, state, work, g, i, lane.start[i] + elapsed)
                    write_rows(model, state, w, table)
                    state.world[w].stale = 0
                    state.world[w].diverged = diverged
                    lane.active[i] = 0

    return write_back


@cache
def make_advance(features: Features):
    """Entry point that advances the chosen worlds of groups first <= g < last by substeps * h s.

    It writes their rows of a readout, and returns how many of them have diverged or run out of
    room for candidates.

    Every world runs the same instructions in its own lane, so its result is the same to the last
    bit whatever runs beside it, and however groups are shared out over threads.
    """
    sources = SOURCES
    constants, forget = make_constants(features), make_forget(features)
    substep = make_substep(features)
    write_back = make_write_back(features)

    @entry
    def advance(
        all_model, state, work, table, chosen, first, last, h, substeps, collision_substeps
    ):
        _ = sources
        for g in range(first, last):
            model = constants(all_model, g)
            if load(model, state, work, chosen, g) == 0:
                continue
            place_statics(model, work)  # a group that diverged leaves nothing for the next
            place_tools(model, work)
            lane, stale = work.lane[0], 0
            for i in range(LANES):
                stale += lane.stale[i]
            for i in range(LANES):
                if lane.active[i]:
                    state.world[g * LANES + i].overflow = 0
            # states that were set from outside have no forces yet: a look comes before their first
            # step. Forces have one place in the code; kernels grow too long for LLVM otherwise
            look = stale > 0
            if look:
                forget(model, state, work, g)
            done = 0
            while True:
                together = min(collision_substeps, substeps - done)
                opens = done > 0
                for _s in range(together + (1 if look else 0)):
                    done += 0 if look else 1
                    substep(model, state, work, g, h, done * h, opens, look)
                    opens, look = False, False
                write_back(model, state, work, table, g, done * h, done == substeps)
                if done == substeps:
                    break
        failed = 0
        for w in range(first * LANES, min(last * LANES, chosen.shape[0])):
            status = state.world[w]
            if chosen[w] and (status.diverged != 0 or status.overflow != 0):
                failed += 1
        return failed

    return advance
