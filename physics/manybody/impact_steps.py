"""Instantaneous collisions in one world of many bodies, by several threads.

The steps of `impulse.restitution`, swept colour by colour. Collisions are local: only pairs with a
body whose velocity a collision has changed take part, while in worlds side by side all contacts of
a world do. The energy that restitution may return is that of the whole world's collisions in a
substep, with the largest restitution among them.
"""

from physics.compiler.jit import LANES, sequence, stage
from physics.impulse.restitution import MAX_SWEEPS, allowed_fraction
from physics.manybody.blocks import blocks_of, change_velocities
from physics.manybody.colours import make_by_colour
from physics.manybody.couplings import make_begin_joints, make_keep_joints
from physics.manybody.impact_batches import (
    ADD_HALVES,
    ADD_WORK,
    DONE,
    FIND,
    LOOK_BACK,
    REMOVE_HALVES,
    REMOVE_PUSH_OUT,
    RESTITUTE,
    SCALE,
    SWEEP,
    make_book_impacts,
    make_find_batch_impacts,
    make_impact_batch,
    stir,
)
from physics.manybody.team import (
    CHANGED,
    COLLIDING,
    FASTEST,
    RESTITUTION,
    WORK,
    largest,
    share,
    takes_batch,
    total,
    wait,
)
from physics.model.features import cached_by_features


@stage
def all_work(crowd, pairs, team):
    """J of all impact impulses since it was last asked for, in a fixed order."""
    wait(team)
    if team.thread == 0:
        work = 0.0
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if pairs.busy[b] != 0:
                for i in range(LANES):
                    work += pairs.impact_work[b, i]
                    pairs.impact_work[b, i] = 0.0
        for g in range(crowd.group.shape[0]):
            work += crowd.joint_work[g]
            crowd.joint_work[g] = 0.0
        team.shared[0, WORK] = work
    wait(team)
    return team.shared[0, WORK]


@stage
def advance_velocities(crowd, time, team):
    """Lets known forces change the velocities of all bodies for a time in s."""
    first, last = share(0, crowd.group.shape[0], team)
    for g in range(first, last):
        for m in blocks_of(crowd, g):
            change_velocities(crowd, m, time)
    wait(team)


@cached_by_features
def make_find(features):
    """Sequence that finds the colliding pairs, and stirs their bodies; returns how many there are.

    `lags`: with velocities of half a substep ago; `part`: see `restitution.make_find_impacts`.
    """
    find_batch_impacts = make_find_batch_impacts(features)

    @sequence
    def find(model, workspace, rows, crowd, pairs, h, team, stamp, lags, part):
        mine = team.shared[team.thread]
        mine[FASTEST], mine[COLLIDING] = 0.0, 0.0
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if takes_batch(n, team) and pairs.busy[b] != 0:
                mine[COLLIDING] += find_batch_impacts(
                    model, workspace, rows, crowd, pairs, b, h, mine, lags, part
                )
                for i in range(LANES):
                    if pairs.colliding[b, i] != 0:
                        stir(crowd, pairs.first[b, i], stamp)
                        stir(crowd, pairs.second[b, i], stamp)
        return total(team, COLLIDING)

    return find


@cached_by_features
def make_collide(features):
    """Sequence of all instantaneous collisions of a substep.

    Velocities are half a step old; bodies collide with the present ones. What collides is found,
    and what of it still does without the push apart. It is compressed, gets restitution, and gives
    back what that returned too much. These operations follow each other in a loop that calls each
    stage in one place, because each further call would be compiled again.
    """
    find, book_impacts = make_find(features), make_book_impacts(features)
    change = make_by_colour(features, make_impact_batch(features))
    begin_joints, keep_joints = make_begin_joints(features), make_keep_joints(features)
    joints = features.joints

    @sequence
    def collide(model, workspace, rows, crowd, pairs, h, refresh, lag, part, team, stamp):
        """Returns the last stamp, and whether anything has collided.

        `lag`: s by which velocities are old, which they lose here; `part`: that of the step.
        """
        mine, sweeps, compression, work, allowed = team.shared[team.thread], 0, 0.0, 0.0, 0.0
        mine[RESTITUTION] = 0.0
        begun, collided, restored = False, False, False
        first = ADD_HALVES if part > 0.0 else REMOVE_PUSH_OUT
        last = REMOVE_HALVES if part > 0.0 else DONE
        operation, value = LOOK_BACK if joints else FIND, part
        while operation != DONE:
            if operation in (LOOK_BACK, FIND):
                looks_back, left = operation == LOOK_BACK, 0.0 if operation == LOOK_BACK else value
                if operation == FIND:
                    stamp += 1
                    if not begun:
                        advance_velocities(crowd, lag, team)
                collides = find(
                    model, workspace, rows, crowd, pairs, h, team, stamp, looks_back, left
                )
                if looks_back:  # see `restitution.make_find_impacts`
                    operation = FIND
                elif not begun:
                    begun, operation = True, first if collides > 0.0 else DONE
                elif collides > 0.0:
                    begin_joints(model, workspace, crowd, True, True, 0.0, team)
                    collided, operation, value = True, SWEEP, largest(team, FASTEST)
                else:
                    operation = last
                continue
            options = (operation, part if operation == REMOVE_HALVES else value, stamp, mine)
            mine[CHANGED] = change(model, workspace, rows, crowd, pairs, team, options)
            if operation in (SWEEP, RESTITUTE, SCALE):
                stamp += 1
                keep_joints(model, workspace, crowd, pairs, stamp, 0.0, team)
            if operation == ADD_HALVES:
                operation = REMOVE_PUSH_OUT
            elif operation == REMOVE_PUSH_OUT:
                operation, value = FIND, 0.0
            elif operation == SWEEP:
                sweeps += 1
                if total(team, CHANGED) > 0.0 and sweeps < MAX_SWEEPS:
                    continue
                work = all_work(crowd, pairs, team)
                if restored:
                    e = largest(team, RESTITUTION)
                    allowed = e * e * max(-compression, 0.0)
                    operation = ADD_WORK if work > allowed else last
                else:
                    operation, restored, compression, sweeps = RESTITUTE, True, work, 0
            elif operation == RESTITUTE:
                operation = SWEEP
            elif operation == ADD_WORK:
                value = allowed_fraction(work, all_work(crowd, pairs, team), allowed)
                operation = SCALE
            elif operation == SCALE:
                operation = last
            else:
                operation = DONE
        if collided:
            for n in range(crowd.order.shape[0]):
                b = crowd.order[n]
                if takes_batch(n, team) and pairs.busy[b] != 0:
                    book_impacts(model, workspace, rows, crowd, pairs, b, refresh)
            wait(team)
        return stamp, collided

    return collide
