"""Where a candidate touches: point, normal and penetration, in the frame of the surface.

The contact point lies on the line from the sample along the normal, within the overlap. On the
undeformed surface of a body friction would have the arm that a rigid body has. But both bodies need
the same point, or angular momentum is not conserved. So their surfaces yield, each by a part of the
overlap that is proportional to its own mass: between equal bodies the point is in the middle.
Grounds, statics and drives never rotate, so their arm doesn't matter, and only they yield.
"""

import math

from physics.collision.distances import (
    box_distance,
    capsule_distance,
    cylinder_distance,
    sphere_distance,
    torus_distance,
)
from physics.collision.facing import FLOORS, facing
from physics.compiler.jit import stage
from physics.model.contact_memory import contact_memory
from physics.model.features import cached_by_features
from physics.scene.shapes import BOX, CAPSULE, CYLINDER, GRID, PARTICLES, PLANE, TORUS

# m: samples that come within this distance count as touching, so that a face that arrives just then
# does not touch with some of its corners only, chosen by round-off
TOUCH_TOLERANCE = 1e-9
# the face of a box reported for a sample that another part of the compound hides from it
HIDDEN = 9.0


@cached_by_features
def make_touch(features, kind):
    """Formula for samples against one kind of surface."""
    plane, particles, box = kind == PLANE, kind == PARTICLES, kind == BOX
    grid = kind == GRID
    compound, remembered_face = features.compound, contact_memory(features).face
    cylinder = kind == CYLINDER
    surface_distance = {CAPSULE: capsule_distance, TORUS: torus_distance}.get(kind, sphere_distance)
    turn, turns = facing(kind), features.axial and kind in FLOORS

    @stage
    def touch(row, i, R, c, ca, cb, cc, radius, owner_radius, overlap_share, face_normals, axial):
        """Of the candidate in lane i of a slot.

        Args:
            row: the slot.
            i: the lane.
            R: the owner's rotation relative to the surface.
            c: m, the owner's position relative to the surface.
            ca: m, first parameter of the surface's core.
            cb: m, its second.
            cc: m, its third.
            radius: m, of sample and surface together.
            owner_radius: m, of the sample.
            overlap_share: part of the overlap by which the owner's surface yields.
            face_normals: see `box_distance`.
            axial: see `facing`.

        Returns:
            Arm x y z in m from the owner's centre to the contact point, normal x y z out of the
            surface, penetration in m (negative if apart), and the face of a box or cylinder to
            remember, else 0; HIDDEN where another part of a compound hides the face that the sample
            is over.
        """
        x, y, z = row.sample[0, i], row.sample[1, i], row.sample[2, i]
        if turns:
            tx, ty = turn(x, y, z, R, c, i, ca, cb, cc)
            x, y = tx if axial else x, ty if axial else y
        rx = R[0, i] * x + R[1, i] * y + R[2, i] * z
        ry = R[3, i] * x + R[4, i] * y + R[5, i] * z
        rz = R[6, i] * x + R[7, i] * y + R[8, i] * z
        if plane:
            penetration = radius - (rz + (c[2, i] - ca))
            return rx, ry, rz - owner_radius, 0.0, 0.0, 1.0, penetration, 0.0
        px, py, pz = rx + c[0, i], ry + c[1, i], rz + c[2, i]
        face = 0.0
        if particles:
            px -= row.partner[0, i]
            py -= row.partner[1, i]
            pz -= row.partner[2, i]
        if box and compound:
            face = row.memory[remembered_face, i]
            wx, wy, wz = row.hidden_offset[0, i], row.hidden_offset[1, i], row.hidden_offset[2, i]
            distance, nx, ny, nz, face = box_distance(
                px, py, pz, ca, cb, cc, face, radius, face_normals, wx, wy, wz
            )
            face = HIDDEN if max(wx, max(wy, wz)) == math.inf else face
        elif box:
            face = row.memory[remembered_face, i]
            distance, nx, ny, nz, face = box_distance(
                px, py, pz, ca, cb, cc, face, radius, face_normals
            )
        elif cylinder:
            face = row.memory[remembered_face, i]
            distance, nx, ny, nz, face = cylinder_distance(
                px, py, pz, ca, cb, cc, face, radius, face_normals
            )
        elif grid:  # `grid_distances` has looked it up
            distance, nx, ny, nz = (
                row.distance[i],
                row.normal[0, i],
                row.normal[1, i],
                row.normal[2, i],
            )
        else:
            distance, nx, ny, nz = surface_distance(px, py, pz, ca, cb, cc)
        penetration = radius - distance
        arm = owner_radius - overlap_share * penetration
        return rx - arm * nx, ry - arm * ny, rz - arm * nz, nx, ny, nz, penetration, face

    return touch
