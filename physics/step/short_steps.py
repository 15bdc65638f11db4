"""Substeps that are halved where solids are fast: time control "adaptive".

A world's substep h is divided into steps of h / 2^n with the smallest n at which no two solids move
relative to each other further than `HALF_PAIR.free_motion` and two thirds of the gap between them:
a Courant condition. It is evaluated before each of them; steps grow again where time is a multiple
of the longer one, so that all worlds meet at the end of the substep.

Worlds that need no halving take one step together, as with fixed steps. The others take turns,
while the rest of the lane group waits. The impulse law's forces belong to the length of a step:
where it changes, they are computed again.
"""

from physics.compiler.jit import LANES, at, sequence, stage
from physics.model.features import cached_by_features
from physics.model.state import BEGINS, NEW_FORCES
from physics.model.workspace import BEGINNING
from physics.step.lane_paths import copy_pose, make_relative_speed, rest_since_search

# halvings of a substep, at most: a million steps
MOST_HALVINGS = 20


@cached_by_features
def make_halvings(features):
    """Stage: how often the substep must be halved in lane i at the present velocities."""
    relative_speed = make_relative_speed(features)

    @stage
    def halvings(model, workspace, i, h):
        longest = 1.0  # of the step, in substeps
        for k in range(model.half_pair.shape[0]):
            half_pair, live = model.half_pair[k], workspace.half_pair[k]
            motion = h * relative_speed(model, workspace, k, i)
            allowed = at(half_pair.free_motion, i)
            if live.count[i] == 0:
                # samples collide up to half a step early; a third of the gap stays for that
                allowed += 2 * max(live.remaining_skin[i], 0.0) / 3
            if longest * motion > allowed:
                longest = allowed / motion
        n, part = 0, 1.0
        while part > longest and n < MOST_HALVINGS:
            n += 1
            part *= 0.5
        return n

    return halvings


@stage
def copy_moving(source, target, i):
    """Copies in lane i what a step changes of a solid."""
    copy_pose(source, target, i)
    for c in range(3):
        target.momentum[c, i] = source.momentum[c, i]
        target.angular_momentum[c, i] = source.angular_momentum[c, i]
        target.force[c, i] = source.force[c, i]
        target.torque[c, i] = source.torque[c, i]
        target.reference[c, i] = source.reference[c, i]
    target.reference_time[i] = source.reference_time[i]


@stage
def let_wait(model, workspace, turn):
    """Only the lanes of a turn stay active: all without halvings at -1, else that lane."""
    clock, lane = workspace.clock[0], workspace.lane[0]
    for i in range(LANES):
        waits = (clock.halvings[i] > 0) if turn < 0 else i != turn
        lane.active[i] = 0 if waits else clock.active[i]
        lane.updates_memory[i] = 0 if waits else clock.updates_memory[i]
        if waits:
            for m in range(model.dynamic.shape[0]):
                copy_moving(workspace.solid[m], workspace.kept[BEGINNING, m], i)
            for k in range(model.half_pair.shape[0]):
                workspace.timing[k].waiting_skin[i] = workspace.half_pair[k].remaining_skin[i]


@stage
def end_wait(model, workspace, turn):
    """The lanes that waited continue from where they were."""
    clock, lane = workspace.clock[0], workspace.lane[0]
    for i in range(LANES):
        waited = (clock.halvings[i] > 0) if turn < 0 else i != turn
        if waited:
            for m in range(model.dynamic.shape[0]):
                copy_moving(workspace.kept[BEGINNING, m], workspace.solid[m], i)
            for k in range(model.half_pair.shape[0]):
                workspace.half_pair[k].remaining_skin[i] = workspace.timing[k].waiting_skin[i]
        lane.active[i] = clock.active[i]
        lane.updates_memory[i] = clock.updates_memory[i]


@cached_by_features
def make_short_substep(features, make_substep):
    """Sequence of one substep, with the arguments of `make_substep`'s."""
    impulse, step, halvings = features.impulse, make_substep(features), make_halvings(features)

    @stage
    def halve(model, workspace, h):
        """Number of lanes that take a turn of their own, and of those that don't."""
        clock, lane, own, common = workspace.clock[0], workspace.lane[0], 0, 0
        for i in range(LANES):
            clock.active[i] = lane.active[i]
            clock.updates_memory[i] = lane.updates_memory[i]
            clock.halvings[i] = 0
            if lane.active[i]:
                n = halvings(model, workspace, i, h)
                # a lane whose forces must be computed again takes a turn, too
                clock.halvings[i] = n + 1 if n > 0 or clock.stale[i] else 0
                own += 1 if clock.halvings[i] > 0 else 0
                common += 0 if clock.halvings[i] > 0 else 1
        return own, common

    @sequence
    def substep(model, state, workspace, g, h, elapsed, starts_collision_step, refresh):
        clock, lane = workspace.clock[0], workspace.lane[0]
        own, common = halve(model, workspace, h)
        for turn in range(-1, LANES if own > 0 else 0):
            if (turn < 0 and common == 0) or (turn >= 0 and clock.halvings[turn] == 0):
                continue
            if own > 0:
                let_wait(model, workspace, turn)
            # the present step is the part 1/parts of the substep; `done` of them are over
            parts, done, before, refreshes = 1, 0, 0, False
            if turn >= 0:
                before = -1 if clock.stale[turn] else 1
            while done < parts:
                if turn >= 0 and not refreshes:
                    needed = 1 << halvings(model, workspace, turn, h)
                    while parts < needed:
                        parts, done = 2 * parts, 2 * done
                    while parts > needed and done % 2 == 0:
                        parts, done = parts // 2, done // 2
                    # the forces of another length of step: once again, then the step itself
                    refreshes = impulse and parts != before and not refresh
                    before = parts
                else:
                    refreshes = False
                if refreshes:
                    rest_since_search(model, workspace, turn)
                    lane.needs_refresh[turn] = NEW_FORCES
                span = h / parts
                done += 0 if refreshes else 1
                time = elapsed if turn < 0 or refresh else elapsed - h + done * span
                starts = starts_collision_step and done <= 1
                step(
                    model, state, workspace, g, span, time, starts, BEGINS if refreshes else refresh
                )
                if refresh:  # evaluates the forces of one step
                    break
            if turn >= 0 and not (refresh and lane.needs_refresh[turn] == 0):
                clock.stale[turn] = 1 if impulse and parts > 1 else 0
            if own > 0:
                end_wait(model, workspace, turn)
        if refresh:
            for i in range(LANES):
                lane.updates_memory[i] = lane.active[i]

    return substep
