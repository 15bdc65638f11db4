"""Distance of a point from the core of a surface, and the outward normal there.

Points are in the frame of the surface. All functions are free of branches, so that LLVM can
vectorise the loops around them, and return (distance m, normal x y z); those of a box and of a
cylinder also the face.
"""

import math

from physics.compiler.jit import stage
from physics.scene.shapes import BOX, CAPSULE, CYLINDER, PLANE, TORUS


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
def torus_distance(x, y, z, radius, b, c):
    """From the circle of a radius about z; on the circle the normal is z."""
    across = math.sqrt(x * x + y * y)
    inverse = 1.0 / max(across, 1e-150)
    ux, uy = x * inverse if across > 1e-150 else 1.0, y * inverse
    q = across - radius
    d = math.sqrt(q * q + z * z)
    inverse = 1.0 / max(d, 1e-150)
    return d, q * inverse * ux, q * inverse * uy, z * inverse if d > 1e-150 else 1.0


@stage
def cylinder_distance(x, y, z, a, b, half_length, face, radius, face_normals):
    """From a cylinder of radius a along z; negative inside.

    The rules are those of `box_distance`. The faces to remember: +-3 for +-z, 1 for the side.
    """
    across = math.sqrt(x * x + y * y)
    inverse = 1.0 / max(across, 1e-150)
    ux, uy = x * inverse if across > 1e-150 else 1.0, y * inverse
    hr, hz = across - a, abs(z) - half_length
    outside = max(hr, hz) > 0.0

    # height over the remembered face, and distance beyond its border
    on_end = abs(face) == 3.0
    over = math.copysign(1.0, face) * z - half_length if on_end else hr
    beside = hr if on_end else hz
    lasting = (over < radius) & (beside < radius) if face_normals else not outside
    known = lasting & (face != 0.0)

    end = on_end if known else hz > hr
    outward = math.copysign(1.0, face if known else z)
    height = over if known else max(hr, hz)
    beyond = hr if end else hz
    flat = height if beyond < radius else max(height, beyond)

    round_off = outside & (not face_normals)
    out_r, out_z = max(hr, 0.0), max(hz, 0.0)
    out = math.sqrt(out_r * out_r + out_z * out_z)
    inverse = 1.0 / max(out, 1e-150)
    radial = out_r * inverse if round_off else (0.0 if end else 1.0)
    axial = math.copysign(out_z * inverse, z) if round_off else (outward if end else 0.0)
    distance = out if round_off else flat
    return distance, radial * ux, radial * uy, axial, 3.0 * outward if end else 1.0


@stage
def _pick(on_x, on_y, x, y, z):
    """One of three numbers."""
    return x if on_x else (y if on_y else z)


@stage
def box_distance(x, y, z, a, b, c, face, radius, face_normals, wx=0.0, wy=0.0, wz=0.0):
    """From a box of half extents a, b, c; negative inside.

    With `face_normals` false (samples of balls and capsules) the nearest point decides: a ball
    rolls over the box's edges. With `face_normals` true (samples of another box) the normal is
    always that of a face. Stacked boxes have all their samples near edges, where a normal from the
    nearest point leans sideways and would drive the stack apart. Such a sample stays on a face
    until it is `radius`, the rounding of both boxes together, beyond the face's border.

    Args:
        x: m, of the point.
        y: likewise.
        z: likewise.
        a: m, half extent.
        b: likewise.
        c: likewise.
        face: through which the point came in: +-1 for +-x, +-2 for y, +-3 for z. It decides while
            the point is in contact, because below the rounding the nearest face may be the wrong
            one beside an edge. 0: a point inside leaves by the nearest face.
        radius: m.
        face_normals: see above.
        wx: m by which the faces across x count as farther out, because another part of a compound
            hides them, see `internal_faces`; else 0.
        wy: likewise.
        wz: likewise.

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

    # height over the remembered face, and distance beyond its border
    axis = abs(face)
    first, second = axis == 1.0, axis == 2.0
    sign = math.copysign(1.0, face)
    over = sign * _pick(first, second, x, y, z) - _pick(first, second, a, b, c)
    beside = max(qy if first else qx, qy if axis == 3.0 else qz)
    lasting = (over < radius) & (beside < radius) if face_normals else not outside
    known = lasting & (face != 0.0) & (_pick(first, second, wx, wy, wz) == 0.0)

    on_x = first if known else qx >= max(qy, qz)
    on_y = second if known else (not on_x) & (qy >= qz)
    outward = sign if known else math.copysign(1.0, _pick(on_x, on_y, x, y, z))
    ix = outward if on_x else 0.0
    iy = outward if on_y else 0.0
    iz = 0.0 if on_x | on_y else outward
    height = over if known else _pick(on_x, on_y, hx, hy, hz)
    beyond = max(qy if on_x else qx, qz if on_x | on_y else qy)

    round_off = outside & (not face_normals)
    inverse = 1.0 / max(out, 1e-150)
    nx = math.copysign(ox * inverse, x) if round_off else ix
    ny = math.copysign(oy * inverse, y) if round_off else iy
    nz = math.copysign(oz * inverse, z) if round_off else iz
    flat = height if beyond < radius else max(height, beyond)
    return out if round_off else flat, nx, ny, nz, ix + 2.0 * iy + 3.0 * iz


@stage
def _plane(x, y, z, a, b, c, radius, face_normals):
    return z - a, 0.0, 0.0, 1.0


@stage
def _box(x, y, z, a, b, c, radius, face_normals):
    d, nx, ny, nz, _ = box_distance(x, y, z, a, b, c, 0.0, radius, face_normals)
    return d, nx, ny, nz


@stage
def _sphere(x, y, z, a, b, c, radius, face_normals):
    return sphere_distance(x, y, z, a, b, c)


@stage
def _capsule(x, y, z, a, b, c, radius, face_normals):
    return capsule_distance(x, y, z, a, b, c)


@stage
def _cylinder(x, y, z, a, b, c, radius, face_normals):
    d, nx, ny, nz, _ = cylinder_distance(x, y, z, a, b, c, 0.0, radius, face_normals)
    return d, nx, ny, nz


@stage
def _torus(x, y, z, a, b, c, radius, face_normals):
    return torus_distance(x, y, z, a, b, c)


_CORES = {PLANE: _plane, BOX: _box, CAPSULE: _capsule, CYLINDER: _cylinder, TORUS: _torus}


def core_distance(kind):
    """Distance from the core of one kind of surface, without memory of a face."""
    return _CORES.get(kind, _sphere)
