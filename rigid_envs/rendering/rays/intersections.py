"""Where a ray meets a shape, in the shape's own frame.

A ray is o + t e, its direction e of any length. Every function returns the least t >= 0 at which
the ray enters the shape, or infinity, and the outward unit normal there. Where o lies inside a
shape, t is 0. A shape's size is three numbers (a, b, c), whose meaning each function tells. A new
shape joins by one such function, and a line in `intersection`.
"""

import math

from physics.compiler.jit import stage

SPHERE, BOX, CAPSULE, CYLINDER, TORUS, TRIANGLE = range(6)
FAR = 1e300  # in place of 1 / 0
_STEPS = 40  # at most, along a ray to a torus; rays that meet it need about ten
_CLOSE = 1e-9  # of a torus's reach, where a ray has met it


@stage
def ray_and_sphere(ox, oy, oz, ex, ey, ez, radius):
    """A sphere about the origin."""
    ee = ex * ex + ey * ey + ez * ez
    oe = ox * ex + oy * ey + oz * ez
    inside = ox * ox + oy * oy + oz * oz - radius * radius
    root = oe * oe - ee * inside
    t = (-oe - math.sqrt(max(root, 0.0))) / ee
    if (root < 0.0) | ((oe > 0.0) & (inside > 0.0)):
        t = math.inf
    t = max(t, 0.0)
    k = 1.0 / radius
    return t, k * (ox + t * ex), k * (oy + t * ey), k * (oz + t * ez)


@stage
def ray_and_box(ox, oy, oz, ex, ey, ez, a, b, c):
    """A box of half extents a, b, c about the origin: the ray is within three slabs at once."""
    ix = 1.0 / ex if ex != 0.0 else FAR
    iy = 1.0 / ey if ey != 0.0 else FAR
    iz = 1.0 / ez if ez != 0.0 else FAR
    mx, my, mz = -ox * ix, -oy * iy, -oz * iz
    hx, hy, hz = abs(ix) * a, abs(iy) * b, abs(iz) * c
    near = max(mx - hx, max(my - hy, mz - hz))
    far = min(mx + hx, min(my + hy, mz + hz))
    t = math.inf if (near > far) | (far < 0.0) else max(near, 0.0)
    on_x = mx - hx >= near
    on_y = (my - hy >= near) & (not on_x)
    nx = math.copysign(1.0, -ex) if on_x else 0.0
    ny = math.copysign(1.0, -ey) if on_y else 0.0
    nz = 0.0 if on_x | on_y else math.copysign(1.0, -ez)
    return t, nx, ny, nz


@stage
def ray_and_tube(ox, oy, ex, ey, radius):
    """The interval of t within an infinite cylinder about z; empty (inf, -inf) if there is none."""
    ee = ex * ex + ey * ey
    oe = ox * ex + oy * ey
    inside = ox * ox + oy * oy - radius * radius
    root = oe * oe - ee * inside
    if ee < 1e-300:  # along the axis
        return (-math.inf, math.inf) if inside <= 0.0 else (math.inf, -math.inf)
    if root < 0.0:
        return math.inf, -math.inf
    root = math.sqrt(root)
    return (-oe - root) / ee, (-oe + root) / ee


@stage
def ray_and_capsule(ox, oy, oz, ex, ey, ez, radius, half_length):
    """Points within `radius` of the segment |z| <= half_length: a tube, or the ball at an end."""
    low, _ = ray_and_tube(ox, oy, ex, ey, radius)
    t, z = low, oz + low * ez
    if not (abs(z) <= half_length):
        # the end that the ray passes first, then the other one
        t = math.inf
        for side in (-1.0, 1.0):
            at, _, _, _ = ray_and_sphere(ox, oy, oz - side * half_length, ex, ey, ez, radius)
            t = min(t, at)
    end = oz - min(max(oz, -half_length), half_length)
    inside = ox * ox + oy * oy + end * end <= radius * radius
    t = 0.0 if inside else (t if t >= 0.0 else math.inf)
    x, y, z = ox + t * ex, oy + t * ey, oz + t * ez
    z -= min(max(z, -half_length), half_length)
    k = 1.0 / radius
    return t, k * x, k * y, k * z


@stage
def ray_and_cylinder(ox, oy, oz, ex, ey, ez, radius, half_length):
    """A cylinder about z with flat ends: the ray is within the tube and the slab at once."""
    low, high = ray_and_tube(ox, oy, ex, ey, radius)
    iz = 1.0 / ez if ez != 0.0 else FAR
    mz, hz = -oz * iz, abs(iz) * half_length
    near, far = max(low, mz - hz), min(high, mz + hz)
    t = math.inf if (near > far) | (far < 0.0) else max(near, 0.0)
    if mz - hz >= low:
        return t, 0.0, 0.0, math.copysign(1.0, -ez)
    k = 1.0 / radius
    return t, k * (ox + t * ex), k * (oy + t * ey), 0.0


