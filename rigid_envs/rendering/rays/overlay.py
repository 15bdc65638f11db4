"""What is drawn beside solids: decals on the ground, see-through shapes, polygons over all."""

import math

from physics.compiler.jit import stage
from rigid_envs.rendering.rays.intersections import SPHERE, intersection
from rigid_envs.rendering.rays.light import brightness
from rigid_envs.rendering.rays.visibility import (
    bounds,
    pixels_of,
    seen_from,
    sight,
    turned_into,
    turned_out_of,
)

RIM = 0.55  # opacity that a see-through ball has at its rim, beside its own
LOOKS = 2  # per pixel and direction at a decal


@stage
def draw_decals(decals, camera, ground):
    """Discs and crosses on a picture [rows, columns, 3] of the ground."""
    rows, columns, _ = ground.shape
    for n in range(len(decals)):
        d = decals[n]
        x, y = d.position[0], d.position[1]
        top, bottom, left, right = bounds(camera, x, y, 0.0, d.radius, rows, columns)
        for row in range(top, bottom):
            for column in range(left, right):
                opacity = 0.0
                for look in range(LOOKS * LOOKS):
                    down, across = look // LOOKS, look % LOOKS
                    dx, dy, dz = sight(
                        camera, row + (down + 0.5) / LOOKS, column + (across + 0.5) / LOOKS
                    )
                    if dz < 0.0:
                        t = -camera.eye[2] / dz
                        opacity += _opacity(
                            d, camera.eye[0] + t * dx - x, camera.eye[1] + t * dy - y,
                            t * camera.pixel,
                        )  # fmt: skip
                blend(ground, row, column, d.color, 1.0, 0.0, opacity / (LOOKS * LOOKS))


@stage
def _opacity(d, x, y, pixel):
    """Of a decal at a point of the ground, from its middle in m."""
    if d.width > 0.0:  # a cross, whose arms are diagonals
        u, v = abs(x + y) * math.sqrt(0.5), abs(x - y) * math.sqrt(0.5)
        return d.opacity if (max(u, v) <= d.radius) & (min(u, v) <= d.width) else 0.0
    r = math.sqrt(x * x + y * y)
    return 0.0 if r > d.radius else (d.rim if r > d.radius - 1.5 * pixel else d.opacity)


@stage
def blend(picture, row, column, color, diffuse, shine, opacity):
    """Mixes a lit colour into a pixel."""
    for k in range(3):
        value = min(max(color[k] * diffuse + shine, 0.0), 255.0)
        picture[row, column, k] += opacity * (value - picture[row, column, k])


@stage
def draw_glass(glass, camera, sun, depth, rgb):
    """See-through shapes in front of what is seen, in the order of the table: far ones first."""
    rows, columns = depth.shape
    for n in range(len(glass)):
        p = glass[n]
        top, bottom, left, right = pixels_of(p, camera, rows, columns)
        ox, oy, oz = seen_from(p, camera.eye[0], camera.eye[1], camera.eye[2])
        for row in range(top, bottom):
            for column in range(left, right):
                seen, diffuse, shine, facing, looks = 0, 0.0, 0.0, 0.0, 2
                look = 0
                while look < looks:
                    # two opposite quarters of the pixel, and the other two if these differ
                    down = look % 2
                    across = down if look < 2 else 1 - down
                    dx, dy, dz = sight(
                        camera, row + 0.25 + 0.5 * down, column + 0.25 + 0.5 * across
                    )
                    ex, ey, ez = turned_into(p, dx, dy, dz)
                    t, lx, ly, lz = intersection(
                        p.kind, p.size[0], p.size[1], p.size[2], ox, oy, oz, ex, ey, ez
                    )
                    if (t < depth[row, column]) & (t > camera.near):
                        nx, ny, nz = turned_out_of(p, lx, ly, lz)
                        d, s = brightness(nx, ny, nz, dx, dy, dz, sun, 1.0, p.gloss)
                        length = math.sqrt(dx * dx + dy * dy + dz * dz)
                        seen, diffuse, shine = seen + 1, diffuse + d, shine + s
                        facing += abs(nx * dx + ny * dy + nz * dz) / length
                    look += 1
                    if (look == 2) & (seen == 1):
                        looks = 4
                if seen > 0:
                    k = 1.0 / seen
                    opacity = p.opacity
                    if p.kind == SPHERE:
                        opacity = min(opacity + RIM * (1.0 - k * facing) ** 2, 1.0)
                    blend(rgb, row, column, p.color, k * diffuse, k * shine, seen / looks * opacity)


@stage
def draw_polygons(polygons, rgb):
    """Convex polygons with smooth borders."""
    rows, columns, _ = rgb.shape
    for n in range(len(polygons)):
        p = polygons[n]
        q = p.corners
        low_y, high_y, area, inside = q[0, 1], q[0, 1], 0.0, True
        for k in range(4):
            m = (k + 1) % 4
            low_y, high_y = min(low_y, q[k, 1]), max(high_y, q[k, 1])
            area += q[k, 0] * q[m, 1] - q[m, 0] * q[k, 1]
            inside &= (abs(q[k, 0]) < 1e6) & (abs(q[k, 1]) < 1e6)
        if not inside:
            continue
        side = 1.0 if area > 0.0 else -1.0
        per_edge = (
            _per_length(q, 0, side), _per_length(q, 1, side), _per_length(q, 2, side),
            _per_length(q, 3, side),
        )  # fmt: skip
        for row in range(max(math.floor(low_y) - 1, 0), min(math.ceil(high_y) + 1, rows)):
            left, right = _reach(q, row - 0.5, row + 1.5)
            for column in range(max(math.floor(left) - 1, 0), min(math.ceil(right) + 1, columns)):
                cover = min(max(_within(q, column + 0.5, row + 0.5, per_edge) + 0.5, 0.0), 1.0)
                if cover > 0.0:
                    blend(rgb, row, column, p.color, 1.0, 0.0, cover * p.opacity)


@stage
def _reach(q, top, bottom):
    """From where to where the edges of a polygon reach between two rows; empty if they don't."""
    left, right = math.inf, -math.inf
    for k in range(4):
        m = (k + 1) % 4
        ax, ay, bx, by = q[k, 0], q[k, 1], q[m, 0], q[m, 1]
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay
        if (by < top) | (ay > bottom):
            continue
        slope = (bx - ax) / (by - ay) if by > ay else 0.0
        first, last = ax, bx
        if by > ay:
            first = ax + slope * (max(ay, top) - ay)
            last = ax + slope * (min(by, bottom) - ay)
        left, right = min(left, min(first, last)), max(right, max(first, last))
    if left > right:
        return 0.0, -2.0
    return left, right


@stage
def _per_length(q, k, side):
    """The inverse of an edge's length, with the sign of `side`; 0 for a point."""
    m = (k + 1) % 4
    ux, uy = q[m, 0] - q[k, 0], q[m, 1] - q[k, 1]
    length = math.sqrt(ux * ux + uy * uy)
    return side / length if length > 1e-9 else 0.0


@stage
def _within(q, x, y, per_edge):
    """How far a point is within a convex polygon, negative outside of it."""
    inside = 1e9
    for k in range(4):
        m = (k + 1) % 4
        ux, uy = q[m, 0] - q[k, 0], q[m, 1] - q[k, 1]
        if per_edge[k] != 0.0:
            inside = min(inside, per_edge[k] * (ux * (y - q[k, 1]) - uy * (x - q[k, 0])))
    return inside
