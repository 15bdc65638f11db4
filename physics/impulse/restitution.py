"""Instantaneous collisions with restitution, for any number of contacts at once.

Bodies collide with their present velocities, without what the last step gave only to push
overlapping bodies apart. A contact collides if it approaches faster than a floor,
(v_a - v_b) n < -v_0, and will touch by the middle of the coming drift. All contacts that touch take
part, so an impact on a stack is felt below it. Poisson's hypothesis, which unlike Newton's stays
consistent with several contacts:

1. compression: impulses p >= 0 that stop all approach, with Coulomb friction, by sweeps of
   projected Gauss-Seidel. A correction never adds energy;
2. restitution: every colliding contact applies e p again, all at once. Without friction the speeds
   become -e times what they were, and the energy returned is e^2 of what compression removed. If
   friction makes it more, restitution is scaled down to that, with the largest e among the world's
   colliding contacts: no collision gains energy;
3. friction again with the new normal impulses, and no approach at contacts that only took part.
   Where a normal impulse shrinks, friction gives back a part of what it took, so a light body that
   is jammed between a hand and the ground could gain energy. Then all impulses p of the world are
   scaled down to where the collision gains none. With the relative velocities u before and u'
   after, and c = p (u' - u)/2, a scale s makes their work s p u + s^2 c. With W = p u + c at s = 1
   it is zero at s = 1 - W/c, and c = p u' - W.

The lecture's v' = v + (eps/M) n with eps the restitution is a misprint: the factor is the impulse.
"""

import math

