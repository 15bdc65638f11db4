"""Kick-drift-kick for translation, the midpoint rule for rotation: second order.

The state is (c, q, P, L). A substep is half a kick, a drift, new forces, half a kick. Forces that
depend on velocity see the half-step velocity of the drift. Without torque L is constant to the last
bit, and omega = J^-1 L is not: the midpoint rule turns by omega at the orientation half a step
ahead.

The midpoint rule loses track of the energy where L would turn the body far about its slimmest
axis: a rod of 5 by 6 by 40 mm that tumbled at 0.26 rad a substep, its L good for 5.7 rad about its
length, had after 0.4 s all the energy that its L allows, 26 times its own, and thin solids seemed
to gain theirs in collisions. So such a turn is made in parts, each within SMALL_TURN up to 30 rad.
"""

import math
from functools import cache

from physics.jit import LANES, at, stage
from physics.model.features import GENERAL, NO_ROTATION
from physics.motion.kinematics import spin_of
from physics.rotation import SMALL_TURN, turn, turn_far

# beyond 30 rad a substep parts are longer than SMALL_TURN
MOST_PARTS = 100.0


@cache
def make_kick(features):
    """Stage that adds the impulse of the present force over a time."""
    rotation = features.rotation

    @stage
    def kick(model, work, time):
        for m in range(model.mover.shape[0]):
            solid = work.solid[m]
            P, force, L, torque = (
                solid.momentum,
                solid.force,
                solid.angular_momentum,
                solid.torque,
            )
            for i in range(LANES):
                P[0, i] += time * force[0, i]
                P[1, i] += time * force[1, i]
                P[2, i] += time * force[2, i]
            if rotation != NO_ROTATION and model.mover[m].turns:
                for i in range(LANES):
                    L[0, i] += time * torque[0, i]
                    L[1, i] += time * torque[1, i]
                    L[2, i] += time * torque[2, i]

    return kick


@cache
def make_turning(features, turn):
    """Formula that turns a quaternion by the midpoint rule, and tells omega."""
    rotation = features.rotation

    @stage
    def turning(x, y, z, w, jx, jy, jz, lx, ly, lz, time):
        if rotation == GENERAL:
            half = 0.5 * time
            ox, oy, oz = spin_of(x, y, z, w, jx, jy, jz, lx, ly, lz)
            hx, hy, hz, hw = turn(x, y, z, w, half * ox, half * oy, half * oz)
            ox, oy, oz = spin_of(hx, hy, hz, hw, jx, jy, jz, lx, ly, lz)
        else:
            ox, oy, oz = jx * lx, jx * ly, jx * lz
        x, y, z, w = turn(x, y, z, w, time * ox, time * oy, time * oz)
        return x, y, z, w, ox, oy, oz

    return turning


@stage
def longest(jx, jy, jz, time):
    """Square of the angular momentum up to which a turn counts as small."""
    fastest = time * max(jx, jy, jz)
    return SMALL_TURN * SMALL_TURN / (fastest * fastest)


@cache
def make_drift(features):
    """Stage that moves and turns every mover for a time, and tells how far its surface may go."""
    rotation = features.rotation
    turning, turning_far = make_turning(features, turn), make_turning(features, turn_far)

    @stage
    def drift(model, work, time):
        for m in range(model.mover.shape[0]):
            solid, constants = work.solid[m], model.mover[m]
            c, q, P, L = solid.position, solid.orientation, solid.momentum, solid.angular_momentum
            shift, swing = solid.shift, solid.swing
            inverse_mass, reaches, j = (
                constants.inverse_mass,
                constants.core_reach,
                constants.inverse_inertia,
            )
            for i in range(LANES):
                step = time * at(inverse_mass, i)
                dx, dy, dz = step * P[0, i], step * P[1, i], step * P[2, i]
                c[0, i] += dx
                c[1, i] += dy
                c[2, i] += dz
                shift[0, i] = dx
                shift[1, i] = dy
                shift[2, i] = dz
            if rotation == NO_ROTATION or not constants.turns:
                continue
            far = 0
            for i in range(LANES):
                jx, jy, jz = at(j[0], i), at(j[1], i), at(j[2], i)
                square, reach = longest(jx, jy, jz, time), time * at(reaches, i)
                x, y, z, w = q[0, i], q[1, i], q[2, i], q[3, i]
                lx, ly, lz = L[0, i], L[1, i], L[2, i]
                nx, ny, nz, nw, ox, oy, oz = turning(x, y, z, w, jx, jy, jz, lx, ly, lz, time)
                near = lx * lx + ly * ly + lz * lz <= square
                q[0, i] = nx if near else x
                q[1, i] = ny if near else y
                q[2, i] = nz if near else z
                q[3, i] = nw if near else w
                # the sum of absolute values is never less than the length, and needs no root
                swing[i] = reach * (abs(ox) + abs(oy) + abs(oz)) if near else math.inf
                far += 0 if near else 1
            if far > 0:
                for i in range(LANES):
                    jx, jy, jz = at(j[0], i), at(j[1], i), at(j[2], i)
                    square, reach = longest(jx, jy, jz, time), time * at(reaches, i)
                    lx, ly, lz = L[0, i], L[1, i], L[2, i]
                    if swing[i] == math.inf:
                        far_by = math.sqrt((lx * lx + ly * ly + lz * lz) / square)
                        parts = 1
                        # what has no slim axis turns exactly in one, and NaN is no number of parts
                        if rotation == GENERAL and far_by > 1.0 and not jx == jy == jz:
                            parts = math.ceil(min(MOST_PARTS, far_by))
                        x, y, z, w = q[0, i], q[1, i], q[2, i], q[3, i]
                        fastest = 0.0
                        for _ in range(parts):
                            x, y, z, w, ox, oy, oz = turning_far(
                                x, y, z, w, jx, jy, jz, lx, ly, lz, time / parts
                            )
                            spin = abs(ox) + abs(oy) + abs(oz)
                            fastest = fastest if spin <= fastest else spin  # NaN stays
                        q[0, i] = x
                        q[1, i] = y
                        q[2, i] = z
                        q[3, i] = w
                        swing[i] = reach * fastest

    return drift
