"""Gaps between the samples of a side and its surface, in one lane: the work of a search."""

from functools import cache

from physics.collision.distances import box_distance, capsule_distance, sphere_distance
from physics.jit import at, kernel, stage
from physics.scene.shapes import BOX, CAPSULE, PLANE, SPHERE


@kernel
def gap_along_axes(side, i, seen):
    """Least gap that any sample can have: along the surface's axes, to the box of its core.

    Over a plane that is along z. Boxes that lie side by side are told apart by this, which
    their bounding spheres are too wide for.
    """
    R, c, core = seen.rotation, seen.position, side.core
    size = at(side.owner_size, i)
    ex, ey, ez = size * side.extent[0], size * side.extent[1], size * side.extent[2]
    hx = abs(R[0, i]) * ex + abs(R[1, i]) * ey + abs(R[2, i]) * ez
    hy = abs(R[3, i]) * ex + abs(R[4, i]) * ey + abs(R[5, i]) * ez
    hz = abs(R[6, i]) * ex + abs(R[7, i]) * ey + abs(R[8, i]) * ez
    if side.kind == PLANE:
        return c[2, i] - at(core[0], i) - hz - at(side.radius, i)
    gx = abs(c[0, i]) - at(core[0], i) - hx
    gy = abs(c[1, i]) - at(core[1], i) - hy
    gz = abs(c[2, i]) - at(core[2], i) - hz
    return max(gx, max(gy, gz)) - at(side.radius, i)


@stage
def _plane(x, y, z, a, b, c, radius, sharp):
    return z - a


@stage
def _box(x, y, z, a, b, c, radius, sharp):
    return box_distance(x, y, z, a, b, c, 0.0, radius, sharp)[0]


@stage
def _sphere(x, y, z, a, b, c, radius, sharp):
    return sphere_distance(x, y, z, a, b, c)[0]


@stage
def _capsule(x, y, z, a, b, c, radius, sharp):
    return capsule_distance(x, y, z, a, b, c)[0]


def _make_loop(distance, varied):
    """Kernel for one kind of surface: a loop without branches, over columns, for vectors."""

    @kernel
    def loop(model, side, i, seen, gap):
        R, c, first, count = seen.rotation, seen.position, side.first_sample, side.sample_count
        along_x = model.sample[0, first : first + count]
        along_y = model.sample[1, first : first + count]
        along_z = model.sample[2, first : first + count]
        ca, cb, cc = at(side.core[0], i), at(side.core[1], i), at(side.core[2], i)
        radius, size, sharp = at(side.radius, i), at(side.owner_size, i), side.sharp != 0
        xx, xy, xz, x0 = R[0, i], R[1, i], R[2, i], c[0, i]
        yx, yy, yz, y0 = R[3, i], R[4, i], R[5, i], c[1, i]
        zx, zy, zz, z0 = R[6, i], R[7, i], R[8, i], c[2, i]
        for s in range(count):
            sx, sy, sz = along_x[s], along_y[s], along_z[s]
            if varied:
                sx, sy, sz = size * sx, size * sy, size * sz
            x = xx * sx + xy * sy + xz * sz + x0
            y = yx * sx + yy * sy + yz * sz + y0
            z = zx * sx + zy * sy + zz * sz + z0
            gap[s] = distance(x, y, z, ca, cb, cc, radius, sharp) - radius

    return loop


@cache
def make_measure(features):
    """Kernel that writes the gap [samples] m of every sample of a side from its surface."""
    sphere, box, capsule = features.sphere, features.box, features.capsule
    from_plane = _make_loop(_plane, features.varied)
    from_box = _make_loop(_box, features.varied)
    from_sphere = _make_loop(_sphere, features.varied)
    from_capsule = _make_loop(_capsule, features.varied)

    @kernel
    def measure(model, side, i, seen, gap):
        if side.kind == PLANE:
            from_plane(model, side, i, seen, gap)
        if box and side.kind == BOX:
            from_box(model, side, i, seen, gap)
        if sphere and side.kind == SPHERE:
            from_sphere(model, side, i, seen, gap)
        if capsule and side.kind == CAPSULE:
            from_capsule(model, side, i, seen, gap)

    return measure