from physics.collision.contact_point import TOUCH_TOLERANCE
from physics.compiler.jit import LANES, at, sequence, stage
from physics.constraints.joint_velocities import (
    make_begin_hold,
    make_clear_hold,
    make_end_hold,
    make_hold,
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


@cached_by_features
def make_find_impacts(features):
    """Stage that notes the restitution of each colliding point of a half-pair, -1 of others.

    It also notes which lanes have any. A motor that presses a body at rest onto another gives it,
    in half a substep, a velocity that looks like an impact; so with joints only points collide that
    did so with the velocities of half a substep ago, too.
    """
    timed, joints = features.finds_impacts, features.joints

    @stage
    def find_impacts(workspace, k, pair, constants, h, lags):
        points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
        restitution, floors = constants.restitution, constants.rest_speed
        lane = workspace.lane[0]
        fastest, largest = lane.fastest_approach, lane.impact_restitution
        for n in range(points.shape[0]):
            point = points[n]
            for i in range(LANES):
                e, floor = at(restitution, i), at(floors, i)
                ux, uy, uz = relative_velocity(owner, surface, point, i)
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                un = ux * nx + uy * ny + uz * nz
                if timed:
                    horizon, reach = workspace.timing[k].horizon[i], workspace.timing[k].reach[i]
                    touches = point.separation[i] + horizon * h * un <= reach
                else:
                    touches = point.separation[i] + 0.5 * h * un <= TOUCH_TOLERANCE
                collides = (un < -floor) & touches & (point.weight[i] > 0.0)
                if joints:
                    collides = collides & (lags | (point.impact_restitution[i] >= 0.0))
                point.impact_restitution[i] = e if collides else -1.0
                point.normal_impact[i] = 0.0
                for axis in range(3):
                    point.tangential_impact[axis, i] = 0.0
                lane.colliding[i] = 1 if collides else lane.colliding[i]
                fastest[i] = max(fastest[i], -un) if collides else fastest[i]
                largest[i] = max(largest[i], e) if collides else largest[i]

    return find_impacts


@stage
def remove_push_out(pair, colliding):
    """Removes, in lanes with a collision, the velocity that pushed overlapping bodies apart."""
    points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
    for n in range(points.shape[0]):
        point = points[n]
        for i in range(LANES):
            nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
            ux, uy, uz = relative_velocity(owner, surface, point, i)
            un = ux * nx + uy * ny + uz * nz
            before = point.normal_impulse[i]
            new = min(max(before - point.mass[i] * un, 0.0), before)
            new = new if (colliding[i] != 0) & (point.weight[i] > 0.0) else before
            step = new - before
            point.normal_impulse[i] = new
            apply_impulse(pair, point, i, step * nx, step * ny, step * nz)


@cached_by_features
def make_impact_sweep(features):
    """Stage of one sweep over the points of a half-pair."""
    friction = features.friction

    @stage
    def impact_sweep(pair, mu, lane, after):
        """Adds the work of all impulses to `lane.impact_work`.

        `after` restitution, colliding contacts keep their normal impulse.
        """
        points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
        unconverged, change, work = lane.unconverged, lane.largest_change, lane.impact_work
        for n in range(points.shape[0]):
            point = points[n]
            for i in range(LANES):
                involved = (point.separation[i] <= 0.0) | (point.impact_restitution[i] >= 0.0)
                involved = involved & (point.weight[i] > 0.0) & (unconverged[i] != 0)
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                ux, uy, uz = relative_velocity(owner, surface, point, i)
                un = ux * nx + uy * ny + uz * nz
                before = point.normal_impact[i]
                new = max(before - point.mass[i] * un, 0.0)
                kept = (not involved) | (after & (point.impact_restitution[i] > 0.0))
                new = before if kept else new
                step = new - before
                point.normal_impact[i] = new
                change[i] = max(change[i], abs(step) / point.mass[i])
                work[i] += step * (un + 0.5 * step / point.mass[i])
                apply_impulse(pair, point, i, step * nx, step * ny, step * nz)
                if friction:
                    tangential = point.tangential_impact
                    ux, uy, uz = relative_velocity(owner, surface, point, i)
                    un = ux * nx + uy * ny + uz * nz
                    m = point.shear_mass[i]
                    px, py, pz = tangential[0, i], tangential[1, i], tangential[2, i]
                    qx = px - m * (ux - un * nx)
                    qy = py - m * (uy - un * ny)
                    qz = pz - m * (uz - un * nz)
                    limit = at(mu, i) * new
                    size = math.sqrt(qx * qx + qy * qy + qz * qz)
                    cut = limit / size if size > limit else 1.0
                    qx = cut * qx if involved else px
                    qy = cut * qy if involved else py
                    qz = cut * qz if involved else pz
                    tangential[0, i] = qx
                    tangential[1, i] = qy
                    tangential[2, i] = qz
                    px, py, pz = qx - px, qy - py, qz - pz
                    size = max(abs(px), max(abs(py), abs(pz)))
                    change[i] = max(change[i], size / m)
                    apply_impulse(pair, point, i, px, py, pz)
                    vx, vy, vz = relative_velocity(owner, surface, point, i)
                    work[i] += 0.5 * (px * (ux + vx) + py * (uy + vy) + pz * (uz + vz))

    return impact_sweep


@stage
def apply_restitution(pair, lane, rescale):
    """Applies e times what compression gave; `rescale`: removes all but a fraction of it again."""
    points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
    for n in range(points.shape[0]):
        point = points[n]
        for i in range(LANES):
            e, given = max(point.impact_restitution[i], 0.0), point.normal_impact[i]
            compression = given / (1.0 + e) if rescale else given
            scale = lane.restitution_scale[i]
            step = (scale - 1.0) * e * compression if rescale else e * compression
            point.normal_impact[i] += step
            nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
            ux, uy, uz = relative_velocity(owner, surface, point, i)
            un = ux * nx + uy * ny + uz * nz
            lane.impact_work[i] += step * (un + 0.5 * step / point.mass[i])
            apply_impulse(pair, point, i, step * nx, step * ny, step * nz)


@stage
def add_end_work(pair, lane):
    """Adds the products of impulses and the relative velocities after them to `end_work`."""
    points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
    for n in range(points.shape[0]):
        point = points[n]
        normal, tangential = point.normal, point.tangential_impact
        for i in range(LANES):
            size = point.normal_impact[i]
            ux, uy, uz = relative_velocity(owner, surface, point, i)
            lane.end_work[i] += (
                (size * normal[0, i] + tangential[0, i]) * ux
                + (size * normal[1, i] + tangential[1, i]) * uy
                + (size * normal[2, i] + tangential[2, i]) * uz
            )


@stage
def scale_impacts(pair, lane):
    """Takes back all but a fraction of all impulses."""
    points = pair.points
    for n in range(points.shape[0]):
        point = points[n]
        normal, tangential = point.normal, point.tangential_impact
        for i in range(LANES):
            scale, size = lane.restitution_scale[i], point.normal_impact[i]
            px, py, pz = tangential[0, i], tangential[1, i], tangential[2, i]
            point.normal_impact[i] = scale * size
            tangential[0, i] = scale * px
            tangential[1, i] = scale * py
            tangential[2, i] = scale * pz
            less = scale - 1.0
            apply_impulse(
                pair, point, i,
                less * (size * normal[0, i] + px),
                less * (size * normal[1, i] + py),
                less * (size * normal[2, i] + pz),
            )  # fmt: skip


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
    def find_all_impacts(model, workspace, h, lags):
        """Number of lanes with a collision; `lags`: with velocities of half a substep ago."""
        lane, lanes = workspace.lane[0], 0
        for i in range(LANES):
            lane.colliding[i] = 0
            lane.fastest_approach[i] = 0.0
            lane.impact_restitution[i] = 0.0
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                pair = operands_of(model, workspace, k)
                find_impacts(workspace, k, pair, model.half_pair[k], h, lags)
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
    def solve_impacts(model, workspace, after):
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
                    impact_sweep(pair, mu, lane, after)
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
    def restitute(model, workspace, rescale):
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                apply_restitution(operands_of(model, workspace, k), workspace.lane[0], rescale)
        couple_finger_velocities(model, workspace)
        hold(model, workspace, workspace.lane[0].colliding, 0.0, workspace.lane[0])

    @stage
    def remove_gain(model, workspace):
        """Scales the impulses of the worlds in which collisions have gained energy."""
        lane = workspace.lane[0]
        work, end_work, scale, gains = lane.impact_work, lane.end_work, lane.restitution_scale, 0
        for i in range(LANES):
            end_work[i] = 0.0
            lane.unconverged[i] = 1 if work[i] > 0.0 else 0
            gains += lane.unconverged[i]
        if gains == 0:
            return
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                add_end_work(operands_of(model, workspace, k), lane)
        for i in range(LANES):
            c = end_work[i] - work[i]
            gains_energy = (lane.unconverged[i] != 0) & (c > 0.0)
            scale[i] = max(1.0 - work[i] / c, 0.0) if gains_energy else 1.0
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                scale_impacts(operands_of(model, workspace, k), lane)
        couple_finger_velocities(model, workspace)
        hold(model, workspace, lane.unconverged, 0.0, lane)

    @stage
    def collide(model, workspace, h, refresh):
        lane = workspace.lane[0]
        work, allowed_work, scale = lane.impact_work, lane.allowed_work, lane.restitution_scale
        lost = lane.compression_work
        clear_hold(model, workspace)
        begin_hold(model, workspace, True, 0.0)
        for i in range(LANES):
            work[i] = 0.0
        solve_impacts(model, workspace, False)
        for i in range(LANES):
            e = lane.impact_restitution[i]
            allowed_work[i] = e * e * max(-work[i], 0.0)
            lost[i] = work[i]
            work[i] = 0.0
        restitute(model, workspace, False)
        for i in range(LANES):
            allowed, gained = allowed_work[i], work[i]
            scale[i] = math.sqrt(allowed / gained) if gained > allowed else 1.0
        restitute(model, workspace, True)
        solve_impacts(model, workspace, True)
        for i in range(LANES):
            work[i] += lost[i]
        remove_gain(model, workspace)
        apply_impacts(model, workspace, refresh)
        end_hold(model, workspace, h if refresh else 0.0)

    @sequence
    def impacts(model, workspace, h, refresh):
        if find_all_impacts(model, workspace, h, False) == 0:
            return
        for k in range(model.half_pair.shape[0]):
            if workspace.half_pair[k].slots > 0:
                remove_push_out(operands_of(model, workspace, k), workspace.lane[0].colliding)
        couple_finger_velocities(model, workspace)
        if find_all_impacts(model, workspace, h, False) > 0:
            collide(model, workspace, h, refresh)

    return impacts
