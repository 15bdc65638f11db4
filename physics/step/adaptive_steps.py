"""The time loop of the adaptive integrator: each world takes steps of its own.

A step is tried in all lanes at once, in each by its own length. Where the estimated error per
second is within the tolerance the lane moves on, elsewhere it returns to where it was and tries a
shorter step. A world never sees the steps of others, so its result doesn't depend on them; a lane
group takes as many tries as its slowest world.

The error e per second grows with the fourth power of the step. The next step is that at which it
would be half of the tolerance, but at most twice the last one, and at least half of one that was
rejected. What is left of a frame is divided into equal steps, so none is tiny.
"""

import math
from typing import Any

from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, factory, large_entry, stage
from physics.integrators.runge_kutta import make_error, make_save_rates, make_speed, make_start
from physics.model.features import Features, cached_by_features
from physics.model.lanes import load, make_constants, store
from physics.step.readout import make_write_rows
from physics.step.runge_kutta_step import make_trials
from physics.step.time_layers import first_diverged

# shortest step, as a fraction of the longest; if the tolerance needs a shorter one that is an error
SHORTEST = 1e-6


@stage
def fourth_root(x):
    """The fourth root of a number that isn't negative."""
    return math.sqrt(math.sqrt(x))


@stage
def load_pace(state, workspace, g):
    """Starts the lanes' time, with the steps that worlds had proposed, 0 where there is none."""
    pace, lane = workspace.pace[0], workspace.lane[0]
    for i in range(LANES):
        pace.step[i] = 0.0
        pace.proposal[i] = 0.0
        pace.done[i] = 0.0
        pace.accepted[i] = 0
        pace.rejected[i] = 0
        pace.vanished[i] = 0
        if lane.active[i]:
            pace.proposal[i] = state.pace[lane.world[i]].step


@cached_by_features
def make_choose_steps(features: Features):
    """Stage that chooses the length of each lane's next step; returns how many lanes still move."""
    speed = make_speed(features)

    @stage
    def choose_steps(model, workspace, span, longest, tolerance):
        pace, lane = workspace.pace[0], workspace.lane[0]
        step, proposal, done = pace.step, pace.proposal, pace.done
        moving, unknown = 0, 0
        for i in range(LANES):
            moves = lane.active[i] != 0 and pace.vanished[i] == 0 and done[i] < span
            step[i] = 1.0 if moves else 0.0
            moving += 1 if moves else 0
            unknown += 1 if moves and proposal[i] == 0.0 else 0
        if unknown > 0:
            speed(model, workspace)
        for i in range(LANES):
            if step[i] > 0.0:
                if proposal[i] == 0.0:
                    # as if the state, which changes by v per second, did so at a rate of v radians
                    v = pace.error[i]
                    proposal[i] = fourth_root(tolerance / v) / v
                proposal[i] = min(longest, max(proposal[i], SHORTEST * longest))
                left = span - done[i]
                step[i] = left / math.ceil(left / proposal[i] * (1.0 - 1e-12))
        return moving

    return choose_steps


@cached_by_features
def make_judge(features: Features):
    """Stage that keeps the steps whose error is small enough, and takes the other lanes back."""
    error = make_error(features)
    _, return_to_start = make_start(features)

    @stage
    def judge(model, workspace, span, longest, tolerance):
        error(model, workspace)
        pace = workspace.pace[0]
        for i in range(LANES):
            step, e = pace.step[i], pace.error[i]
            kept = step > 0.0 and e <= tolerance
            if not kept:
                return_to_start(model, workspace, i)
            if step > 0.0:
                ideal = step * fourth_root(0.5 * tolerance / e)
                if kept:
                    last = span - pace.done[i] <= step  # the whole rest was one step
                    pace.done[i] = span if last else pace.done[i] + step
                    pace.accepted[i] += 1
                    pace.proposal[i] = min(min(longest, 2.0 * pace.proposal[i]), ideal)
                else:
                    pace.rejected[i] += 1
                    pace.proposal[i] = max(0.5 * step, ideal)
                    if pace.proposal[i] < SHORTEST * longest:
                        pace.vanished[i] = 1

    return judge


@cached_by_features
def make_write_back(features: Features):
    """Stage that stores all active lanes into their worlds."""
    write_rows = make_write_rows(features)

    @stage
    def write_back(model, state, workspace, table, g):
        lane, pace = workspace.lane[0], workspace.pace[0]
        for i in range(LANES):
            if lane.active[i]:
                w = lane.world[i]
                store(model, state, workspace, i, lane.start[i] + pace.done[i])
                write_rows(model, state, w, i, table)
                saved = state.pace[w]
                saved.step = pace.proposal[i]
                saved.accepted += pace.accepted[i]
                saved.rejected += pace.rejected[i]
                saved.vanished = pace.vanished[i]
                diverged = first_diverged(model, workspace, i)
                if diverged == 0 and pace.vanished[i]:
                    diverged = pace.body[i] + 1
                state.world[w].needs_refresh = 0
                state.world[w].diverged = diverged

    return write_back


@factory
def make_kernel(features: Features):
    """Entry point: as `time_layers.make_advance`, with a tolerance in 1/s as the last argument.

    `h` s is the longest step, and `substeps` times it the time to advance.
    """
    constants, trials = make_constants(features), make_trials(features)
    save_start, _ = make_start(features)
    save_rates = make_save_rates(features)
    choose_steps, judge = make_choose_steps(features), make_judge(features)
    write_back = make_write_back(features)

    @large_entry
    def advance_adaptively(
        all_model, state, workspace, table, chosen, first, last, h, substeps, tolerance
    ):
        state, workspace = bundle(state), bundle(workspace)
        span = substeps * h
        for g in range(first, last):
            model = bundle(constants(all_model, g))
            if load(model, state, workspace, chosen, g) == 0:
                continue
            load_pace(state, workspace, g)
            needs_refresh = 0
            for i in range(LANES):
                needs_refresh += workspace.lane[0].needs_refresh[i]
            refresh = needs_refresh > 0
            while True:
                if not refresh:
                    save_start(model, workspace)
                    save_rates(model, workspace, 0)
                    if choose_steps(model, workspace, span, h, tolerance) == 0:
                        break
                trials(model, state, workspace, g, 0.0, refresh)
                if not refresh:
                    judge(model, workspace, span, h, tolerance)
                refresh = False
            write_back(model, state, workspace, table, g)
        failed = 0
        for place in range(first * LANES, last * LANES):
            w = state.resident[place]
            if w >= 0 and chosen[w] and state.world[w].diverged != 0:
                failed += 1
        return failed

    return advance_adaptively


def make_adaptive_advance(features: Features, tolerance: float) -> Any:
    """The kernel at a tolerance in 1/s, called like that of `time_layers.make_advance`."""
    kernel = make_kernel(features)

    def with_tolerance(function: Any) -> Any:
        return lambda *arguments: function(*arguments[:-1], tolerance)  # it has no collision steps

    advance = with_tolerance(kernel)
    advance.is_loaded = kernel.is_loaded
    advance.is_compiled = with_tolerance(kernel.is_compiled)
    advance.prepare = with_tolerance(kernel.prepare)
    advance.load = with_tolerance(kernel.load)
    return advance
