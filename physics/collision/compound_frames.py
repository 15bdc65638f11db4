"""Frames of compound parts, in which their surfaces are described.

A part moves with its solid, which alone has mass: forces and impulses act on the solid. Where
another part hides a face of a box, the box ignores samples over that face, and a sample inside the
box does not leave through it, see `physics.scene.internal_faces`.
"""

import math

from physics.compiler.jit import LANES, at, stage
from physics.model.features import cached_by_features
from physics.motion.vectors import rotated


@cached_by_features
def make_compound_frames(features):
    """Stage that updates the frames of compound parts, if there are any."""
    compound = features.compound

    @stage
    def compound_frames(model, workspace):
        if compound:
            place_compound_parts(model, workspace)

    return compound_frames


@stage
def place_compound_parts(model, workspace):
    """Updates the frames of all parts from those of their solids."""
    first = model.dynamic.shape[0] + model.static.shape[0]
    for q in range(model.compound_part.shape[0]):
        constants, part = model.compound_part[q], workspace.solid[first + q]
        solid, place, turn = (
            workspace.solid[constants.solid],
            constants.position,
            constants.rotation,
        )
        R, c, v, omega = solid.rotation, solid.position, solid.velocity, solid.angular_velocity
        Q, b, u, spin = part.rotation, part.position, part.velocity, part.angular_velocity
        for column in range(3):
            for i in range(LANES):
                x, y, z = rotated(R, i, turn[column], turn[3 + column], turn[6 + column])
                Q[column, i] = x
                Q[3 + column, i] = y
                Q[6 + column, i] = z
        for i in range(LANES):
            x, y, z = rotated(R, i, at(place[0], i), at(place[1], i), at(place[2], i))
            b[0, i] = c[0, i] + x
            b[1, i] = c[1, i] + y
            b[2, i] = c[2, i] + z
            u[0, i] = v[0, i] + omega[1, i] * z - omega[2, i] * y
            u[1, i] = v[1, i] + omega[2, i] * x - omega[0, i] * z
            u[2, i] = v[2, i] + omega[0, i] * y - omega[1, i] * x
            spin[0, i] = omega[0, i]
            spin[1, i] = omega[1, i]
            spin[2, i] = omega[2, i]


@stage
def mark_hidden_faces(model, k, candidate, relative):
    """Writes by how much hidden faces of a box count as farther out, for a half-pair's candidates.

    The box's smallest half extent for a sample inside the box, infinity for one beyond the face.
    """
    half_pair = model.half_pair[k]
    q = half_pair.frame - model.dynamic.shape[0] - model.static.shape[0]
    if q < 0 or model.compound_part[q].hidden_face_count == 0:
        return
    R, c, core, sizes = relative.rotation, relative.position, half_pair.core, half_pair.surface_size
    part = model.compound_part[q]
    first, count = part.first_hidden_face, part.hidden_face_count
    for n in range(candidate.shape[0]):
        row = candidate[n]
        for axis in range(3):
            for i in range(LANES):
                row.hidden_offset[axis, i] = 0.0
        for s in range(first, first + count):
            hidden = model.hidden_face[s]
            axis, sign, face = hidden.axis, hidden.sign, hidden.face
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
                over = (p > 0.0) & (u >= size * hidden.low[0]) & (u <= size * hidden.high[0])
                over = over & (v >= size * hidden.low[1]) & (v <= size * hidden.high[1])
                least = min(at(core[0], i), min(at(core[1], i), at(core[2], i)))
                far = math.inf if p > size * face else least
                row.hidden_offset[axis, i] = (
                    max(row.hidden_offset[axis, i], far) if over else row.hidden_offset[axis, i]
                )
