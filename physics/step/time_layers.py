"""The three time layers: a frame holds collision steps, a collision step holds substeps.

Each layer asks the one below to advance by its own time span. A frame is divided into equal
substeps no longer than the fidelity's, so no remainder is left; a fixed number of substeps makes a
collision step.
"""

import math

from physics.collision.broadphase import make_clear_rest, make_forget
from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, factory, large_entry, stage
from physics.model.features import RK4, Features, cached_by_features
from physics.model.lanes import load, make_constants, store
from physics.model.state import BEGINS, QUERY
from physics.motion.kinematics import write_drive_frames, write_static_frames
from physics.motion.servo_work import make_load_servos, make_store_servos
from physics.step.readout import make_write_rows
from physics.step.runge_kutta_step import make_runge_kutta_substep
from physics.step.time_control import make_controlled_substep, make_end_call

# m, kg m/s or kg m^2/s, in sum: beyond it a dynamic body counts as diverged
LARGEST = 1e50


def substep_count(span: float, longest: float) -> int:
    """Number of equal substeps no longer than `longest` s that make up `span` s."""
    return max(1, math.ceil(span / longest * (1.0 - 1e-12)))


@stage
def first_diverged(model, workspace, i):
    """Index plus 1 of the first dynamic body in lane i that isn't finite; 0 if all are.

    Forces contain fourth powers of speeds: a state too large for these counts as well.
    """
    for m in range(model.dynamic.shape[0]):
        solid = workspace.solid[m]
        total = 0.0
        for c in range(3):
            total += abs(solid.position[c, i])
            total += abs(solid.momentum[c, i]) + abs(solid.angular_momentum[c, i])
        if not total < LARGEST:
            return m + 1
    return 0


@cached_by_features
def make_write_back(features: Features):
    """Stage that stores lanes into their worlds: diverged ones at once, all after the frame."""
    write_rows, end_call = make_write_rows(features), make_end_call(features)
    clear_rest, store_servos = make_clear_rest(features), make_store_servos(features)

    @stage
    def write_back(model, state, workspace, table, g, elapsed, last):
        lane = workspace.lane[0]
        for i in range(LANES):
            if lane.active[i]:
                diverged = first_diverged(model, workspace, i)
                if last or diverged != 0:
                    w = lane.world[i]
                    store(model, state, workspace, i, lane.start[i] + elapsed)
                    store_servos(model, state, workspace, i)
                    write_rows(model, state, w, i, table)
                    state.world[w].needs_refresh = end_call(model, workspace, i)
                    state.world[w].diverged = diverged
                    lane.active[i] = 0
                    if diverged != 0:
                        lane.updates_memory[i] = 0
                        clear_rest(model, state, workspace, g, i)

    return write_back


@factory
def make_advance(features: Features):
    """Entry point: advances the chosen worlds of groups first <= g < last by substeps * h s.

    It writes their rows of the readout table, and returns how many of them have diverged or run out
    of room for candidates. Every world runs the same instructions in its own lane, so its result is
    bitwise the same whatever the other lanes hold and however groups are distributed over threads.
    """
    constants, forget = make_constants(features), make_forget(features)
    trials = features.integrator == RK4
    substep = make_runge_kutta_substep(features) if trials else make_controlled_substep(features)
    write_back, load_servos = make_write_back(features), make_load_servos(features)

    @large_entry
    def advance(
        all_model, state, workspace, table, chosen, first, last, h, substeps, collision_substeps
    ):
        state, workspace = bundle(state), bundle(workspace)
        for g in range(first, last):
            model = bundle(constants(all_model, g))
            if load(model, state, workspace, chosen, g) == 0:
                continue
            load_servos(model, state, workspace)
            # for every group: one that diverged must not affect the next
            write_static_frames(model, workspace)
            write_drive_frames(model, workspace)
            lane, needs_refresh = workspace.lane[0], 0
            for i in range(LANES):
                needs_refresh += lane.needs_refresh[i]
            for i in range(LANES):
                if lane.active[i]:
                    state.world[lane.world[i]].overflow = 0
            # States that were set from outside have no forces yet, so their first step begins with
            # a refresh. It shares the call of `substep`, which would otherwise be compiled twice
            refresh = (BEGINS if substeps > 0 else QUERY) if needs_refresh > 0 else 0
            if refresh:
                forget(model, state, workspace, g)
            done = 0
            while True:
                left = min(collision_substeps, substeps - done)
                starts_collision_step = done > 0
                for _s in range(left + (1 if refresh else 0)):
                    done += 0 if refresh else 1
                    substep(model, state, workspace, g, h, done * h, starts_collision_step, refresh)
                    starts_collision_step, refresh = False, 0
                write_back(model, state, workspace, table, g, done * h, done == substeps)
                if done == substeps:
                    break
        failed = 0
        for place in range(first * LANES, last * LANES):
            w = state.resident[place]
            if w >= 0 and chosen[w]:
                status = state.world[w]
                failed += 1 if status.diverged != 0 or status.overflow != 0 else 0
        return failed

    return advance
