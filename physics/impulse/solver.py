"""The impulse law: contacts that push as hard as it takes for solids not to approach.

The force of a step is an impulse over its time, found by going round the contacts and correcting
one after another (Gauss-Seidel), once a substep: many short substeps converge faster than many
rounds of a long one. Impulses of the last substep are the first guess. With u = (v_a - v_b) at the
point, half a step old, and n out of the surface, a substep does

1. collides: instantaneous collisions with restitution, see `stages/impacts.py`;
2. relaxes: with the impulses of the last substep to start from, u n >= 0. That takes away what
   pushed overlaps apart, which so moves bodies but gives them no energy;
3. gives outside forces and the guess, then solves u n >= -gap/h ahead of the contact and, where
   solids overlap, the soft contact below.

A soft contact is a spring k and damper c whose force is that at the end of the step. With
a = h (c + h k) and the impulse p so far, p changes by -(u n + k h/a gap + p/a) m a/(m + a), for a
point that feels the mass m: stable at any step, for any k. At rest it sinks as the spring of that
stiffness would, load / k. The speed at which overlap is pushed apart is limited.

Friction is rigid: it takes what speed across the contact remains, up to mu times the impulse along
it. An anchor remembers how far the point has crept since it came to stick, and pulls it back. The
mass across is the least in any direction, so that the step stays a descent of the energy that the
cone can't turn into an ascent. Resistance against rolling and spinning is the same for the spin.
"""

import math
from functools import cache

from physics.impulse.contact_rows import ends, give, make_points, place_tensors, slip, turn
from physics.impulse.restitution import make_impacts
from physics.jit import LANES, at, kernel, stage
from physics.model.lanes import note_touch
from physics.motion.drives import make_join_speeds
from physics.motion.vectors import cross, times, turned_back

# m/s at which overlaps are pushed apart at most
PUSH_SPEED = 1.0
# 1/s at which an anchor takes its stretch back
ANCHOR = 5.0
# 1/s at which an anchor forgets: where two sides meet in the same place but stuck apart, one can
# only be at rest by pulling against the other, ever harder
FORGET = 0.1


@stage
def resist(owner, surface, A, B, point, i, push, rolling, spinning):
    """Corrects the angular impulse of a point against relative spin."""
    nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
    # the least moment of inertia, by the largest row sum of its inverse
    xx, yy, zz = A[0, i] + B[0, i], A[1, i] + B[1, i], A[2, i] + B[2, i]
    xy, xz, yz = abs(A[3, i] + B[3, i]), abs(A[4, i] + B[4, i]), abs(A[5, i] + B[5, i])
    inertia = 1.0 / max(max(xx + xy + xz, xy + yy + yz), max(xz + yz + zz, 1e-300))
    wx = owner.spin[0, i] - surface.spin[0, i]
    wy = owner.spin[1, i] - surface.spin[1, i]
    wz = owner.spin[2, i] - surface.spin[2, i]
    px, py, pz = point.twist[0, i], point.twist[1, i], point.twist[2, i]
    qx, qy, qz = px - inertia * wx, py - inertia * wy, pz - inertia * wz
    along = qx * nx + qy * ny + qz * nz
    qx, qy, qz = qx - along * nx, qy - along * ny, qz - along * nz
    along = min(max(along, -spinning * push), spinning * push)
    size = math.sqrt(qx * qx + qy * qy + qz * qz)
    cut = rolling * push / size if size > rolling * push else 1.0
    qx, qy, qz = cut * qx + along * nx, cut * qy + along * ny, cut * qz + along * nz
    point.twist[0, i] = qx
    point.twist[1, i] = qy
    point.twist[2, i] = qz
    turn(owner, surface, A, B, i, qx - px, qy - py, qz - pz)


