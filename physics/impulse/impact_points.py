"""Contact points in an instantaneous collision: which collide, and one sweep over their impulses.

What `restitution.py` puts together. Velocities are the present ones: those of half a step ago, the
known forces since, and half of what contacts gave in the last step.
"""

import math

from physics.collision.contact_point import TOUCH_TOLERANCE
from physics.compiler.jit import LANES, at, stage
from physics.impulse.point_impulses import apply_impulse, relative_velocity
from physics.model.features import EULER, cached_by_features


def lag_of(features):
    """Steps by which velocities lag positions; with semi-implicit Euler both are of one time."""
    return 0.0 if features.integrator == EULER else 0.5


@cached_by_features
def make_find_impacts(features):
    """Stage that notes which points of a half-pair collide or take part, and lanes with collisions.

    A motor that presses a body at rest onto another gives it,
    in half a substep, a velocity that looks like an impact; so with joints only points collide that
    did so with the velocities of half a substep ago, too.
    """
    timed, joints, axial = features.finds_impacts, features.joints, features.axial

    @stage
    def find_impacts(workspace, k, pair, constants, h, lags, part):
        """`part`: of the last impulse that a contact has still to give up to the present time."""
        points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
        restitution = constants.restitution
        lane = workspace.lane[0]
        fastest = lane.fastest_approach
        for n in range(points.shape[0]):
            point = points[n]
            for i in range(LANES):
                e = at(restitution, i)
                # now the separation rate is u n; half a step ago it was less by what curvature adds
                bend = point.last_bend[i] if lags else 0.0
                ux, uy, uz = relative_velocity(owner, surface, point, i)
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                un = ux * nx + uy * ny + uz * nz - bend
                if axial:
                    un -= point.turned[i]
                un += part * point.normal_impulse[i] / point.mass[i]
                if timed:
                    horizon, reach = workspace.timing[k].horizon[i], workspace.timing[k].reach[i]
                    touches = point.separation[i] + horizon * h * un <= reach
                else:
                    touches = point.separation[i] + 0.5 * h * un <= TOUCH_TOLERANCE
                exists = point.weight[i] > 0.0
                collides = (un < -point.rest_speed[i]) & touches & exists
                if joints:
                    collides = collides & (lags | (point.collides[i] != 0.0))
                takes_part = collides | ((point.separation[i] <= TOUCH_TOLERANCE) & exists)
                point.collides[i] = 1.0 if collides else 0.0
                point.impact_restitution[i] = e if takes_part else -1.0
                point.impact_target[i] = 0.0 if collides else min(un, 0.0)
                point.least_impact[i] = 0.0
                point.normal_impact[i] = 0.0
                point.compression[i] = 0.0
                for axis in range(3):
                    point.tangential_impact[axis, i] = 0.0
                    point.tangential_compression[axis, i] = 0.0
                lane.colliding[i] = 1 if collides else lane.colliding[i]
                fastest[i] = max(fastest[i], -un) if collides else fastest[i]

    return find_impacts


@stage
def add_half_impulses(pair, colliding, part, adds):
    """Adds what contacts give up to the present time: a part of their impulses of the last step.

    Only in lanes with a collision, or the others would be rounded. Or it removes them again, and
    notes how much of the step is left.
    """
    points = pair.points
    for n in range(points.shape[0]):
        point = points[n]
        normal, tangential, half = point.normal, point.tangential_impulse, point.half_impulse
        for i in range(LANES):
            size, given = point.normal_impulse[i], part if colliding[i] != 0 else 0.0
            px = given * (size * normal[0, i] + tangential[0, i]) if adds else -half[0, i]
            py = given * (size * normal[1, i] + tangential[1, i]) if adds else -half[1, i]
            pz = given * (size * normal[2, i] + tangential[2, i]) if adds else -half[2, i]
            half[0, i] = px
            half[1, i] = py
            half[2, i] = pz
            point.remaining[i] = 1.0 - given
            apply_impulse(pair, point, i, px, py, pz)


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
            point.relaxed[i] = 1.0 if colliding[i] != 0 else 0.0
            apply_impulse(pair, point, i, step * nx, step * ny, step * nz)


@cached_by_features
def make_impact_sweep(features):
    """Stage of one sweep over the points of a half-pair."""
    friction = features.friction

    @stage
    def impact_sweep(pair, mu, lane):
        """Adds the work of all impulses to `lane.impact_work`."""
        points, owner, surface = pair.points, pair.owner[0], pair.surface[0]
        unconverged, change, work = lane.unconverged, lane.largest_change, lane.impact_work
        for n in range(points.shape[0]):
            point = points[n]
            for i in range(LANES):
                involved = (point.impact_restitution[i] >= 0.0) & (unconverged[i] != 0)
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                ux, uy, uz = relative_velocity(owner, surface, point, i)
                un = ux * nx + uy * ny + uz * nz
                before = point.normal_impact[i]
                lacking = point.mass[i] * (un - point.impact_target[i])
                new = max(before - lacking, point.least_impact[i])
                new = new if involved else before
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
