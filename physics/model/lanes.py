"""A group: worlds side by side, one to a vector lane, as the stages work on them.

State keeps worlds one after another. A kernel takes LANES of them at a time into a `Work`, whose
arrays have the lane as their last axis, advances them together and writes them back. Every stage
loops over the lanes without a branch, which LLVM turns into vector instructions: many worlds for
the price of a few. Lanes never mix, so a world's result doesn't depend on what runs beside it.
"""

from functools import cache

import numpy as np

from physics.jit import LANES, kernel, stage
from physics.model.features import Features
from physics.model.state import FIRST_POSITION, FIRST_TOUCH, PRESSED
from physics.model.tables import Model

Array = np.ndarray


@cache
def make_constants(features: Features):
    """Stage that tells the constants of group g: one row a mover and side."""
    varied = features.varied

    @stage
    def constants(model, g):
        if varied:
            mover, side, part = model.mover[g], model.side[g], model.part[g]
            return Model(mover, side, part, model.cover, model.static, model.sample)
        return model

    return constants


@kernel
def load_forces(state, work, g, m, i):
    """Takes a mover's force and torque into lane i."""
    row, solid = state.mover[g * LANES + i, m], work.solid[m]
    for c in range(3):
        solid.force[c, i] = row.force[c]
        solid.torque[c, i] = row.torque[c]


@stage
def count_slots(work, k):
    """Notes how many slots a side's longest list has."""
    side = work.side[k]
    slots = 0
    for i in range(LANES):
        slots = max(slots, side.count[i])
    side.slots = slots


@stage
def load(model, state, work, chosen, g):
    """Takes the chosen worlds of group g into the lanes; other lanes rest at the origin.

    Returns how many there are; nothing is taken if none.
    """
    lane, count = work.lane[0], 0
    for i in range(LANES):
        w = g * LANES + i
        if w < chosen.shape[0] and chosen[w] and state.world[w].diverged == 0:
            count += 1
    if count == 0:
        return 0
    for i in range(LANES):
        w = g * LANES + i
        active = w < chosen.shape[0] and chosen[w] and state.world[w].diverged == 0
        lane.active[i] = 1 if active else 0
        lane.keeps[i] = 1 if active else 0
        lane.stale[i] = 1 if active and state.world[w].stale != 0 else 0
        lane.start[i] = state.world[w].time if active else 0.0
        for m in range(model.mover.shape[0]):
            solid = work.solid[m]
            solid.swing[i] = 0.0
            for c in range(3):
                solid.shift[c, i] = 0.0
            if active:
                row = state.mover[w, m]
                for c in range(3):
                    solid.position[c, i] = row.position[c]
                    solid.momentum[c, i] = row.momentum[c]
                    solid.angular_momentum[c, i] = row.angular_momentum[c]
                    solid.reference[c, i] = row.reference[c]
                    solid.reference_velocity[c, i] = row.reference_velocity[c]
                for c in range(4):
                    solid.orientation[c, i] = row.orientation[c]
                load_forces(state, work, g, m, i)
            else:
                for c in range(3):
                    solid.position[c, i] = 0.0
                    solid.momentum[c, i] = 0.0
                    solid.angular_momentum[c, i] = 0.0
                    solid.reference[c, i] = 0.0
                    solid.reference_velocity[c, i] = 0.0
                    solid.force[c, i] = 0.0
                    solid.torque[c, i] = 0.0
                for c in range(4):
                    solid.orientation[c, i] = 1.0 if c == 3 else 0.0
        for k in range(model.side.shape[0]):
            side = work.side[k]
            if active:
                found = state.side[w, k]
                side.count[i] = found.count
                side.travel[i] = found.travel
                side.first_touch[i] = state.touch[k, FIRST_TOUCH, w]
                side.pressed[i] = state.touch[k, PRESSED, w]
                side.bore[i] = found.bore
            else:
                side.count[i] = 0
                side.travel[i] = 1e300
                side.first_touch[i] = 0.0
                side.pressed[i] = 0.0
                side.bore[i] = 0.0
    for k in range(model.side.shape[0]):
        count_slots(work, k)
    return count


@stage
def note_touch(model, state, work, g, k, pressed, elapsed):
    """Notes how hard a side presses, `pressed` [N], and when and where it does so first."""
    side, keeps = work.side[k], work.lane[0].keeps
    first, noted, start = side.first_touch, side.pressed, work.lane[0].start
    new = 0
    for i in range(LANES):
        noted[i] = pressed[i] if keeps[i] != 0 else noted[i]
        before = (pressed[i] <= 0.0) | (first[i] <= start[i] + elapsed) | (keeps[i] == 0)
        new += 0 if before else 1
    if new > 0:
        note_first(model, state, work, g, k, pressed, elapsed)


@kernel
def note_first(model, state, work, g, k, pressed, elapsed):
    """Notes when and where a side presses for the first time, in the lanes in which it does."""
    first, keeps, start = work.side[k].first_touch, work.lane[0].keeps, work.lane[0].start
    position = work.solid[min(model.side[k].owner, model.side[k].surface)].position
    for i in range(LANES):
        time = start[i] + elapsed
        if pressed[i] > 0.0 and not first[i] <= time and keeps[i] != 0:
            first[i] = time
            for c in range(3):
                state.touch[k, FIRST_POSITION + c, g * LANES + i] = position[c, i]


@stage
def end_look(model, state, work, g):
    """Gives lanes whose state wasn't set their forces back, and lets them remember again."""
    lane = work.lane[0]
    for i in range(LANES):
        lane.keeps[i] = lane.active[i]
        if lane.active[i] and not lane.stale[i]:
            for m in range(model.mover.shape[0]):
                load_forces(state, work, g, m, i)


@kernel
def store(model, state, work, g, i, time):
    """Writes lane i back to its world, at `time` s."""
    w = g * LANES + i
    state.world[w].time = time
    for m in range(model.mover.shape[0]):
        solid, row = work.solid[m], state.mover[w, m]
        for c in range(3):
            row.position[c] = solid.position[c, i]
            row.momentum[c] = solid.momentum[c, i]
            row.angular_momentum[c] = solid.angular_momentum[c, i]
            row.reference[c] = solid.reference[c, i]
            row.force[c] = solid.force[c, i]
            row.torque[c] = solid.torque[c, i]
        for c in range(4):
            row.orientation[c] = solid.orientation[c, i]
    for k in range(model.side.shape[0]):
        side, found = work.side[k], state.side[w, k]
        found.count = side.count[i]
        found.travel = side.travel[i]
        state.touch[k, FIRST_TOUCH, w] = side.first_touch[i]
        # by impulses `choose` may have emptied a list after the search
        state.touch[k, PRESSED, w] = side.pressed[i] if side.count[i] > 0 else 0.0
        found.bore = side.bore[i]
