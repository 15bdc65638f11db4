"""Parts of compounds: frames of their own, for the geometry of their surfaces.

A part moves as its solid does, which alone has mass: forces and impulses act on that. Where another
part hides a face of a box, a sample that is over it is none of that box's business, and one within
the box doesn't leave by it, see `physics.scene.internal_faces`.
"""

import math
from functools import cache

from physics.jit import LANES, at, kernel, stage
from physics.motion.vectors import turned


@cache
def make_parts(features):
    """Stage that places the parts, if there are any."""
    compound = features.compound

    @stage
    def parts(model, work):
        if compound:
            place_parts(model, work)

    return parts


@stage
def place_parts(model, work):
    """Brings the frames of all parts up to those of their solids."""
    first = model.mover.shape[0] + model.static.shape[0]
    for q in range(model.part.shape[0]):
        constants, part = model.part[q], work.solid[first + q]
        solid, place, turn = work.solid[constants.solid], constants.position, constants.rotation
        R, c, v, omega = solid.rotation, solid.position, solid.velocity, solid.spin
        Q, b, u, spin = part.rotation, part.position, part.velocity, part.spin
        for column in range(3):
            for i in range(LANES):
                x, y, z = turned(R, i, turn[column], turn[3 + column], turn[6 + column])
                Q[column, i] = x
                Q[3 + column, i] = y
                Q[6 + column, i] = z
        for i in range(LANES):
            x, y, z = turned(R, i, at(place[0], i), at(place[1], i), at(place[2], i))
            b[0, i] = c[0, i] + x
            b[1, i] = c[1, i] + y
            b[2, i] = c[2, i] + z
            u[0, i] = v[0, i] + omega[1, i] * z - omega[2, i] * y
            u[1, i] = v[1, i] + omega[2, i] * x - omega[0, i] * z
            u[2, i] = v[2, i] + omega[0, i] * y - omega[1, i] * x
            spin[0, i] = omega[0, i]
            spin[1, i] = omega[1, i]
            spin[2, i] = omega[2, i]


@kernel
def hide(model, k, candidate, seen):
    """Writes how far hidden faces of a box count as farther out, for a side's candidates.

    By the box's least half extent for a sample within it, endlessly for one beyond the face.
    """
    side = model.side[k]
    q = side.frame - model.mover.shape[0] - model.static.shape[0]
    if q < 0 or model.part[q].cover_count == 0:
        return
    R, c, core, sizes = seen.rotation, seen.position, side.core, side.surface_size
    first, count = model.part[q].first_cover, model.part[q].cover_count
    for n in range(candidate.shape[0]):
        row = candidate[n]
        for axis in range(3):
            for i in range(LANES):
                row.cover[axis, i] = 0.0
        for s in range(first, first + count):
            cover = model.cover[s]
            axis, sign, face = cover.axis, cover.sign, cover.face
            second, third = (axis + 1) % 3, (axis + 2) % 3
            for i in range(LANES):
                x, y, z = row.sample[0, i], row.sample[1, i], row.sample[2, i]
                p, u, v = (
                    R[3 * axis, i] * x + R[3 * axis + 1, i] * y + R[3 * axis + 2, i] * z,
                    R[3 * second, i] * x + R[3 * second + 1, i] * y + R[3 * second + 2, i] * z,
                    R[3 * third, i] * x + R[3 * third + 1, i] * y + R[3 * third + 2, i] * z,
                )
                p, u, v = sign * (p + c[axis, i]), u + c[second, i], v + c[third, i]
                size = at(sizes, i)
                over = (p > 0.0) & (u >= size * cover.low[0]) & (u <= size * cover.high[0])
                over = over & (v >= size * cover.low[1]) & (v <= size * cover.high[1])
                least = min(at(core[0], i), min(at(core[1], i), at(core[2], i)))
                far = math.inf if p > size * face else least
                row.cover[axis, i] = max(row.cover[axis, i], far) if over else row.cover[axis, i]
