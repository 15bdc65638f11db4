"""Instantaneous collisions with restitution, of any number of contacts at once.

Bodies collide with the speeds of now, without what the last step gave only to push overlaps apart.
A contact collides if it closes faster than the floor, (v_a - v_b) n < -v_0, and will have touched
by the middle of the coming drift. All that touches takes part: a blow on a stack is felt below it.
Poisson's hypothesis, which unlike Newton's needs no more care for several contacts than for one:

1. compression: impulses p >= 0 that stop all approach, with Coulomb friction, found by rounds of
   Gauss-Seidel; each correction takes energy or leaves it;
2. restitution: every colliding contact gives e p again, all at once. Without friction the speeds
   become -e times what they were. The energy that this returns is e^2 of what compression took;
   if, by friction's doing, it would be more, it is scaled down to that, with the largest e of what
   collides in the world at that moment: no collision gains energy;
3. friction anew, with what now presses, and no approach at contacts that only took part.

The lecture's v' = v + (eps/M) n with eps the restitution is a misprint: the factor is the impulse.
"""

import math
from functools import cache

from physics.collision.contact_point import ALMOST
from physics.impulse.contact_rows import ends, give, slip
from physics.jit import LANES, at, kernel, stage
from physics.motion.drives import make_join_speeds
from physics.motion.vectors import cross

# Rounds end when none has changed a speed by more than this share of the fastest approach, or after
# so many
SMALL, ROUNDS = 1e-6, 64


@kernel
def find(points, owner, surface, constants, h, lane):
    """Notes the restitution of each point that collides, -1 of others, and which lanes have one."""
    restitution, floors = constants.restitution, constants.rest_speed
    for n in range(points.shape[0]):
        point = points[n]
        for i in range(LANES):
            e, floor = at(restitution, i), at(floors, i)
            ux, uy, uz = slip(owner, surface, point, i)
            nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
            un = ux * nx + uy * ny + uz * nz
            collides = (un < -floor) & (point.gap[i] + 0.5 * h * un <= ALMOST)
            collides = collides & (point.weight[i] > 0.0)
            point.bounce[i] = e if collides else -1.0
            point.hit[i] = 0.0
            for axis in range(3):
                point.skid[axis, i] = 0.0
            lane.struck[i] = 1 if collides else lane.struck[i]
            lane.speed[i] = max(lane.speed[i], -un) if collides else lane.speed[i]
            lane.bounce[i] = max(lane.bounce[i], e) if collides else lane.bounce[i]


@kernel
def retract(points, owner, surface, A, B, ma, mb, struck):
    """Takes back what pushed overlaps apart in the last step: that speed is none of the bodies'."""
    for n in range(points.shape[0]):
        point = points[n]
        for i in range(LANES):
            nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
            ux, uy, uz = slip(owner, surface, point, i)
            un = ux * nx + uy * ny + uz * nz
            push = point.push[i]
            new = min(max(push - point.mass[i] * un, 0.0), push)
            new = new if (struck[i] != 0) & (point.weight[i] > 0.0) else push
            step = new - push
            point.push[i] = new
            give(owner, surface, A, B, ma, mb, point, i, step * nx, step * ny, step * nz)


@cache
def make_press(features):
    """Kernel of one round over one side's points."""
    friction = features.friction

    @kernel
    def press(points, owner, surface, A, B, ma, mb, mu, lane, after):
        """`after` restitution, contacts that bounce keep what they gave along the normal.

        Adds the work of all impulses to `lane.work`.
        """
        going, change, work = lane.going, lane.change, lane.work
        for n in range(points.shape[0]):
            point = points[n]
            for i in range(LANES):
                part = (point.gap[i] <= 0.0) | (point.bounce[i] >= 0.0)
                part = part & (point.weight[i] > 0.0) & (going[i] != 0)
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                ux, uy, uz = slip(owner, surface, point, i)
                un = ux * nx + uy * ny + uz * nz
                hit = point.hit[i]
                new = max(hit - point.mass[i] * un, 0.0)
                kept = (not part) | (after & (point.bounce[i] > 0.0))
                new = hit if kept else new
                step = new - hit
                point.hit[i] = new
                change[i] = max(change[i], abs(step) / point.mass[i])
                work[i] += step * (un + 0.5 * step / point.mass[i])
                give(owner, surface, A, B, ma, mb, point, i, step * nx, step * ny, step * nz)
                if friction:
                    ux, uy, uz = slip(owner, surface, point, i)
                    un = ux * nx + uy * ny + uz * nz
                    m = point.shear_mass[i]
                    px, py, pz = point.skid[0, i], point.skid[1, i], point.skid[2, i]
                    qx = px - m * (ux - un * nx)
                    qy = py - m * (uy - un * ny)
                    qz = pz - m * (uz - un * nz)
                    limit = at(mu, i) * new
                    size = math.sqrt(qx * qx + qy * qy + qz * qz)
                    cut = limit / size if size > limit else 1.0
                    qx = cut * qx if part else px
                    qy = cut * qy if part else py
                    qz = cut * qz if part else pz
                    point.skid[0, i] = qx
                    point.skid[1, i] = qy
                    point.skid[2, i] = qz
                    px, py, pz = qx - px, qy - py, qz - pz
                    size = max(abs(px), max(abs(py), abs(pz)))
                    change[i] = max(change[i], size / m)
                    give(owner, surface, A, B, ma, mb, point, i, px, py, pz)
                    vx, vy, vz = slip(owner, surface, point, i)
                    work[i] += 0.5 * (px * (ux + vx) + py * (uy + vy) + pz * (uz + vz))

    return press