@cache
def make_sweep(features):
    """Kernel that corrects the impulses of one side's points, one after another."""
    friction, resistance = features.friction, features.resistance

    @kernel
    def sweep(points, owner, surface, A, B, ma, mb, constants, h, soft):
        """`soft`: with the bias that pushes overlaps apart, and the softness that goes with it."""
        frictions, floors = constants.friction, constants.rest_speed
        stiffness, damping = constants.stiffness, constants.damping
        rolling, spinning = constants.rolling, constants.spinning
        per_h = 1.0 / h
        for n in range(points.shape[0]):
            point = points[n]
            for i in range(LANES):
                mu, floor = at(frictions, i), at(floors, i)
                K, C = at(stiffness, i), at(damping, i)
                rate = K / (C + h * K)
                nx, ny, nz = point.normal[0, i], point.normal[1, i], point.normal[2, i]
                gap, weight, m, push = point.gap[i], point.weight[i], point.mass[i], point.push[i]
                ux, uy, uz = slip(owner, surface, point, i)
                un = ux * nx + uy * ny + uz * nz
                ahead = gap > 0.0
                bias = gap * per_h if ahead else 0.0
                mass, leak = m, 0.0
                if soft:
                    a = h * weight * (C + h * K)
                    yielding = not ahead
                    leak = m / (m + a) if yielding else 0.0
                    mass = a * leak if yielding else m
                    bias = max(rate * gap, -PUSH_SPEED) if yielding else bias
                # what will collide must arrive at its full speed
                bias = -un if ahead & (un < -floor) else bias
                new = max(push - mass * (un + bias) - leak * push, 0.0)
                new = new if weight > 0.0 else 0.0
                step = new - push
                point.push[i] = new
                give(owner, surface, A, B, ma, mb, point, i, step * nx, step * ny, step * nz)
                if friction:
                    ux, uy, uz = slip(owner, surface, point, i)
                    un = ux * nx + uy * ny + uz * nz
                    sx, sy, sz = ux - un * nx, uy - un * ny, uz - un * nz
                    if soft:
                        sx += ANCHOR * point.anchor[0, i]
                        sy += ANCHOR * point.anchor[1, i]
                        sz += ANCHOR * point.anchor[2, i]
                    mt = point.shear_mass[i]
                    px, py, pz = point.pull[0, i], point.pull[1, i], point.pull[2, i]
                    qx, qy, qz = px - mt * sx, py - mt * sy, pz - mt * sz
                    limit = mu * new
                    size = math.sqrt(qx * qx + qy * qy + qz * qz)
                    cut = limit / size if size > limit else 1.0
                    qx *= cut
                    qy *= cut
                    qz *= cut
                    point.pull[0, i] = qx
                    point.pull[1, i] = qy
                    point.pull[2, i] = qz
                    if soft:
                        held = 1.0 - h * FORGET if size <= limit else 0.0
                        point.anchor[0, i] *= held
                        point.anchor[1, i] *= held
                        point.anchor[2, i] *= held
                    give(owner, surface, A, B, ma, mb, point, i, qx - px, qy - py, qz - pz)
                if resistance:
                    resist(owner, surface, A, B, point, i, new, rolling, spinning)

    return sweep


@cache
def make_warm(features):
    """Kernel that gives the impulses of the last substep anew, and books what relaxing gave."""
    friction, resistance = features.friction, features.resistance

    @kernel
    def warm(points, owner, surface, A, B, ma, mb):
        for n in range(points.shape[0]):
            point = points[n]
            for i in range(LANES):
                push = point.push[i]
                px, py, pz = (
                    push * point.normal[0, i],
                    push * point.normal[1, i],
                    push * point.normal[2, i],
                )
                if friction:
                    px += point.pull[0, i]
                    py += point.pull[1, i]
                    pz += point.pull[2, i]
                point.spent[0, i] += px
                point.spent[1, i] += py
                point.spent[2, i] += pz
                give(owner, surface, A, B, ma, mb, point, i, px, py, pz)
                if resistance:
                    tx, ty, tz = point.twist[0, i], point.twist[1, i], point.twist[2, i]
                    point.turned[0, i] += tx
                    point.turned[1, i] += ty
                    point.turned[2, i] += tz
                    turn(owner, surface, A, B, i, tx, ty, tz)

    return warm


@cache
def make_book(features):
    """Kernel that adds the forces of one side's points, and keeps what they remember."""
    friction, resistance = features.friction, features.resistance

    @kernel
    def book(points, candidate, owner, surface, keeps, h, pressed):
        Q, per_h = surface.rotation, 1.0 / h
        F, T, G, U = owner.force, owner.torque, surface.force, surface.torque
        for n in range(points.shape[0]):
            point, row = points[n], candidate[n]
            for i in range(LANES):
                push = point.push[i]
                fx = point.spent[0, i] + push * point.normal[0, i]
                fy = point.spent[1, i] + push * point.normal[1, i]
                fz = point.spent[2, i] + push * point.normal[2, i]
                pressed[i] += per_h * (push + point.hit[i])
                row.load[i] = per_h * push if keeps[i] != 0 else row.load[i]
                hit = per_h * point.hit[i]
                bx, by, bz = turned_back(
                    Q,
                    i,
                    hit * point.normal[0, i] + per_h * point.skid[0, i],
                    hit * point.normal[1, i] + per_h * point.skid[1, i],
                    hit * point.normal[2, i] + per_h * point.skid[2, i],
                )
                row.blow[0, i] = bx if keeps[i] != 0 else row.blow[0, i]
                row.blow[1, i] = by if keeps[i] != 0 else row.blow[1, i]
                row.blow[2, i] = bz if keeps[i] != 0 else row.blow[2, i]
                if friction:
                    px, py, pz = point.pull[0, i], point.pull[1, i], point.pull[2, i]
                    fx += px
                    fy += py
                    fz += pz
                    px, py, pz = turned_back(Q, i, per_h * px, per_h * py, per_h * pz)
                    row.pull[0, i] = px if keeps[i] != 0 else row.pull[0, i]
                    row.pull[1, i] = py if keeps[i] != 0 else row.pull[1, i]
                    row.pull[2, i] = pz if keeps[i] != 0 else row.pull[2, i]
                    sx, sy, sz = turned_back(
                        Q, i, point.anchor[0, i], point.anchor[1, i], point.anchor[2, i]
                    )
                    row.shear[0, i] = sx if keeps[i] != 0 else row.shear[0, i]
                    row.shear[1, i] = sy if keeps[i] != 0 else row.shear[1, i]
                    row.shear[2, i] = sz if keeps[i] != 0 else row.shear[2, i]
                if resistance:
                    tx, ty, tz = point.twist[0, i], point.twist[1, i], point.twist[2, i]
                    px, py, pz = turned_back(Q, i, per_h * tx, per_h * ty, per_h * tz)
                    row.twist[0, i] = px if keeps[i] != 0 else row.twist[0, i]
                    row.twist[1, i] = py if keeps[i] != 0 else row.twist[1, i]
                    row.twist[2, i] = pz if keeps[i] != 0 else row.twist[2, i]
                    tx = per_h * (tx + point.turned[0, i])
                    ty = per_h * (ty + point.turned[1, i])
                    tz = per_h * (tz + point.turned[2, i])
                    T[0, i] += tx
                    T[1, i] += ty
                    T[2, i] += tz
                    U[0, i] -= tx
                    U[1, i] -= ty
                    U[2, i] -= tz
                fx *= per_h
                fy *= per_h
                fz *= per_h
                F[0, i] += fx
                F[1, i] += fy
                F[2, i] += fz
                G[0, i] -= fx
                G[1, i] -= fy
                G[2, i] -= fz
                tx, ty, tz = cross(point.arm[0, i], point.arm[1, i], point.arm[2, i], fx, fy, fz)
                T[0, i] += tx
                T[1, i] += ty
                T[2, i] += tz
                bx, by, bz = (
                    point.surface_arm[0, i],
                    point.surface_arm[1, i],
                    point.surface_arm[2, i],
                )
                tx, ty, tz = cross(bx, by, bz, fx, fy, fz)
                U[0, i] -= tx
                U[1, i] -= ty
                U[2, i] -= tz

    return book


