"""Substeps that are cut at the times of impacts: bisection, advancement, swept.

The first half kick is that of every substep. Then each lane in which solids may touch follows its
own path (`impact_times.py`). Where it arrives at an impact, the lane group's contact law resolves
it at the present velocities, `impulse/restitution.py`, while lanes without one wait. Then the rest
of the path follows, until the substep ends. Lanes without an impact drift as ever: their results
are those of fixed steps. Forces of contacts at rest belong to whole substeps, so the length of a
part of the path has no influence on them.

A lane has at most MOST_IMPACTS times of impact per substep. After that its solids stay where they
are until the substep ends, while their momenta follow the forces: time is lost, but nothing passes
through anything.
"""

from physics.collision.broadphase import make_broadphase
from physics.collision.compound_frames import make_compound_frames
from physics.collision.contact_point import TOUCH_TOLERANCE
from physics.compiler.jit import LANES, at, sequence, stage
from physics.impulse.contact_rows import make_contact_rows
from physics.impulse.point_impulses import operands_of, rotate_inertia
from physics.impulse.restitution import make_impacts
from physics.integrators.drift import make_drift
from physics.integrators.kick import make_kick
from physics.model.features import SWEPT, cached_by_features
from physics.model.lanes import end_refresh
from physics.model.state import FIRST_POSITION
from physics.model.workspace import BEGINNING, END, FREE, GIVEN, HAS_MET, MAY_MEET, MEETS
from physics.motion.drives import make_finger_coupling
from physics.motion.kinematics import make_kinematics
from physics.step.impact_times import make_find_impact
from physics.step.lane_paths import (
    keep_pose,
    make_relative_speed,
    rest_since_search,
    restore_pose,
    shift_momenta,
)

# times of impact in a substep of one world, at most
MOST_IMPACTS = 256


@cached_by_features
def make_choose(features):
    """Stage that chooses the half-pairs of lane i whose impacts are found on the way."""
    swept = features.time_control == SWEPT
    relative_speed = make_relative_speed(features)

    @stage
    def choose(model, workspace, i, h):
        """Returns whether any of them may touch in this substep. What was chosen stays."""
        may_touch = False
        for k in range(model.half_pair.shape[0]):
            half_pair, live, timing = (
                model.half_pair[k],
                workspace.half_pair[k],
                workspace.timing[k],
            )
            o, s = half_pair.owner, half_pair.surface
            motion = h * relative_speed(model, workspace, k, i)
            if swept and not motion > at(half_pair.free_motion, i) and not timing.timed[i]:
                continue
            timing.timed[i] = 1
            F, G = workspace.solid[o].force, workspace.solid[s].force
            ma, mb = at(half_pair.owner_inverse_mass, i), at(half_pair.surface_inverse_mass, i)
            bend = 0.0
            for c in range(3):
                bend += abs(ma * F[c, i] - mb * G[c, i])
            bend *= h * h
            fast = motion + bend > h * at(half_pair.rest_speed, i)
            near = live.count[i] > 0 or motion + bend > live.remaining_skin[i]
            may_touch = may_touch or (fast and near)
        return may_touch

    return choose


@stage
def expect_impacts(model, workspace, ends):
    """Sets what counts as a touch: at the end of the substep, or in the lanes at an impact."""
    phase = workspace.clock[0].phase
    for k in range(model.half_pair.shape[0]):
        timing, tolerance = workspace.timing[k], model.half_pair[k].impact_tolerance
        for i in range(LANES):
            timed = (not ends) or timing.timed[i] != 0
            # without times of impact samples collide up to half a step early
            timing.horizon[i] = 0.0 if timed else 0.5
            reach = tolerance + TOUCH_TOLERANCE if timed else TOUCH_TOLERANCE
            timing.reach[i] = reach if ends or phase[i] == MEETS else -1e300


@cached_by_features
def make_begin(features):
    """Stage that chooses half-pairs in all lanes, at the beginning of a substep or refresh."""
    choose = make_choose(features)

    @stage
    def begin(model, workspace, h, refresh):
        clock, lane, count = workspace.clock[0], workspace.lane[0], 0
        for k in range(model.half_pair.shape[0]):
            for i in range(LANES):
                workspace.timing[k].timed[i] = 0
                workspace.timing[k].impulse[i] = 0.0
        for i in range(LANES):
            clock.active[i] = lane.active[i]
            clock.phase[i] = FREE
            clock.time[i] = 0.0
            clock.impacts[i] = 0
            if lane.active[i] and choose(model, workspace, i, h) and not refresh:
                clock.phase[i] = MAY_MEET
                count += 1
        expect_impacts(model, workspace, True)
        return count

    return begin


@stage
def forget_given(model, workspace, h):
    """Takes the collisions of a refresh out of the forces: the half kick has applied them."""
    for m in range(model.dynamic.shape[0]):
        solid, given = workspace.solid[m], workspace.kept[GIVEN, m]
        for c in range(3):
            for i in range(LANES):
                solid.force[c, i] -= given.momentum[c, i] * (2.0 / h)
                solid.torque[c, i] -= given.angular_momentum[c, i] * (2.0 / h)


@stage
def clear_given(model, workspace, i):
    """Clears them in lane i."""
    for m in range(model.dynamic.shape[0]):
        given = workspace.kept[GIVEN, m]
        for c in range(3):
            given.momentum[c, i] = 0.0
            given.angular_momentum[c, i] = 0.0


