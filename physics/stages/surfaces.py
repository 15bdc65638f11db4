"""Distance of a point from the core of a surface, and the outward normal there.

Points are in the surface's own frame. Each function is free of branches that a vector lane can't
take, and returns (distance m, normal x y z).
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
def box_distance(x, y, z, a, b, c):
    """From a box of half extents a, b, c; negative inside, where the nearest face decides."""
    qx = abs(x) - a
    qy = abs(y) - b
    qz = abs(z) - c
    ox = max(qx, 0.0)
    oy = max(qy, 0.0)
    oz = max(qz, 0.0)
    out = math.sqrt(ox * ox + oy * oy + oz * oz)
    deepest = max(qx, max(qy, qz))
    outside = deepest > 0.0
    inverse = 1.0 / max(out, 1e-150)
    on_x = qx >= max(qy, qz)
    on_y = (not on_x) & (qy >= qz)
    ix = 1.0 if on_x else 0.0
    iy = 1.0 if on_y else 0.0
    nx = ox * inverse if outside else ix
    ny = oy * inverse if outside else iy
    nz = oz * inverse if outside else 1.0 - ix - iy
    return (
        out if outside else deepest,
        math.copysign(nx, x),
        math.copysign(ny, y),
        math.copysign(nz, z),
    )
