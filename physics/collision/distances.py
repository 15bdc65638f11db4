"""Distance of a point from the core of a surface, and the outward normal there.

Points are in the surface's own frame. Each function is free of branches that a vector lane can't
take, and returns (distance m, normal x y z) and, for a box, the face.
"""

import math

from physics.jit import stage


@stage
def sphere_distance(x, y, z, a, b, c):
    """From a sphere's centre; at the very centre the normal is z."""
    d2 = x * x + y * y + z * z
    d = math.sqrt(d2)
    inverse = 1.0 / max(d, 1e-150)
    return d, x * inverse, y * inverse, z * inverse if d > 1e-150 else 1.0


@stage
def capsule_distance(x, y, z, a, b, half_length):
    """From the segment |z| <= half_length of the z axis; on it the normal is x."""
    z = z - min(max(z, -half_length), half_length)
    d = math.sqrt(x * x + y * y + z * z)
    inverse = 1.0 / max(d, 1e-150)
    return d, x * inverse if d > 1e-150 else 1.0, y * inverse, z * inverse


@stage
def _pick(on_x, on_y, x, y, z):
    """One of three numbers."""
    return x if on_x else (y if on_y else z)


@stage
def box_distance(x, y, z, a, b, c, face, radius, sharp, wx=0.0, wy=0.0, wz=0.0):
    """From a box of half extents a, b, c; negative inside.

    A ball rolls over the box's edges: outside, the nearest point decides (`sharp` false). The
    corner or edge of another box is pushed out by faces alone (`sharp` true): near an edge, where
    equal boxes have all their samples when they are stacked, a normal from the nearest point leans
    out sideways, and would drive the stack apart. It rests on a face until it is `radius`, which is
    all that rounds both boxes, beyond the face's border.

    `face`, by which the point came, decides while it is in contact: +-1 for +-x, 2 for y, 3 for z.
    Deeper than the rounding, the nearest face may be the wrong side of an edge. Without one, 0, a
    point inside leaves by the nearest.

    `wx`, `wy` and `wz` are 0, or m that the faces across that axis are taken to be farther out: of
    a compound's parts, others hide some, see `physics.scene.internal_faces`.

    Returns:
        distance m, normal x y z, and the face to remember.
    """
    hx = abs(x) - a
    hy = abs(y) - b
    hz = abs(z) - c
    qx, qy, qz = hx - wx, hy - wy, hz - wz
    ox = max(qx, 0.0)
    oy = max(qy, 0.0)
    oz = max(qz, 0.0)
    out = math.sqrt(ox * ox + oy * oy + oz * oz)
    outside = max(qx, max(qy, qz)) > 0.0

    # the remembered face, and how far the point is over it and beyond its border
    axis = abs(face)
    first, second = axis == 1.0, axis == 2.0
    sign = math.copysign(1.0, face)
    over = sign * _pick(first, second, x, y, z) - _pick(first, second, a, b, c)
    beside = max(qy if first else qx, qy if axis == 3.0 else qz)
    lasting = (over < radius) & (beside < radius) if sharp else not outside
    known = lasting & (face != 0.0) & (_pick(first, second, wx, wy, wz) == 0.0)

    on_x = first if known else qx >= max(qy, qz)
    on_y = second if known else (not on_x) & (qy >= qz)
    side = sign if known else math.copysign(1.0, _pick(on_x, on_y, x, y, z))
    ix = side if on_x else 0.0
    iy = side if on_y else 0.0
    iz = 0.0 if on_x | on_y else side
    height = over if known else _pick(on_x, on_y, hx, hy, hz)
    beyond = max(qy if on_x else qx, qz if on_x | on_y else qy)

    round_off = outside & (not sharp)
    inverse = 1.0 / max(out, 1e-150)
    nx = math.copysign(ox * inverse, x) if round_off else ix
    ny = math.copysign(oy * inverse, y) if round_off else iy
    nz = math.copysign(oz * inverse, z) if round_off else iz
    flat = height if beyond < radius else max(height, beyond)
    return out if round_off else flat, nx, ny, nz, ix + 2.0 * iy + 3.0 * iz
