"""Parts of compounds: frames of their own, for the geometry of their surfaces.

A part moves as its solid does, which alone has mass: forces and impulses act on that.
"""

from functools import cache

from physics.jit import LANES, at, stage
from physics.stages.kinematics import turned


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
