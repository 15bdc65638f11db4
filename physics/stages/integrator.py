"""Kick-drift-kick for translation, the midpoint rule for rotation: second order.

The state is (c, q, P, L). A substep is half a kick, a drift, new forces, half a kick. Forces that
depend on velocity see the half-step velocity of the drift. Without torque L is constant to the last
bit, and omega = J^-1 L is not: the midpoint rule turns by omega at the orientation half a step
ahead.
"""

from functools import cache

from physics.features import GENERAL, NO_ROTATION
from physics.jit import stage
from physics.rotation import turn
from physics.stages.kinematics import PATH, spin_of


@cache
def make_kick(features):
    """Stage that adds the impulse of the present force over a time."""
    rotation = features.rotation

    @stage
    def kick(model, state, w, time):
        for i in range(model.mover.shape[0]):
            m = state.mover[w, i]
            m.momentum[0] += time * m.force[0]
            m.momentum[1] += time * m.force[1]
            m.momentum[2] += time * m.force[2]
            if rotation != NO_ROTATION and model.mover[i].turns:
                m.angular_momentum[0] += time * m.torque[0]
                m.angular_momentum[1] += time * m.torque[1]
                m.angular_momentum[2] += time * m.torque[2]

    return kick


@cache
def make_drift(features):
    """Stage that moves and turns every mover for a time, and tells how far its surface may go."""
    rotation = features.rotation

    @stage
    def drift(model, state, frame, w, time):
        for i in range(model.mover.shape[0]):
            m = state.mover[w, i]
            constants = model.mover[i]
            # the sum of absolute values is never less than the length, and needs no root
            path = 0.0
            step = time * constants.inverse_mass * m.momentum[0]
            m.position[0] += step
            path += abs(step)
            step = time * constants.inverse_mass * m.momentum[1]
            m.position[1] += step
            path += abs(step)
            step = time * constants.inverse_mass * m.momentum[2]
            m.position[2] += step
            path += abs(step)
            if rotation != NO_ROTATION and constants.turns:
                q, L, j = m.orientation, m.angular_momentum, constants.inverse_inertia
                x, y, z, s = q[0], q[1], q[2], q[3]
                lx, ly, lz = L[0], L[1], L[2]
                jx, jy, jz = j[0], j[1], j[2]
                if rotation == GENERAL:
                    ox, oy, oz = spin_of(x, y, z, s, jx, jy, jz, lx, ly, lz)
                    half = 0.5 * time
                    hx, hy, hz, hs = turn(x, y, z, s, half * ox, half * oy, half * oz)
                    ox, oy, oz = spin_of(hx, hy, hz, hs, jx, jy, jz, lx, ly, lz)
                else:
                    ox, oy, oz = jx * lx, jx * ly, jx * lz
                x, y, z, s = turn(x, y, z, s, time * ox, time * oy, time * oz)
                q[0] = x
                q[1] = y
                q[2] = z
                q[3] = s
                path += constants.reach * time * (abs(ox) + abs(oy) + abs(oz))
            frame[i, PATH] = path

    return drift
