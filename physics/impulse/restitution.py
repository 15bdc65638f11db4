"""Instantaneous collisions with restitution, for any number of contacts at once.

Bodies collide with their present velocities: those of half a step ago, changed by the known forces
and by what pressed their contacts in the last step, without what the last step gave only to push
overlapping bodies apart. A contact collides if it approaches faster than at rest (`rest_speed`, see
`contact_rows`) and will touch by the middle of the coming drift. All contacts that touch take part,
so an impact on a stack is felt below it. Poisson's hypothesis, which unlike Newton's stays
consistent with several contacts:

1. compression: impulses p >= 0 that stop the approach of contacts that collide, and any further
   approach of those that only take part, with Coulomb friction, by sweeps of projected
   Gauss-Seidel. A correction never adds energy;
2. restitution: every contact applies e p again, all at once. With one e and without friction the
   velocities become u - e (u0 - u) with those u0 before and u after compression, -e u0 where a
   contact collides, and the energy returned is e^2 of what compression removed;
3. sweeps in which normal impulses only grow: no contact approaches, and friction follows the new
   normal impulses.

With friction, or several e, steps 2 and 3 could return more than e^2 of the energy that compression
removed (the largest e of the contacts that compression pressed). Then all impulses are taken back
towards those of compression. With the change p of all impulses since then, and the relative
velocities u before and u' after it, a fraction s of it does the work s p u + s^2 p (u' - u)/2,
which equals the limit for one s in 0 ... 1. In between friction stays within its cone, and nothing
approaches.

The lecture's v' = v + (eps/M) n with eps the restitution is a misprint: the factor is the impulse.
"""

import math

from physics.compiler.jit import LANES, sequence, stage
from physics.constraints.joint_velocities import (
    make_begin_hold,
    make_clear_hold,
    make_end_hold,
    make_hold,
)
from physics.impulse.impact_points import (
    add_half_impulses,
    make_find_impacts,
    make_impact_sweep,
    remove_push_out,
)
from physics.impulse.point_impulses import (
    add_opposite,
    apply_impulse,
    operands_of,
    relative_velocity,
)
from physics.model.features import cached_by_features
from physics.model.workspace import GIVEN
from physics.motion.drives import make_finger_velocity_coupling

# Sweeps end when none has changed a velocity by more than this fraction of the fastest approach
TOLERANCE = 1e-6
MAX_SWEEPS = 64


@stage
def apply_restitution(pair, lane):
    """Applies e times what compression gave, and notes the largest e of the points that it pressed.

    Also keeps the impulses of compression.
    """
    points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
    largest = lane.impact_restitution
    for n in range(points.shape[0]):
        point = points[n]
        for i in range(LANES):
            e, given = max(point.impact_restitution[i], 0.0), point.normal_impact[i]
            largest[i] = max(largest[i], e) if given > 0.0 else largest[i]
            point.compression[i] = given
            for axis in range(3):
                point.tangential_compression[axis, i] = point.tangential_impact[axis, i]
            step = e * given
            point.normal_impact[i] = given + step
            point.least_impact[i] = given + step
            nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
            ux, uy, uz = relative_velocity(owner, surface, point, i)
            un = ux * nx + uy * ny + uz * nz
            lane.impact_work[i] += step * (un + 0.5 * step / point.mass[i])
            apply_impulse(pair, point, i, step * nx, step * ny, step * nz)


@stage
def since_compression(point, i):
    """Impulse x y z in N s that a point was given since compression."""
    nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
    size = point.normal_impact[i] - point.compression[i]
    before, now = point.tangential_compression, point.tangential_impact
    return (
        size * nx + now[0, i] - before[0, i],
        size * ny + now[1, i] - before[1, i],
        size * nz + now[2, i] - before[2, i],
    )


@stage
def add_end_work(pair, lane):
    """Adds the impulses since compression times the relative velocities after them."""
    points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
    for n in range(points.shape[0]):
        point = points[n]
        for i in range(LANES):
            px, py, pz = since_compression(point, i)
            ux, uy, uz = relative_velocity(owner, surface, point, i)
            lane.end_work[i] += px * ux + py * uy + pz * uz


