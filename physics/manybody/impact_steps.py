"""Instantaneous collisions in one world of many bodies, by several threads.

The steps of `impulse.restitution`, swept colour by colour. Collisions are local: only pairs with a
body whose velocity a collision has changed take part, while in worlds side by side all contacts of
a world do. The energy that restitution may return is that of the whole world's collisions in a
substep, with the largest restitution among them.
"""

from physics.compiler.jit import LANES, sequence, stage
from physics.impulse.restitution import MAX_SWEEPS, allowed_fraction
from physics.manybody.colours import make_by_colour
from physics.manybody.couplings import make_begin_joints, make_keep_joints
from physics.manybody.impact_batches import (
    make_book_impacts,
    make_end_work_batch,
    make_find_batch_impacts,
    make_half_impulse_batch,
    make_impact_batch,
    make_push_out_batch,
    make_restitution_batch,
    make_scale_batch,
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
    """Sequence of all instantaneous collisions of a substep."""
    find, book_impacts = make_find(features), make_book_impacts(features)
    half_impulses = make_by_colour(features, make_half_impulse_batch(features))
    push_out = make_by_colour(features, make_push_out_batch(features))
    sweep = make_by_colour(features, make_impact_batch(features))
    restitute = make_by_colour(features, make_restitution_batch(features))
    add_end_work = make_end_work_batch(features)
    scale_back = make_by_colour(features, make_scale_batch(features))
    begin_joints, keep_joints = make_begin_joints(features), make_keep_joints(features)

    @sequence
    def solve(model, workspace, rows, crowd, pairs, fastest, team, stamp):
        """Sweeps until no velocity changes; only pairs with a body that the last sweep changed."""
        for _ in range(MAX_SWEEPS):
            options = (stamp, stamp + 1, fastest)
            team.shared[team.thread, CHANGED] = sweep(
                model, workspace, rows, crowd, pairs, team, options
            )
            stamp += 1
            keep_joints(model, workspace, crowd, pairs, stamp, 0.0, team)
            if total(team, CHANGED) == 0.0:
                break
        return stamp

    @sequence
    def resolve(model, workspace, rows, crowd, pairs, refresh, team, stamp):
        """Compression and restitution of all that collides; returns the last stamp."""
        begin_joints(model, workspace, crowd, True, True, 0.0, team)
        fastest, mine, compression = largest(team, FASTEST), team.shared[team.thread], 0.0
        mine[RESTITUTION] = 0.0
        for part in range(2):
            if part == 1:
                compression = all_work(crowd, pairs, team)
                stamp += 1
                restitute(model, workspace, rows, crowd, pairs, team, (mine, stamp))
                keep_joints(model, workspace, crowd, pairs, stamp, 0.0, team)
            stamp = solve(model, workspace, rows, crowd, pairs, fastest, team, stamp)
        e, work = largest(team, RESTITUTION), all_work(crowd, pairs, team)
        allowed = e * e * max(-compression, 0.0)
        if work > allowed:
            for n in range(crowd.order.shape[0]):
                b = crowd.order[n]
                if takes_batch(n, team) and pairs.busy[b] != 0:
                    add_end_work(model, workspace, rows, crowd, pairs, b)
            scale = allowed_fraction(work, all_work(crowd, pairs, team), allowed)
            stamp += 1
            scale_back(model, workspace, rows, crowd, pairs, team, (scale, stamp))
            keep_joints(model, workspace, crowd, pairs, stamp, 0.0, team)
        for n in range(crowd.order.shape[0]):
            b = crowd.order[n]
            if takes_batch(n, team) and pairs.busy[b] != 0:
                book_impacts(model, workspace, rows, crowd, pairs, b, refresh)
        wait(team)
        return stamp

    @sequence
    def collide(model, workspace, rows, crowd, pairs, h, refresh, part, team, stamp):
        """Returns the last stamp, and whether anything has collided.

        `part`: see `restitution.make_find_impacts`.
        """
        collided = False
        # what collides, what still does without the push apart, and the end: each stage is called
        # in one place, because two calls would be compiled twice
        for attempt in range(3):
            if attempt < 2:
                stamp += 1
                left = part if attempt == 0 else 0.0
                if find(model, workspace, rows, crowd, pairs, h, team, stamp, False, left) == 0.0:
                    if attempt == 0:
                        return stamp, False
                elif attempt == 1:
                    stamp = resolve(model, workspace, rows, crowd, pairs, refresh, team, stamp)
                    collided = True
            if part > 0.0 and attempt != 1:
                options = (part, attempt)
                half_impulses(model, workspace, rows, crowd, pairs, team, options)
            if attempt == 0:
                push_out(model, workspace, rows, crowd, pairs, team, (stamp,))
        return stamp, collided

    return collide