@stage
def ray_and_triangle(ox, oy, oz, ex, ey, ez, a, b, c):
    """A triangle at z = 0 with the corners (-a, 0), (a, 0) and (b, c), seen from both sides."""
    t = -oz / ez if ez != 0.0 else math.inf
    x, y = ox + t * ex, oy + t * ey
    # to the left of all three edges; c is positive
    left = (x + a) * c - y * (b + a)
    right = (a - x) * c + y * (b - a)
    if not ((t >= 0.0) & (y >= 0.0) & (left >= 0.0) & (right >= 0.0)):
        t = math.inf
    return t, 0.0, 0.0, math.copysign(1.0, -ez)


@stage
def ray_and_torus(ox, oy, oz, ex, ey, ez, ring, radius):
    """Points within `radius` of the circle of radius `ring` about z.

    The search moves along the ray by steps that can't pass the surface. With the gap g to it, its
    slope s along the ray, and the ray's distance w from the axis, the gap after h is at least
    g + s h - h^2 / (2 w), as nothing but the circle's own curvature, at most 1 / w, bends the
    surface towards the ray. Half of w is used, and steps are no longer, as w changes. Near the
    surface these are Newton's steps.
    """
    k = 1.0 / math.sqrt(ex * ex + ey * ey + ez * ez)
    reach = ring + radius
    low, high = ray_and_tube(ox, oy, ex, ey, reach)
    iz = 1.0 / ez if ez != 0.0 else FAR
    mz, hz = -oz * iz, abs(iz) * radius
    t, end = max(low, max(mz - hz, 0.0)), min(high, mz + hz)  # within a cylinder around it
    gap = math.inf
    if t <= end:
        for _ in range(_STEPS):
            x, y, z = ox + t * ex, oy + t * ey, oz + t * ez
            across = math.sqrt(x * x + y * y)
            q, w = across - ring, 0.5 * max(across, 1e-9 * ring)
            d = math.sqrt(q * q + z * z)
            gap = d - radius
            if (gap < _CLOSE * reach) | (t > end):
                break
            slope = k * (q * (x * ex + y * ey) / (2.0 * w) + z * ez) / d
            step = w * (slope + math.sqrt(slope * slope + 2.0 * gap / w))
            t += k * max(gap, min(step, w))
    if not (gap < _CLOSE * reach):
        t = math.inf
    x, y, z = ox + t * ex, oy + t * ey, oz + t * ez
    across = math.sqrt(x * x + y * y)
    inverse = 1.0 / max(across, 1e-150)
    q = across - ring
    k = 1.0 / radius
    return t, k * q * x * inverse, k * q * y * inverse, k * z


@stage
def intersection(kind, a, b, c, ox, oy, oz, ex, ey, ez):
    """Of a ray and a shape of a kind."""
    if kind == SPHERE:
        return ray_and_sphere(ox, oy, oz, ex, ey, ez, a)
    if kind == BOX:
        return ray_and_box(ox, oy, oz, ex, ey, ez, a, b, c)
    if kind == TRIANGLE:
        return ray_and_triangle(ox, oy, oz, ex, ey, ez, a, b, c)
    if kind == CAPSULE:
        return ray_and_capsule(ox, oy, oz, ex, ey, ez, a, b)
    if kind == CYLINDER:
        return ray_and_cylinder(ox, oy, oz, ex, ey, ez, a, b)
    return ray_and_torus(ox, oy, oz, ex, ey, ez, a, b)


@stage
def grown(kind, a, b, c, by):
    """The size of a round shape that holds all points within a distance of one of that size."""
    if kind == CYLINDER:
        return a + by, b + by, c
    if kind == TORUS:
        return a, b + by, c
    return a + by, b, c


@stage
def shrunk(kind, a, b, c, by):
    """The size of a shape around which one of that size holds all points within a distance.

    Of a sphere, capsule or cylinder; the radius is not positive if there is none.
    """
    if kind == CYLINDER:
        return (a - by if b > by else 0.0), b - by, c
    return a - by, b, c


@stage
def half_extents(kind, a, b, c):
    """Of the box around a shape in its frame; not for a triangle, which lies beside its origin."""
    if kind == BOX:
        return a, b, c
    if kind == CAPSULE:
        return a, a, a + b
    if kind == CYLINDER:
        return a, a, b
    if kind == TORUS:
        return a + b, a + b, b
    return a, a, a