@stage
def allowed_fraction(work, end_work, allowed):
    """Fraction of the impulses since compression whose work is `allowed`; 1 if all of them do less.

    Args:
        work: J, of all of them.
        end_work: J, the sum of their products with the relative velocities after them.
        allowed: J.
    """
    square = end_work - work  # work of a fraction s: linear s + square s^2
    linear = work - square
    root = math.sqrt(max(linear * linear + 4.0 * square * allowed, 0.0))
    # without cancellation, for either sign of `linear`
    falls, rises = 2.0 * max(square, 1e-300), max(linear + root, 1e-300)
    fraction = 2.0 * allowed / rises if linear > 0.0 else (root - linear) / falls
    return min(max(fraction, 0.0), 1.0) if work > allowed else 1.0


@stage
def scale_impacts(pair, lane):
    """Takes back all but a fraction of the impulses since compression."""
    points = pair.points
    for n in range(points.shape[0]):
        point = points[n]
        tangential = point.tangential_impact
        for i in range(LANES):
            less = lane.restitution_scale[i] - 1.0
            px, py, pz = since_compression(point, i)
            size = point.normal_impact[i] - point.compression[i]
            point.normal_impact[i] += less * size
            for axis in range(3):
                step = tangential[axis, i] - point.tangential_compression[axis, i]
                tangential[axis, i] += less * step
            apply_impulse(pair, point, i, less * px, less * py, less * pz)


@cached_by_features
def make_apply_impacts(features):
    """Stage that changes momenta by the impact impulses.

    A refresh only counts them among the forces; time control has to know which part of them it is.
    """
    timed = features.finds_impacts

    @stage
    def apply_impacts(model, workspace, refresh):
        for k in range(model.half_pair.shape[0]):
            pair = operands_of(model, workspace, k)
            points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
            P, L = owner.momentum, owner.angular_momentum
            Q, M = surface.momentum, surface.angular_momentum
            if timed and refresh:
                one = workspace.kept[GIVEN, model.half_pair[k].owner]
                other = workspace.kept[GIVEN, model.half_pair[k].surface]
                P, L = one.momentum, one.angular_momentum
                Q, M = other.momentum, other.angular_momentum
            for n in range(points.shape[0]):
                point = points[n]
                normal, tangential = point.normal, point.tangential_impact
                extra = point.extra_impulse
                for i in range(LANES):
                    size = point.normal_impact[i]
                    px = size * normal[0, i] + tangential[0, i]
                    py = size * normal[1, i] + tangential[1, i]
                    pz = size * normal[2, i] + tangential[2, i]
                    if refresh:
                        extra[0, i] += px
                        extra[1, i] += py
                        extra[2, i] += pz
                        if not timed:
                            continue
                    add_opposite(point, i, P, L, Q, M, px, py, pz)

    return apply_impacts


@cached_by_features
def make_find_all_impacts(features):
    """Stage that notes the colliding points of all half-pairs and the lanes that have any."""
    find_impacts = make_find_impacts(features)

    @stage
    def find_all_impacts(model, workspace, h, lags, part):
        """Number of lanes with a collision.

        `lags`: with velocities of half a substep ago; `part`: see `make_find_impacts`.
        """
        lane, lanes = workspace.lane[0], 0
        for i in range(LANES):
            lane.colliding[i] = 0
            lane.fastest_approach[i] = 0.0
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                pair = operands_of(model, workspace, k)
                find_impacts(workspace, k, pair, model.half_pair[k], h, lags, part)
        for i in range(LANES):
            lanes += lane.colliding[i]
        return lanes

    return find_all_impacts


