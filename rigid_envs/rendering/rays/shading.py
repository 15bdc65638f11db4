"""The colour of every pixel, and smooth borders between solids."""

import math

from physics.compiler.jit import stage
from rigid_envs.rendering.rays.intersections import BOX, intersection
from rigid_envs.rendering.rays.light import GROUND_SHADOW, brightness, sunlit
from rigid_envs.rendering.rays.visibility import seen_from, sight, turned_into, turned_out_of

EDGE_WIDTH = 1.0  # pixels of a box's edge on each face


@stage
def met(p, camera, dx, dy, dz):
    """Depth of a primitive along a direction, infinite if it isn't met; its normal in its frame."""
    ox, oy, oz = seen_from(p, camera.eye[0], camera.eye[1], camera.eye[2])
    ex, ey, ez = turned_into(p, dx, dy, dz)
    return intersection(p.kind, p.size[0], p.size[1], p.size[2], ox, oy, oz, ex, ey, ez)


@stage
def color(p, camera, sun, lit, dx, dy, dz, t, lx, ly, lz):
    """Colour of a primitive where `met` found it."""
    nx, ny, nz = turned_out_of(p, lx, ly, lz)
    diffuse, shine = brightness(nx, ny, nz, dx, dy, dz, sun, lit, p.gloss)
    if p.kind == BOX and p.edge < 1.0:
        # how far the point is from the nearest edge of its face
        ox, oy, oz = seen_from(p, camera.eye[0], camera.eye[1], camera.eye[2])
        ex, ey, ez = turned_into(p, dx, dy, dz)
        a, b, c = p.size[0], p.size[1], p.size[2]
        gx, gy, gz = a - abs(ox + t * ex), b - abs(oy + t * ey), c - abs(oz + t * ez)
        gx, gy, gz = (
            gx if lx == 0.0 else math.inf, gy if ly == 0.0 else math.inf,
            gz if lz == 0.0 else math.inf,
        )  # fmt: skip
        apart = min(gx, min(gy, gz)) / (t * camera.pixel)
        cover = min(max(EDGE_WIDTH + 0.5 - apart, 0.0), 1.0)
        diffuse *= 1.0 - cover * (1.0 - p.edge)
    return p.color[0] * diffuse + shine, p.color[1] * diffuse + shine, p.color[2] * diffuse + shine


@stage
def byte(value):
    """A brightness as a number of 0..255."""
    return min(max(value, 0.0), 255.0)


@stage
def paint(primitives, camera, sun, samples, shown, hidden, ground, spans, rgb):
    """Colours all pixels.

    Args:
        primitives: [n], of PRIMITIVE.
        camera: a record of CAMERA.
        sun: [3], unit vector.
        samples: number of points of the sun.
        shown: [rows, columns], which primitive, or -1.
        hidden: [rows, columns], bits of the hidden points of the sun.
        ground: [rows, columns, 3], colours of the empty ground and the sky.
        spans: [rows, 2], first and last column (exclusive) of solids and shadows in each row.
        rgb: [rows, columns, 3], is written.
    """
    rows, columns = shown.shape
    for row in range(rows):
        for column in range(columns):
            for k in range(3):
                rgb[row, column, k] = ground[row, column, k]
    for row in range(rows):
        for column in range(spans[row, 0], spans[row, 1]):
            n = shown[row, column]
            if n < 0:
                if hidden[row, column] != 0:
                    dark = 1.0 - sunlit(hidden[row, column], samples)
                    for k in range(3):
                        value = ground[row, column, k] * (1.0 - dark * GROUND_SHADOW[k])
                        rgb[row, column, k] = byte(value)
                continue
            lit = sunlit(hidden[row, column], samples)
            dx, dy, dz = sight(camera, row + 0.5, column + 0.5)
            t, lx, ly, lz = met(primitives[n], camera, dx, dy, dz)
            if t == math.inf:  # at a border, by rounding
                red, green, blue = 0.0, 0.0, 0.0
            else:
                red, green, blue = color(
                    primitives[n], camera, sun, lit, dx, dy, dz, t, lx, ly, lz
                )  # fmt: skip
            rgb[row, column, 0] = byte(red)
            rgb[row, column, 1] = byte(green)
            rgb[row, column, 2] = byte(blue)


