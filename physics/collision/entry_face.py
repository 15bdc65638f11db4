"""Through which face of a box or cylinder samples came in, where no memory tells it.

A sample remembers its face while it is in contact, see `box_distance`. One that overlaps and is new
in the list has nothing to remember: the state was set from outside, or the impulse law had left the
sample out of its four. The nearest face may be the wrong one: of two cubes on each other all
samples lie at edges, and once the overlap exceeds the rounding a side is nearer. So the face is
chosen for all overlapping samples of the half-pair together: the one through which all of them get
out on the shortest way.
"""

import math

from physics.compiler.jit import at, stage
from physics.model.features import cached_by_features
from physics.scene.shapes import BOX


@stage
def box_entry(low, high, a, b, c):
    """Face of a box, as in `box_distance`: half extents a b c, bounds x y z of what overlaps it."""
    face, shortest = 1.0, a - low[0]
    ways = (a + high[0], b - low[1], b + high[1], c - low[2], c + high[2])
    faces = (-1.0, 2.0, -2.0, 3.0, -3.0)
    for way, other in zip(ways, faces):  # noqa: B905 (numba knows no strict)
        if way < shortest:
            face, shortest = other, way
    return face


@stage
def cylinder_entry(low, high, nearest, a, half_length):
    """Face of a cylinder, as in `cylinder_distance`.

    Of what overlaps, `low` and `high` are the bounds along z, and `nearest` is the lower bound in
    the direction across z in which the owner lies.
    """
    face, shortest = 3.0, half_length - low
    if half_length + high < shortest:
        face, shortest = -3.0, half_length + high
    return 1.0 if a - nearest < shortest else face


@cached_by_features
def make_entry_face(features, turn):
    """Stage that finds the face for a half-pair in one lane; 0 if nothing overlaps.

    `turn` turns samples, see `facing`; `workspace.separation` has their separations.
    """
    per_world_parameters, axial = features.per_world_parameters, features.axial

    @stage
    def entry_face(model, workspace, half_pair, i, relative):
        R, c, core = relative.rotation, relative.position, half_pair.core
        ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
        across = math.sqrt(c[0, i] * c[0, i] + c[1, i] * c[1, i])
        ux, uy = (c[0, i] / across, c[1, i] / across) if across > 0.0 else (1.0, 0.0)
        low_x = low_y = low_z = nearest = math.inf
        high_x = high_y = high_z = -math.inf
        for s in range(half_pair.sample_count):
            if workspace.separation[s] < 0.0:
                first = half_pair.first_sample
                sx, sy = model.sample[0, first + s], model.sample[1, first + s]
                sz = model.sample[2, first + s]
                if per_world_parameters:
                    size = at(half_pair.owner_size, i)
                    sx, sy, sz = size * sx, size * sy, size * sz
                if axial and half_pair.axial != 0:
                    sx, sy = turn(half_pair.kind, sx, sy, sz, R, c, i, ca, cb, cc)
                x = R[0, i] * sx + R[1, i] * sy + R[2, i] * sz + c[0, i]
                y = R[3, i] * sx + R[4, i] * sy + R[5, i] * sz + c[1, i]
                z = R[6, i] * sx + R[7, i] * sy + R[8, i] * sz + c[2, i]
                low_x, high_x = min(low_x, x), max(high_x, x)
                low_y, high_y = min(low_y, y), max(high_y, y)
                low_z, high_z = min(low_z, z), max(high_z, z)
                nearest = min(nearest, x * ux + y * uy)
        if high_x < low_x:
            return 0.0
        if half_pair.kind == BOX:
            return box_entry((low_x, low_y, low_z), (high_x, high_y, high_z), ca, cb, cc)
        return cylinder_entry(low_z, high_z, nearest, ca, cc)

    return entry_face
