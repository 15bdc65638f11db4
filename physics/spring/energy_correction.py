"""Force that stops a ball from gaining energy where its normal leaps between two faces of a box.

A kick takes the normal at the present position for the whole step. That errs little while the
normal turns little. But a ball that sinks so deep that its centre passes close by an edge of the
box's core, or through it, is pressed by one face in one half of the step and by another in the
other. With the half step s = h u / 2 of its centre as seen from the box, and overlaps d- d d+ at
the step's start, middle and end, the spring should do the work k/2 (d-^2 - d+^2), and does, along
its normal n, k/2 ((d + s.n)^2 - (d - s.n)^2), no overlap counted below 0. (`overlap_force` has the
same mean over the drift.) On a flat face they are equal. Of what it does too much, a force against
u takes back, at most until the centre rests. What it does too little is lost: energy only falls by
what a step doesn't resolve. Capsules meet boxes likewise; boxes meet each other by faces alone.

The force acts at the ball's centre, and no report of contacts has it.
"""

import math
from functools import cache

from physics.collision.distances import box_distance
from physics.jit import LANES, at, kernel, stage

# half steps of the centre's way within which it is near the core: elsewhere nothing changes
_NEAR = 8.0


@stage
def turned_by(jx, jy, jz, x, y, z, nx, ny, nz):
    """1/kg that turning adds to a body's inverse mass at p from its centre: (p x n)^2 / J."""
    mx, my, mz = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
    return jx * mx * mx + jy * my * my + jz * mz * mz


@stage
def _square(overlap):
    """m^2, of an overlap; 0 if apart."""
    d = max(overlap, 0.0)
    return d * d


@cache
def make_leaps(compound):
    """Kernel for the slots of a side that isn't `sharp`, in a scene with compounds or without."""

    @kernel
    def leaps(slots, candidate, seen, constants, h):
        R, c, v, omega = seen.rotation, seen.position, seen.velocity, seen.spin
        force, torque = seen.force, seen.torque
        radii, core, stiffness = constants.radius, constants.core, constants.stiffness
        pair_mass, yielding = constants.pair_mass, constants.yielding
        centre = constants.surface_centre
        for n in range(slots):
            row = candidate[n]
            for i in range(LANES):
                x, y, z = row.sample[0, i], row.sample[1, i], row.sample[2, i]
                rx = R[0, i] * x + R[1, i] * y + R[2, i] * z
                ry = R[3, i] * x + R[4, i] * y + R[5, i] * z
                rz = R[6, i] * x + R[7, i] * y + R[8, i] * z
                sx = 0.5 * h * (v[0, i] + omega[1, i] * rz - omega[2, i] * ry)
                sy = 0.5 * h * (v[1, i] + omega[2, i] * rx - omega[0, i] * rz)
                sz = 0.5 * h * (v[2, i] + omega[0, i] * ry - omega[1, i] * rx)
                px, py, pz = rx + c[0, i], ry + c[1, i], rz + c[2, i]
                ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
                radius, face, weight = at(radii, i), row.face[i], row.weight[i]
                wx = wy = wz = 0.0
                if compound:
                    wx, wy, wz = row.cover[0, i], row.cover[1, i], row.cover[2, i]
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
                near = _square(middle) < _NEAR * _NEAR * square
                acts = near & (d > 0.0) & (excess > 0.0) & (weight > 0.0)
                if compound:
                    acts &= max(wx, max(wy, wz)) < math.inf  # hidden by another part
                turning = turned_by(
                    at(yielding[0], i),
                    at(yielding[1], i),
                    at(yielding[2], i),
                    px - at(centre[0], i),
                    py - at(centre[1], i),
                    pz - at(centre[2], i),
                    sx,
                    sy,
                    sz,
                )
                # f |2 s| = k/2 excess, of a force f along s; f h = m |2 s| / h stops the centre
                inverse_mass = square / at(pair_mass, i) + turning  # times |s|^2
                taken = min(
                    0.25 * at(stiffness, i) * excess, 2.0 * square * square / (h * h * inverse_mass)
                )
                share = weight * taken / square
                fx = -share * sx if acts else 0.0
                fy = -share * sy if acts else 0.0
                fz = -share * sz if acts else 0.0
                force[0, i] += fx
                force[1, i] += fy
                force[2, i] += fz
                torque[0, i] += ry * fz - rz * fy
                torque[1, i] += rz * fx - rx * fz
                torque[2, i] += rx * fy - ry * fx

    return leaps
