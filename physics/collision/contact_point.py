"""Where a candidate touches: the point, the normal and the overlap, in the frame of the surface.

The contact point lies on the line from the sample along the normal. Between two solids it lies in
the middle of the overlap. The ground is taken as rigid and the solid's surface as undeformed: there
the point is the sample's lowest, so friction acts at the arm that a rigid body has. With the middle
of the overlap here, too, an oblique impact that sticks was 3e-3 off at `balanced`.
"""

import math
from functools import cache

from physics.collision.distances import box_distance, capsule_distance, sphere_distance
from physics.jit import stage
from physics.scene.shapes import BOX, CAPSULE, PARTICLES, PLANE

# m, of what will have touched: a face that arrives just then shall not, by round-off, land on some
# of its corners
ALMOST = 1e-9
# a face of a box that no sample has, see `touch`
HIDDEN = 9.0


@cache
def make_touch(kind, compound):
    """Formula for samples against one kind of surface, in a scene with compounds or without."""
    plane, particles, box = kind == PLANE, kind == PARTICLES, kind == BOX
    surface_distance = capsule_distance if kind == CAPSULE else sphere_distance

    @stage
    def touch(row, i, R, c, ca, cb, cc, radius, owner_radius, sharp):
        """Of the candidate in lane i of a slot.

        Args:
            row: the slot.
            i: the lane.
            R: the owner's rotation, as seen from the surface.
            c: m, the owner's position, likewise.
            ca: m, first parameter of the surface's core.
            cb: m, its second.
            cc: m, its third.
            radius: m, of sample and surface together.
            owner_radius: m, of the sample.
            sharp: see `box_distance`.

        Returns:
            Arm x y z in m from the owner's centre to the contact point, normal x y z out of the
            surface, overlap in m (negative if apart), and the face of a box to remember, else 0;
            HIDDEN where another part of a compound hides the face that the sample is over.
        """
        x, y, z = row.sample[0, i], row.sample[1, i], row.sample[2, i]
        rx = R[0, i] * x + R[1, i] * y + R[2, i] * z
        ry = R[3, i] * x + R[4, i] * y + R[5, i] * z
        rz = R[6, i] * x + R[7, i] * y + R[8, i] * z
        if plane:
            overlap = radius - (rz + (c[2, i] - ca))
            return rx, ry, rz - owner_radius, 0.0, 0.0, 1.0, overlap, 0.0
        px, py, pz = rx + c[0, i], ry + c[1, i], rz + c[2, i]
        face = 0.0
        if particles:
            px -= row.partner[0, i]
            py -= row.partner[1, i]
            pz -= row.partner[2, i]
        if box and compound:
            wx, wy, wz = row.cover[0, i], row.cover[1, i], row.cover[2, i]
            distance, nx, ny, nz, face = box_distance(
                px, py, pz, ca, cb, cc, row.face[i], radius, sharp, wx, wy, wz
            )
            face = HIDDEN if max(wx, max(wy, wz)) == math.inf else face
        elif box:
            distance, nx, ny, nz, face = box_distance(
                px, py, pz, ca, cb, cc, row.face[i], radius, sharp
            )
        else:
            distance, nx, ny, nz = surface_distance(px, py, pz, ca, cb, cc)
        overlap = radius - distance
        arm = owner_radius - 0.5 * overlap
        return rx - arm * nx, ry - arm * ny, rz - arm * nz, nx, ny, nz, overlap, face

    return touch
