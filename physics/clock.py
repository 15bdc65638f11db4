"""The three layers of time: a frame holds collision steps, a collision step holds substeps.

Each layer asks the one below to advance by its own span. Fixed steps: a frame is cut into equal
substeps, grouped into collision steps of so many; a time that doesn't fit leaves no remainder, for
the substep is shortened until it does.
"""

import math
from functools import cache

from physics.features import Features
from physics.jit import SOURCES, entry, kernel
from physics.pipeline import make_forces, make_substep
from physics.stages.candidates import make_collision_step, make_search
from physics.stages.kinematics import make_kinematics, place_statics

# m, kg m/s or kg m^2/s in sum: beyond it a mover counts as diverged
LARGEST = 1e50


def cut(span: float, longest: float) -> int:
    """Number of equal substeps no longer than `longest` s that make up `span` s."""
    return max(1, math.ceil(span / longest * (1.0 - 1e-12)))


@cache
def make_refresh(features: Features):
    """Kernel that brings candidates and forces up to a state that was set from outside."""
    kinematics = make_kinematics(features)
    search = make_search(features)
    forces = make_forces(features)

    @kernel
    def refresh(model, state, frame, rel, rows, old, w):
        kinematics(model, state, frame, w)
        for k in range(model.side.shape[0]):
            state.side[w, k].count = 0  # what an earlier look left behind doesn't count
            search(model, state, frame, rel, old, w, k)
        forces(model, state, frame, rel, rows, w, 0.0, state.world[w].time)
        state.world[w].stale = 0

    return refresh


@kernel
def first_diverged(state, w):
    """Index of the first mover of a world that isn't finite, plus 1; 0 if all are.

    Forces hold squares of squares of speeds: a state that is too large for these counts as well.
    """
    for i in range(state.mover.shape[1]):
        m = state.mover[w, i]
        total = 0.0
        for c in range(3):
            total += abs(m.position[c]) + abs(m.momentum[c]) + abs(m.angular_momentum[c])
        if not total < LARGEST:
            return i + 1
    return 0


@cache
def make_advance(features: Features):
    """Entry point that advances the worlds first <= w < last by substeps * h seconds.

    It returns how many of them have diverged or run out of room for candidates.

    Every world runs the same instructions on its own rows alone, so its result is the same to the
    last bit whatever runs beside it, and however worlds are shared out over threads.
    """
    sources = SOURCES
    refresh = make_refresh(features)
    collision_step = make_collision_step(features)
    substep = make_substep(features)

    @entry
    def advance(model, state, scratch, first, last, h, substeps, collision_substeps):
        _ = sources
        frame, rel, rows, old = scratch
        place_statics(model, frame)
        for w in range(first, last):
            if state.world[w].diverged != 0:
                continue
            start = state.world[w].time
            state.world[w].overflow = 0
            if state.world[w].stale != 0:
                refresh(model, state, frame, rel, rows, old, w)
            done = 0
            while done < substeps:
                if done > 0:
                    collision_step(model, state, frame, rel, old, w)
                for _s in range(min(collision_substeps, substeps - done)):
                    done += 1
                    substep(model, state, frame, rel, rows, old, w, h, start + done * h)
                state.world[w].diverged = first_diverged(state, w)
                if state.world[w].diverged != 0:
                    break
            state.world[w].time = start + done * h
        failed = 0
        for w in range(first, last):
            status = state.world[w]
            failed += 1 if status.diverged != 0 or status.overflow != 0 else 0
        return failed

    return advance