@cached_by_features
def make_impacts(features):
    """Stage that lets contacts collide, in the worlds in which any do."""
    impact_sweep, apply_impacts = make_impact_sweep(features), make_apply_impacts(features)
    find_all_impacts = make_find_all_impacts(features)
    couple_finger_velocities = make_finger_velocity_coupling(features)
    begin_hold, hold = make_begin_hold(features), make_hold(features)
    clear_hold, end_hold = make_clear_hold(features), make_end_hold(features)

    @stage
    def solve_impacts(model, workspace):
        """Sweeps over all contacts until they converge; converged lanes don't change any more."""
        lane = workspace.lane[0]
        unconverged, change = lane.unconverged, lane.largest_change
        for i in range(LANES):
            unconverged[i] = lane.colliding[i]
        for _ in range(MAX_SWEEPS):
            for i in range(LANES):
                change[i] = 0.0
            for k in range(model.half_pair.shape[0]):
                if workspace.half_pair[k].slots > 0:
                    pair, mu = operands_of(model, workspace, k), model.half_pair[k].friction
                    impact_sweep(pair, mu, lane)
                    couple_finger_velocities(model, workspace)
            hold(model, workspace, unconverged, 0.0, lane)
            left = 0
            for i in range(LANES):
                moves = change[i] > TOLERANCE * lane.fastest_approach[i]
                unconverged[i] = unconverged[i] if moves else 0
                left += unconverged[i]
            if left == 0:
                break

    @stage
    def restitute(model, workspace):
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                apply_restitution(operands_of(model, workspace, k), workspace.lane[0])
        couple_finger_velocities(model, workspace)
        hold(model, workspace, workspace.lane[0].colliding, 0.0, workspace.lane[0])

    @stage
    def limit_work(model, workspace):
        """Scales restitution in the worlds in which it has returned too much energy."""
        lane, gains = workspace.lane[0], 0
        work, end_work, scale = lane.impact_work, lane.end_work, lane.restitution_scale
        for i in range(LANES):
            e = lane.impact_restitution[i]
            lane.allowed_work[i] = e * e * max(-lane.compression_work[i], 0.0)
            end_work[i] = 0.0
            lane.unconverged[i] = 1 if work[i] > lane.allowed_work[i] else 0
            gains += lane.unconverged[i]
        if gains == 0:
            return
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                add_end_work(operands_of(model, workspace, k), lane)
        for i in range(LANES):
            scale[i] = allowed_fraction(work[i], end_work[i], lane.allowed_work[i])
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                scale_impacts(operands_of(model, workspace, k), lane)
        couple_finger_velocities(model, workspace)
        hold(model, workspace, lane.unconverged, 0.0, lane)

    @stage
    def collide(model, workspace, h, refresh):
        lane = workspace.lane[0]
        work, compression_work = lane.impact_work, lane.compression_work
        clear_hold(model, workspace)
        begin_hold(model, workspace, True, 0.0)
        for i in range(LANES):
            work[i] = 0.0
            lane.impact_restitution[i] = 0.0
        for part in range(2):  # compression, then restitution
            if part == 1:
                for i in range(LANES):
                    compression_work[i] = work[i]
                    work[i] = 0.0
                restitute(model, workspace)
            solve_impacts(model, workspace)
        limit_work(model, workspace)
        apply_impacts(model, workspace, refresh)
        end_hold(model, workspace, h if refresh else 0.0)

    @sequence
    def impacts(model, workspace, h, refresh, part):
        """`part`: see `make_find_impacts`."""
        lane, half_pairs = workspace.lane[0], model.half_pair.shape[0]
        colliding, candidates = lane.colliding, lane.unconverged
        # what collides, what still does without the push apart, and the end: each stage is called
        # in one place, because two calls would be compiled twice
        for attempt in range(3):
            if attempt < 2:
                left = part if attempt == 0 else 0.0
                if find_all_impacts(model, workspace, h, False, left) == 0 and attempt == 0:
                    return
            if attempt == 1:
                collided = 0
                for i in range(LANES):  # the other lanes lack their half impulses
                    colliding[i] = colliding[i] if candidates[i] != 0 else 0
                    collided += colliding[i]
                if collided > 0:
                    collide(model, workspace, h, refresh)
                continue
            for k in range(half_pairs):
                if workspace.half_pair[k].slots > 0:
                    pair, adds = operands_of(model, workspace, k), attempt == 0
                    add_half_impulses(pair, colliding, part, adds)
            if attempt == 0:
                for k in range(half_pairs):
                    if workspace.half_pair[k].slots > 0:
                        remove_push_out(operands_of(model, workspace, k), colliding)
                couple_finger_velocities(model, workspace)
                for i in range(LANES):
                    candidates[i] = colliding[i]

    return impacts
