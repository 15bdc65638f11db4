"""Substeps of one world of many bodies with the impulse law, by several threads.

The steps of `impulse.solver`, but swept colour by colour. Those pairs that found no colour are
solved one after the other.
"""

from physics.compiler.bundles import bundle
from physics.compiler.jit import factory, large_entry, stage
from physics.manybody.blocks import (
    add_contacts,
    blocks_of,
    change_velocities,
    make_end_step,
    make_hold_joints,
    make_known_forces,
    make_place_group,
    write_tensors,
)
from physics.manybody.colours import make_by_colour
from physics.manybody.couplings import make_begin_joints, make_end_joints, make_keep_joints
from physics.manybody.impact_paths import (
    count_batch_impulses,
    make_advance_bodies,
    make_choose_pairs,
    make_leave_impact,
)
from physics.manybody.impact_steps import advance_velocities, make_collide
from physics.manybody.impulse_batches import (
    GUESS,
    RIGID,
    SOFT,
    make_finish_batch,
    make_list_contacts,
    make_prepare_batch,
    make_solve_batch,
)
from physics.manybody.spring_steps import REFRESH, RESUME, STEP
from physics.manybody.tables import IMPACTS
from physics.manybody.team import Team, share, takes_batch, wait
from physics.model.features import EULER, Features
from physics.model.state import STARTS_ANEW
from physics.model.workspace import GIVEN

# what a call continues with, besides those of the spring law: there is room for all contact rows;
# and, with time control, the way through a substep
ROWS, PATH = 3, 4
# for what there weren't enough rows, if not for a substep: a refresh, an impact within a substep
_OF_REFRESH, _OF_IMPACT = 1, 2


@stage
def place_rows(crowd, pairs):
    """Gives each batch its contact rows; returns how many there are."""
    count = 0
    for n in range(crowd.order.shape[0]):
        b = crowd.order[n]
        pairs.first_row[b] = count
        count += pairs.row_count[b] if pairs.busy[b] != 0 else 0
    return count


