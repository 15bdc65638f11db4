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
def box_distance(x, y, z, a, b, c, face):
    """From a box of half extents a, b, c; negative inside.

    Inside, the face by which the point came in decides: the nearest one may be the wrong side of an
    edge. `face` is that face, +-1 for +-x, 2 for y, 3 for z, or 0 for a point that was inside from
    the start, which leaves by the nearest. The fifth result is the face to remember.
    """
    qx = abs(x) - a
    qy = abs(y) - b
    qz = abs(z) - c
    ox = max(qx, 0.0)
    oy = max(qy, 0.0)
    oz = max(qz, 0.0)
    out = math.sqrt(ox * ox + oy * oy + oz * oz)
    outside = max(qx, max(qy, qz)) > 0.0
    known = (not outside) & (face != 0.0)
    on_x = abs(face) == 1.0 if known else qx >= max(qy, qz)
    on_y = abs(face) == 2.0 if known else (not on_x) & (qy >= qz)
    ix = 1.0 if on_x else 0.0
    iy = 1.0 if on_y else 0.0
    iz = 1.0 - ix - iy
    side = math.copysign(1.0, face if known else ix * x + iy * y + iz * z)
    inverse = 1.0 / max(out, 1e-150)
    nx = math.copysign(ox * inverse, x) if outside else ix * side
    ny = math.copysign(oy * inverse, y) if outside else iy * side
    nz = math.copysign(oz * inverse, z) if outside else iz * side
    depth = side * (ix * x + iy * y + iz * z) - (ix * a + iy * b + iz * c)
    return out if outside else depth, nx, ny, nz, side * (ix + 2.0 * iy + 3.0 * iz)
