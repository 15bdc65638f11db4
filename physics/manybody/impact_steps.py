"""Instantaneous collisions in one world of many bodies, by several threads.

The steps of `impulse.restitution`, swept colour by colour. Collisions are local: only pairs with a
body whose velocity a collision has changed take part, while in worlds side by side all contacts of
a world do. The energy that restitution may return is that of the whole world's collisions in a
substep, with the largest restitution among them.
"""

import math

from physics.compiler.jit import LANES, sequence, stage
from physics.impulse.restitution import MAX_SWEEPS
from physics.manybody.colours import make_by_colour
from physics.manybody.couplings import make_begin_joints, make_keep_joints
from physics.manybody.impulse_batches import (
    make_book_impacts,
    make_find_batch_impacts,
    make_impact_batch,
    make_push_out_batch,
    make_restitution_batch,
    stir,
)
from physics.manybody.team import (
    CHANGED,
    COLLIDING,
    FASTEST,
    RESTITUTION,
    WORK,
    largest,
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


@cached_by_features
def make_find(features):
    """Sequence that finds the colliding pairs, and stirs their bodies; returns how many there are.

    `lags`: with velocities of half a substep ago.
    """
    find_batch_impacts = make_find_batch_impacts(features)

    @sequence
    def find(model, workspace, rows, crowd, pairs, h, team, stamp, lags):
        mine = team.shared[team.thread]
        mine[FASTEST], mine[RESTITUTION], mine[COLLIDING] = 0.0, 0.0, 0.0
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if takes_batch(n, team) and pairs.busy[b] != 0:
                mine[COLLIDING] += find_batch_impacts(
                    model, workspace, rows, crowd, pairs, b, h, mine, lags
                )
                for i in range(LANES):
                    if pairs.colliding[b, i] != 0:
                        stir(crowd, pairs.first[b, i], stamp)
                        stir(crowd, pairs.second[b, i], stamp)
        return total(team, COLLIDING)

    return find


@cached_by_features
def make_collide(features):
    """Sequence of all instantaneous collisions of a substep."""
    find, book_impacts = make_find(features), make_book_impacts(features)
    push_out = make_by_colour(features, make_push_out_batch(features))
    sweep = make_by_colour(features, make_impact_batch(features))
    restitute = make_by_colour(features, make_restitution_batch(features))
    begin_joints, keep_joints = make_begin_joints(features), make_keep_joints(features)

    @sequence
    def solve(model, workspace, rows, crowd, pairs, fastest, after, team, stamp):
        """Sweeps until no velocity changes; only pairs with a body that the last sweep changed."""
        for _ in range(MAX_SWEEPS):
            options = (stamp, stamp + 1, after, fastest)
            team.shared[team.thread, CHANGED] = sweep(
                model, workspace, rows, crowd, pairs, team, options
            )
            stamp += 1
            keep_joints(model, workspace, crowd, pairs, stamp, 0.0, team)
            if total(team, CHANGED) == 0.0:
                break
        return stamp

    @sequence
    def collide(model, workspace, rows, crowd, pairs, h, refresh, team, stamp):
        """Returns the last stamp, and whether anything has collided."""
        # each stage is called in one place: two calls would be compiled twice
        for attempt in range(2):
            stamp += 1
            if find(model, workspace, rows, crowd, pairs, h, team, stamp, False) == 0.0:
                return stamp, False
            if attempt == 0:
                push_out(model, workspace, rows, crowd, pairs, team, (stamp,))
        begin_joints(model, workspace, crowd, True, True, 0.0, team)
        fastest, e = largest(team, FASTEST), largest(team, RESTITUTION)
        for after in range(2):
            stamp = solve(model, workspace, rows, crowd, pairs, fastest, after == 1, team, stamp)
            if after == 1:
                break
            allowed, scale = e * e * max(-all_work(crowd, pairs, team), 0.0), 1.0
            stamp += 1
            for rescale in range(2):
                options = (rescale == 1, scale, stamp)
                restitute(model, workspace, rows, crowd, pairs, team, options)
                keep_joints(model, workspace, crowd, pairs, stamp, 0.0, team)
                gained = all_work(crowd, pairs, team)
                scale = math.sqrt(allowed / gained) if gained > allowed else 1.0
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if takes_batch(n, team) and pairs.busy[b] != 0:
                book_impacts(model, workspace, rows, crowd, pairs, b, refresh)
        wait(team)
        return stamp, True

    return collide