# where a pixel is looked at to smooth it, from its corner: no two share a row or a column
_LOOKS = ((0.375, 0.125), (0.875, 0.375), (0.125, 0.625), (0.625, 0.875))


@stage
def smooth(primitives, camera, sun, samples, shown, hidden, ground, around, spans, rgb):
    """Colours the pixels at borders again, as the mean of four looks at each.

    A pixel at a border shows what its neighbours show: the nearest of these primitives is sought at
    each of the four places. Their share of the sun is that of the neighbour.

    The arguments are those of `paint`; and `around` [9, 2] is working memory: what the neighbours
    show, and which points of the sun are hidden there.
    """
    rows, columns = shown.shape
    for row in range(rows):
        above, below = max(row - 1, 0), min(row + 1, rows - 1)
        left = min(spans[above, 0], min(spans[row, 0], spans[below, 0])) - 1
        right = max(spans[above, 1], max(spans[row, 1], spans[below, 1])) + 1
        for column in range(max(left, 0), min(right, columns)):
            n, before, after = shown[row, column], max(column - 1, 0), min(column + 1, columns - 1)
            same = (shown[above, column] == n) & (shown[below, column] == n)
            if same & (shown[row, before] == n) & (shown[row, after] == n):
                continue
            count, lit, tile_row, tile_column = 0, 1.0, -1, -1
            for r in range(max(row - 1, 0), min(row + 2, rows)):
                for c in range(max(column - 1, 0), min(column + 2, columns)):
                    m = shown[r, c]
                    if m < 0:
                        if tile_row < 0 or (r == row and c == column):
                            tile_row, tile_column = r, c
                            lit = sunlit(hidden[r, c], samples)
                        continue
                    known = False
                    for k in range(count):
                        known |= around[k, 0] == m
                    if not known:
                        around[count, 0], around[count, 1] = m, hidden[r, c]
                        count += 1
            red, green, blue = 0.0, 0.0, 0.0
            for down, across in _LOOKS:
                dx, dy, dz = sight(camera, row + down, column + across)
                # the ground hides what is below it
                best, nearest = -1, -camera.eye[2] / dz if dz < 0.0 else math.inf
                nx, ny, nz = 0.0, 0.0, 0.0
                for k in range(count):
                    t, lx, ly, lz = met(primitives[around[k, 0]], camera, dx, dy, dz)
                    if (t < nearest) & (t > camera.near):
                        best, nearest, nx, ny, nz = k, t, lx, ly, lz
                if best >= 0:
                    p = primitives[around[best, 0]]
                    share = sunlit(around[best, 1], samples)
                    r, g, b = color(p, camera, sun, share, dx, dy, dz, nearest, nx, ny, nz)
                    red, green, blue = red + byte(r), green + byte(g), blue + byte(b)
                elif tile_row >= 0:
                    dark = 1.0 - lit
                    tile = ground[tile_row, tile_column]
                    red += tile[0] * (1.0 - dark * GROUND_SHADOW[0])
                    green += tile[1] * (1.0 - dark * GROUND_SHADOW[1])
                    blue += tile[2] * (1.0 - dark * GROUND_SHADOW[2])
                else:  # between two solids, and neither is met: as the pixel's middle
                    red += rgb[row, column, 0]
                    green += rgb[row, column, 1]
                    blue += rgb[row, column, 2]
            rgb[row, column, 0] = 0.25 * red
            rgb[row, column, 1] = 0.25 * green
            rgb[row, column, 2] = 0.25 * blue