@stage
def outside(model, work, h):
    """Gives every mover the impulse of the forces that are already known."""
    for m in range(model.mover.shape[0]):
        solid, entry = work.solid[m], work.tensor[m].entry
        v, omega, F, T = solid.velocity, solid.spin, solid.force, solid.torque
        inverse_mass = model.mover[m].inverse_mass
        for i in range(LANES):
            step = h * at(inverse_mass, i)
            v[0, i] += step * F[0, i]
            v[1, i] += step * F[1, i]
            v[2, i] += step * F[2, i]
            tx, ty, tz = times(entry, i, T[0, i], T[1, i], T[2, i])
            omega[0, i] += h * tx
            omega[1, i] += h * ty
            omega[2, i] += h * tz


@cache
def make_impulses(features):
    """Stage that adds the contact forces of all sides, and notes first touches."""
    points, impacts = make_points(features), make_impacts(features)
    sweep, warm, book = make_sweep(features), make_warm(features), make_book(features)
    join_speeds = make_join_speeds(features)

    @kernel
    def correct(model, work, h, soft):
        """One round over all contacts."""
        for k in range(model.side.shape[0]):
            if work.side[k].slots > 0:
                here, A, B, ma, mb = ends(model, work, k)
                a, b = work.solid[model.side[k].owner], work.solid[model.side[k].surface]
                sweep(here, a, b, A, B, ma, mb, model.side[k], h, soft)
                join_speeds(model, work)

    @kernel
    def finish(model, state, work, g, k, h, elapsed):
        here = ends(model, work, k)[0]
        owner, surface = work.solid[model.side[k].owner], work.solid[model.side[k].surface]
        first, keeps = model.side[k].first_slot, work.lane[0].keeps
        for i in range(LANES):
            owner.pressed[i] = 0.0
        candidate = state.candidate[g, first : first + here.shape[0]]
        book(here, candidate, owner, surface, keeps, h, owner.pressed)
        note_touch(model, state, work, g, k, owner.pressed, elapsed)

    @kernel
    def impulses(model, state, work, g, h, drifted, elapsed):
        sides, touching = model.side.shape[0], 0
        for k in range(sides):
            touching += work.side[k].slots
        if touching == 0:
            return
        place_tensors(model, work)
        for k in range(sides):
            if work.side[k].slots > 0:
                points(model, state, work, g, k, work.lane[0].keeps, h)
        # bodies collide with the speeds of now
        outside(model, work, 0.5 * drifted)
        impacts(model, work, h, drifted == 0.0)
        outside(model, work, -0.5 * drifted)
        correct(model, work, h, False)
        outside(model, work, h)
        for k in range(sides):
            if work.side[k].slots > 0:
                here, A, B, ma, mb = ends(model, work, k)
                a, b = work.solid[model.side[k].owner], work.solid[model.side[k].surface]
                warm(here, a, b, A, B, ma, mb)
        join_speeds(model, work)
        correct(model, work, h, True)
        for k in range(sides):
            if work.side[k].slots > 0:
                finish(model, state, work, g, k, h, elapsed)

    return impulses