@kernel
def rebound(points, owner, surface, A, B, ma, mb, lane, again):
    """Restitution: e of what compression gave; `again`, all but a share of it is taken back."""
    for n in range(points.shape[0]):
        point = points[n]
        for i in range(LANES):
            e = max(point.bounce[i], 0.0)
            compression = point.hit[i] / (1.0 + e) if again else point.hit[i]
            step = (lane.share[i] - 1.0) * e * compression if again else e * compression
            point.hit[i] += step
            nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
            ux, uy, uz = slip(owner, surface, point, i)
            un = ux * nx + uy * ny + uz * nz
            lane.work[i] += step * (un + 0.5 * step / point.mass[i])
            give(owner, surface, A, B, ma, mb, point, i, step * nx, step * ny, step * nz)


@stage
def book_hits(model, work, look):
    """Changes momenta by the collision's impulses; at a look, counts them among the forces."""
    for k in range(model.side.shape[0]):
        side = model.side[k]
        owner, surface = work.solid[side.owner], work.solid[side.surface]
        P, L, Q, M = (
            owner.momentum,
            owner.angular_momentum,
            surface.momentum,
            surface.angular_momentum,
        )
        for n in range(side.first_slot, side.first_slot + work.side[k].slots):
            point = work.point[n]
            for i in range(LANES):
                hit = point.hit[i]
                px = hit * point.normal[0, i] + point.skid[0, i]
                py = hit * point.normal[1, i] + point.skid[1, i]
                pz = hit * point.normal[2, i] + point.skid[2, i]
                if look:
                    point.spent[0, i] += px
                    point.spent[1, i] += py
                    point.spent[2, i] += pz
                    continue
                P[0, i] += px
                P[1, i] += py
                P[2, i] += pz
                Q[0, i] -= px
                Q[1, i] -= py
                Q[2, i] -= pz
                tx, ty, tz = cross(point.arm[0, i], point.arm[1, i], point.arm[2, i], px, py, pz)
                L[0, i] += tx
                L[1, i] += ty
                L[2, i] += tz
                bx, by, bz = (
                    point.surface_arm[0, i],
                    point.surface_arm[1, i],
                    point.surface_arm[2, i],
                )
                tx, ty, tz = cross(bx, by, bz, px, py, pz)
                M[0, i] -= tx
                M[1, i] -= ty
                M[2, i] -= tz


@cache
def make_impacts(features):
    """Kernel that lets contacts collide where they do."""
    press, join_speeds = make_press(features), make_join_speeds(features)

    @kernel
    def press_all(model, work, after):
        """Rounds over all contacts until nothing moves; lanes that have settled are left alone."""
        lane = work.lane[0]
        for i in range(LANES):
            lane.going[i] = lane.struck[i]
        for _ in range(ROUNDS):
            for i in range(LANES):
                lane.change[i] = 0.0
            for k in range(model.side.shape[0]):
                if work.side[k].slots > 0:
                    points, A, B, ma, mb = ends(model, work, k)
                    a, b = work.solid[model.side[k].owner], work.solid[model.side[k].surface]
                    mu = model.side[k].friction
                    press(points, a, b, A, B, ma, mb, mu, lane, after)
                    join_speeds(model, work)
            going = 0
            for i in range(LANES):
                lane.going[i] = lane.going[i] if lane.change[i] > SMALL * lane.speed[i] else 0
                going += lane.going[i]
            if going == 0:
                break

    @kernel
    def restitute(model, work, again):
        for k in range(model.side.shape[0]):
            if work.side[k].slots > 0:
                points, A, B, ma, mb = ends(model, work, k)
                a, b = work.solid[model.side[k].owner], work.solid[model.side[k].surface]
                rebound(points, a, b, A, B, ma, mb, work.lane[0], again)
        join_speeds(model, work)

    @kernel
    def collide(model, work, look):
        lane = work.lane[0]
        for i in range(LANES):
            lane.work[i] = 0.0
        press_all(model, work, False)
        for i in range(LANES):
            e = lane.bounce[i]
            lane.allowed[i] = e * e * max(-lane.work[i], 0.0)
            lane.work[i] = 0.0
        restitute(model, work, False)
        for i in range(LANES):
            allowed, won = lane.allowed[i], lane.work[i]
            lane.share[i] = math.sqrt(allowed / won) if won > allowed else 1.0
        restitute(model, work, True)
        press_all(model, work, True)
        book_hits(model, work, look)

    @kernel
    def find_all(model, work, h):
        """Number of lanes with a collision."""
        lane, lanes = work.lane[0], 0
        for i in range(LANES):
            lane.struck[i] = 0
            lane.speed[i] = 0.0
            lane.bounce[i] = 0.0
        for k in range(model.side.shape[0]):
            if work.side[k].slots > 0:
                points = ends(model, work, k)[0]
                a, b = work.solid[model.side[k].owner], work.solid[model.side[k].surface]
                find(points, a, b, model.side[k], h, lane)
        for i in range(LANES):
            lanes += lane.struck[i]
        return lanes

    @stage
    def impacts(model, work, h, look):
        if find_all(model, work, h) == 0:
            return
        for k in range(model.side.shape[0]):
            if work.side[k].slots > 0:
                points, A, B, ma, mb = ends(model, work, k)
                a, b = work.solid[model.side[k].owner], work.solid[model.side[k].surface]
                retract(points, a, b, A, B, ma, mb, work.lane[0].struck)
        join_speeds(model, work)
        if find_all(model, work, h) > 0:
            collide(model, work, look)

    return impacts
