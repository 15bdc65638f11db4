"""Force that keeps a ball from gaining energy where its normal jumps between two faces of a box.

A kick uses the normal at the present position for the whole step. The error is small while the
normal changes little. But a ball may sink so deep that its centre passes close to an edge of the
box's core, or through it: then one face presses it in one half of the step and another face in the
other half. With the half step s = h u / 2 of its centre relative to the box, and penetrations
d- d d+ at the start, middle and end of the step, the spring should do the work

    k/2 (d-^2 - d+^2),    and does, along its normal n,    k/2 ((d + s.n)^2 - (d - s.n)^2),

with no penetration counted below 0 (`hunt_crossley_force` has the same mean over the drift). On a
flat face the two are equal. Where the kick does too much work, a force against u removes the
excess, at most until the centre is at rest. Where it does too little, energy is lost: energy can
only fall by what a step doesn't resolve. The same holds for capsules against boxes; boxes touch
each other on faces only.

The force acts at the ball's centre, and reports of contacts don't include it.
"""

import math

from physics.collision.distances import box_distance
from physics.collision.facing import facing
from physics.compiler.jit import LANES, at, stage
from physics.model.contact_memory import contact_memory
from physics.model.features import cached_by_features
from physics.scene.shapes import BOX


@stage
def rotational_inverse_mass(jx, jy, jz, x, y, z, nx, ny, nz):
    """1/kg that rotation adds to a body's inverse mass at p from its centre: (p x n)^2 / J."""
    mx, my, mz = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
    return jx * mx * mx + jy * my * my + jz * mz * mz


@stage
def _square(penetration):
    """m^2, of a penetration; 0 if apart."""
    d = max(penetration, 0.0)
    return d * d


@cached_by_features
def make_energy_correction(features):
    """Stage for the slots of a half-pair of balls or capsules against a box."""
    compound, remembered_face = features.compound, contact_memory(features).face
    axial, turn = features.axial, facing(BOX)

    @stage
    def correct_energy(slots, candidate, relative, constants, h):
        R, c = relative.rotation, relative.position
        v, omega = relative.velocity, relative.angular_velocity
        force, torque = relative.force, relative.torque
        radii, core, stiffness = constants.radius, constants.core, constants.stiffness
        pair_mass, inverse_inertia = constants.pair_mass, constants.surface_inverse_inertia
        centre, turns = constants.surface_centre, constants.axial != 0
        for n in range(slots):
            row = candidate[n]
            for i in range(LANES):
                x, y, z = row.sample[0, i], row.sample[1, i], row.sample[2, i]
                ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
                if axial:
                    tx, ty = turn(x, y, z, R, c, i, ca, cb, cc)
                    x, y = tx if turns else x, ty if turns else y
                rx = R[0, i] * x + R[1, i] * y + R[2, i] * z
                ry = R[3, i] * x + R[4, i] * y + R[5, i] * z
                rz = R[6, i] * x + R[7, i] * y + R[8, i] * z
                sx = 0.5 * h * (v[0, i] + omega[1, i] * rz - omega[2, i] * ry)
                sy = 0.5 * h * (v[1, i] + omega[2, i] * rx - omega[0, i] * rz)
                sz = 0.5 * h * (v[2, i] + omega[0, i] * ry - omega[1, i] * rx)
                px, py, pz = rx + c[0, i], ry + c[1, i], rz + c[2, i]
                radius, face, weight = at(radii, i), row.memory[remembered_face, i], row.weight[i]
                wx = wy = wz = 0.0
                if compound:
                    hidden = row.hidden_offset
                    wx, wy, wz = hidden[0, i], hidden[1, i], hidden[2, i]
                start = box_distance(
                    px - sx, py - sy, pz - sz, ca, cb, cc, face, radius, False, wx, wy, wz
                )[0]
                middle, nx, ny, nz, face = box_distance(
                    px, py, pz, ca, cb, cc, face, radius, False, wx, wy, wz
                )
                end = box_distance(
                    px + sx, py + sy, pz + sz, ca, cb, cc, face, radius, False, wx, wy, wz
                )[0]
                d, along = radius - middle, sx * nx + sy * ny + sz * nz
                due = _square(radius - start) - _square(radius - end)
                excess = _square(d + along) - _square(d - along) - due
                square = sx * sx + sy * sy + sz * sz
                # round-off can leave an excess where nothing moves, as in a hand that holds a ball
                acts = (d > 0.0) & (excess > 0.0) & (square > 0.0) & (weight > 0.0)
                if compound:
                    acts &= max(wx, max(wy, wz)) < math.inf  # hidden by another part
                rotational = rotational_inverse_mass(
                    at(inverse_inertia[0], i),
                    at(inverse_inertia[1], i),
                    at(inverse_inertia[2], i),
                    px - at(centre[0], i),
                    py - at(centre[1], i),
                    pz - at(centre[2], i),
                    sx,
                    sy,
                    sz,
                )
                # f |2 s| = k/2 excess, of a force f along s; f h = m |2 s| / h stops the centre
                inverse_mass = square / at(pair_mass, i) + rotational  # times |s|^2
                stop = 2.0 * square * square / (h * h * inverse_mass)
                removed = min(0.25 * at(stiffness, i) * excess, stop)
                factor = weight * removed / square
                fx = -factor * sx if acts else 0.0
                fy = -factor * sy if acts else 0.0
                fz = -factor * sz if acts else 0.0
                force[0, i] += fx
                force[1, i] += fy
                force[2, i] += fz
                torque[0, i] += ry * fz - rz * fy
                torque[1, i] += rz * fx - rx * fz
                torque[2, i] += rx * fy - ry * fx

    return correct_energy