@cached_by_features
def make_follow(features):
    """Stage that follows the paths of lanes up to their next impacts; returns how many have one."""
    find_impact, choose = make_find_impact(features), make_choose(features)

    @stage
    def follow(model, workspace, h):
        clock, lane, meeting = workspace.clock[0], workspace.lane[0], 0
        for i in range(LANES):
            phase = clock.phase[i]
            if phase == MEETS:  # and has just collided
                shift_momenta(model, workspace, i, 0.5 * h - clock.time[i])
                clock.impacts[i] += 1
                choose(model, workspace, i, h)
            elif phase == MAY_MEET:
                keep_pose(model, workspace, BEGINNING, i)
            else:
                continue
            rest_since_search(model, workspace, i)
            time, meets = clock.time[i], False
            if clock.impacts[i] < MOST_IMPACTS:
                again = phase == MEETS and lane.colliding[i] == 0
                time, meets = find_impact(model, workspace, i, time, h, again)
            clock.time[i] = time
            if meets:
                clock.phase[i] = MEETS
                shift_momenta(model, workspace, i, time - 0.5 * h)
                meeting += 1
            elif phase == MEETS:
                clock.phase[i] = HAS_MET
                keep_pose(model, workspace, END, i)
                rest_since_search(model, workspace, i)
            else:
                clock.phase[i] = FREE
                restore_pose(model, workspace, BEGINNING, i)
                rest_since_search(model, workspace, i)
        for i in range(LANES):
            waits = meeting > 0 and clock.phase[i] != MEETS
            lane.active[i] = 0 if waits else clock.active[i]
            lane.updates_memory[i] = lane.active[i]
            if clock.phase[i] == FREE and meeting > 0:
                rest_since_search(model, workspace, i)
        return meeting

    return follow


@stage
def arrive(model, workspace):
    """After the drift of all lanes: those that had impacts end where their paths ended."""
    for i in range(LANES):
        if workspace.clock[0].phase[i] == HAS_MET:
            restore_pose(model, workspace, END, i)


@stage
def record_impacts(model, state, workspace, g, h, elapsed):
    """Notes the impulses of the collisions on the way, and first contacts."""
    clock, lane = workspace.clock[0], workspace.lane[0]
    for k in range(model.half_pair.shape[0]):
        half_pair, live = model.half_pair[k], workspace.half_pair[k]
        points = operands_of(model, workspace, k).points
        first = workspace.solid[min(half_pair.owner, half_pair.surface)].position
        for i in range(LANES):
            if clock.phase[i] != MEETS:
                continue
            impulse = 0.0
            for n in range(points.shape[0]):
                impulse += points[n].normal_impact[i]
            workspace.timing[k].impulse[i] += impulse
            time = lane.start[i] + (elapsed - h + clock.time[i])
            if impulse > 0.0 and not live.first_touch[i] <= time:
                live.first_touch[i] = time
                for c in range(3):
                    state.touch[k, FIRST_POSITION + c, lane.world[i]] = first[c, i]


@cached_by_features
def make_collide(features):
    """Stage that resolves the collisions in the lanes that are at an impact."""
    contact_rows, impacts = make_contact_rows(features), make_impacts(features)
    couple_fingers = make_finger_coupling(features)

    @stage
    def collide(model, state, workspace, g, h, elapsed):
        expect_impacts(model, workspace, False)
        rotate_inertia(model, workspace)
        for i in range(LANES):
            workspace.lane[0].colliding[i] = 0
            workspace.lane[0].drifted[i] = -1
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                contact_rows(model, state, workspace, g, k, workspace.lane[0].updates_memory, h)
        impacts(model, workspace, h, False, 0.0)
        couple_fingers(model, workspace, h)
        record_impacts(model, state, workspace, g, h, elapsed)
        expect_impacts(model, workspace, True)

    return collide


@stage
def count_impulses(model, workspace, h):
    """Adds the collisions on the way to the mean normal forces of the substep."""
    for k in range(model.half_pair.shape[0]):
        live, impulse = workspace.half_pair[k], workspace.timing[k].impulse
        for i in range(LANES):
            live.previous_normal_force[i] += impulse[i] / h


@cached_by_features
def make_event_substep(features, make_forces):
    """Sequence of one substep that is cut at impacts, with the arguments of `make_substep`'s."""
    kick, drift = make_kick(features), make_drift(features)
    kinematics, compound_frames = make_kinematics(features), make_compound_frames(features)
    broadphase, forces = make_broadphase(features), make_forces(features)
    begin, follow, collide = make_begin(features), make_follow(features), make_collide(features)

    @sequence
    def substep(model, state, workspace, g, h, elapsed, starts_collision_step, refresh):
        if not refresh:
            kick(model, workspace, 0.5 * h)
            forget_given(model, workspace, h)
        for i in range(LANES):
            clear_given(model, workspace, i)
        meeting = begin(model, workspace, h, refresh)
        while True:
            if meeting > 0:
                meeting = follow(model, workspace, h)
            last = meeting == 0
            if last and not refresh:
                drift(model, workspace, h)
                arrive(model, workspace)
            kinematics(model, workspace)
            compound_frames(model, workspace)
            broadphase(model, state, workspace, g, starts_collision_step and last)
            if last:
                break
            collide(model, state, workspace, g, h, elapsed)
        span, drifted = (0.5 * h, 0.0) if refresh else (h, h)
        forces(model, state, workspace, g, h, span, drifted, elapsed)
        if refresh:
            for i in range(LANES):
                if workspace.lane[0].needs_refresh[i] == 0:  # the refresh passed it by
                    clear_given(model, workspace, i)
            end_refresh(model, state, workspace)
        else:
            count_impulses(model, workspace, h)
            kick(model, workspace, 0.5 * h)

    return substep