@factory
def make_impulse_steps(features: Features):
    """Entry point: as `make_spring_steps`, with contact rows that all threads share."""
    advance_bodies, place_group = make_advance_bodies(features), make_place_group(features)
    timed, leave_impact = features.finds_impacts, make_leave_impact(features)
    choose_pairs = make_choose_pairs(features)
    known_forces, hold_joints = make_known_forces(features), make_hold_joints(features)
    list_contacts, prepare_batch = make_list_contacts(features), make_prepare_batch(features)
    collide = make_collide(features)
    solve = make_by_colour(features, make_solve_batch(features))
    begin_joints, keep_joints = make_begin_joints(features), make_keep_joints(features)
    end_joints = make_end_joints(features)
    finish_batch, end_step = make_finish_batch(features), make_end_step(features)
    before, lag = (1.0, 0.0) if features.integrator == EULER else (0.5, 0.5)

    @large_entry
    def impulse_steps(
        model, state, workspace, rows, crowd, pairs, h, substeps, collision_substeps, progress,
        barrier, shared, thread, threads,
    ):  # fmt: skip
        """`rows`: of CONTACT_ROW; all else as `spring_steps`.

        progress[2] is 2 where there are not enough rows, and progress[3] says how many it takes.
        """
        model, state, workspace = bundle(model), bundle(state), bundle(workspace)
        crowd, pairs = bundle(crowd), bundle(pairs)
        team, batches = Team(barrier, shared, thread, threads), crowd.order.shape[0]
        first, last = share(0, crowd.group.shape[0], team)
        done, phase, stamp = progress[0], progress[1], progress[4]
        wait(team)  # before any thread writes the progress
        while done < substeps or phase != STEP:
            refresh = phase == REFRESH or (phase == ROWS and progress[5] == _OF_REFRESH)
            meets = phase == ROWS and progress[5] == _OF_IMPACT
            if phase in (STEP, PATH):
                far, meets = advance_bodies(
                    model, workspace, crowd, pairs, before * h, h, phase == STEP, team
                )
                if far > 0:
                    if thread == 0:
                        progress[0], progress[1], progress[2] = done, PATH if timed else RESUME, 1
                        progress[4] = stamp
                    return
            elif phase == REFRESH:
                for g in range(first, last):
                    place_group(model, workspace, crowd, g)
                wait(team)
                for n in range(batches):
                    if timed and takes_batch(n, team):
                        choose_pairs(model, workspace, crowd, pairs, crowd.order[n], h, True)
            lagging = 0.0 if refresh or meets else lag * h
            span, drifted = (before * h, 0.0) if refresh else (h, h)
            elapsed = done * h + drifted
            remembers = not refresh or progress[6] == STARTS_ANEW
            starts = not (refresh or meets) and done > 0 and done % collision_substeps == 0
            if phase != ROWS:
                for n in range(batches):
                    if takes_batch(n, team):
                        b = crowd.order[n]
                        list_contacts(model, state, workspace, crowd, pairs, b, starts, meets)
                for g in range(first, last):
                    if not meets:
                        known_forces(model, workspace, crowd, g, drifted)
                        hold_joints(model, state, workspace, crowd, g, h, drifted)
                    for m in blocks_of(crowd, g):
                        write_tensors(crowd, m)
            whole = -1 if meets or crowd.path[IMPACTS] > 0.0 else 1 if drifted > 0.0 else 0
            wait(team)
            if thread == 0:
                progress[3] = place_rows(crowd, pairs)
            wait(team)
            if progress[3] > rows.shape[0]:
                wait(team)
                if thread == 0:
                    progress[0], progress[1], progress[2] = done, ROWS, 2
                    progress[4], progress[5] = stamp, _OF_IMPACT if meets else int(refresh)
                return
            for n in range(batches):
                b = crowd.order[n]
                if takes_batch(n, team) and pairs.busy[b] != 0:
                    prepare_batch(
                        model, state, workspace, rows, crowd, pairs, b, span, remembers, meets,
                        whole,
                    )  # fmt: skip
            wait(team)
            stamp, collided = collide(
                model, workspace, rows, crowd, pairs, span, drifted == 0.0, lagging, lagging / h,
                team, stamp,
            )  # fmt: skip
            if collided:
                end_joints(model, workspace, crowd, span if refresh else 0.0, team)
            for g in range(first, last):
                for m in blocks_of(crowd, g):
                    solid = crowd.solid[m]
                    if timed and refresh:
                        solid = crowd.kept[GIVEN, m]
                    if collided and (timed or not refresh):
                        add_contacts(crowd, pairs, m, solid.momentum, solid.angular_momentum)
                    change_velocities(crowd, m, -lagging)
            wait(team)
            if timed and meets:
                began = state.world[0].time + done * h
                leave_impact(model, workspace, rows, crowd, pairs, h, began, collided, team)
                phase = PATH
                continue
            for operation in (RIGID, GUESS, SOFT):
                if operation == GUESS:
                    advance_velocities(crowd, span, team)
                clears, motor_time = operation == RIGID, 0.0 if operation == RIGID else span
                if operation != SOFT:
                    begin_joints(model, workspace, crowd, clears, not clears, motor_time, team)
                solve(model, workspace, rows, crowd, pairs, team, (span, operation))
                if operation != GUESS:
                    keep_joints(model, workspace, crowd, pairs, -1, motor_time, team)
            end_joints(model, workspace, crowd, span, team)
            for n in range(batches):
                b = crowd.order[n]
                if takes_batch(n, team) and pairs.busy[b] != 0:
                    finish_batch(
                        model, state, workspace, rows, crowd, pairs, b, span, elapsed, remembers
                    )
            if timed and not refresh:
                for n in range(batches):
                    if takes_batch(n, team):
                        count_batch_impulses(model, workspace, crowd, pairs, crowd.order[n], h)
            wait(team)
            for g in range(first, last):
                for m in blocks_of(crowd, g):
                    add_contacts(crowd, pairs, m, crowd.solid[m].force, crowd.solid[m].torque)
                end_step(model, workspace, crowd, g, drifted, (1.0 - before) * drifted)
            done += 0 if refresh else 1
            phase = STEP
        wait(team)
        if thread == 0:
            progress[0], progress[1], progress[2], progress[4] = done, STEP, 0, stamp

    return impulse_steps
