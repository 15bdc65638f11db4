"""Depth peeling: where parallel rays through a closed mesh are inside it.

Rays along an axis pass through the pixels of a grid. Each triangle is rasterised row by row, and
all its crossings are kept, so a ray has every layer of the mesh that it meets. Sorted by depth and
counted with their sign, entering +1 and leaving -1, they pair into intervals inside the solid;
cavities and concave parts lie between two intervals of a ray.

A ray that meets an edge or a vertex must not count it twice or lose it. Whether a row crosses an
edge, and where, is computed from the edge's two vertices in a fixed order, with the same result in
both of its triangles. A triangle then covers the pixels left of its upward edge less those left of
its downward edge. Summed over a closed mesh every edge appears once upward and once downward, so
the crossings of each ray cancel exactly, whatever the round-off.

Source: C. Everitt, "Interactive Order-Independent Transparency" (2001), for peeling by layers on a
grid of pixels; here all layers are found at once.
"""

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from physics.compiler.jit import entry, stage

Array = np.ndarray


class PixelGrid(NamedTuple):
    """Parallel rays along an axis, at x = origin + i spacing, y likewise, in cyclic order.

    Attributes:
        axis: 0 to 2, along which the rays pass; the grid's x and y are the next two axes.
        origin: m, of the first ray, along the grid's x and y.
        spacing: m.
        counts: rays along the grid's x and y.
    """

    axis: int
    origin: tuple[float, float]
    spacing: float
    counts: tuple[int, int]


class Intervals(NamedTuple):
    """Parts of rays inside a mesh; ray i * counts[1] + j is at pixel (i, j).

    Attributes:
        ray: [n] in increasing order.
        low: [n] m along the axis.
        high: [n] m.
    """

    ray: Array
    low: Array
    high: Array


@stage
def _crossing(ax, ay, bx, by, y):
    """The x at which the edge from a to b crosses the row y; the same for the edge from b to a."""
    if (ay > by) | ((ay == by) & (ax > bx)):
        ax, ay, bx, by = bx, by, ax, ay
    return ax + (y - ay) * ((bx - ax) / (by - ay))


@cache
def _make_rasterise() -> Any:
    """Entry point: counts the crossings of each ray or, if `writes`, writes them from `cursor` on.

    Args:
        corners: [m, 3, 3] m, of the triangles; the rays pass along the third coordinate.
        x0: m, of the first ray.
        y0: m, likewise.
        spacing: m.
        columns: rays along x.
        rows: rays along y.
        cursor: [rays], where the next crossing of each ray belongs.
        depth: [crossings] m.
        sign: [crossings] 1.0 where the ray enters, -1.0 where it leaves.
        writes: whether depths and signs are written.
    """

    @entry
    def rasterise(corners, x0, y0, spacing, columns, rows, cursor, depth, sign, writes):
        for t in range(corners.shape[0]):
            a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
            ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            low, high = min(a[2], min(b[2], c[2])), max(a[2], max(b[2], c[2]))
            bottom, top = min(a[1], min(b[1], c[1])), max(a[1], max(b[1], c[1]))
            first = max(0, math.floor((bottom - y0) / spacing) - 1)
            last = min(rows - 1, math.ceil((top - y0) / spacing) + 1)
            for j in range(first, last + 1):
                y = y0 + j * spacing
                up, down, crosses = 0.0, 0.0, False
                for e in range(3):
                    p, q = corners[t, e], corners[t, (e + 1) % 3]
                    if (p[1] <= y) != (q[1] <= y):
                        x, crosses = _crossing(p[0], p[1], q[0], q[1], y), True
                        if p[1] <= y:
                            up = x
                        else:
                            down = x
                if not crosses:
                    continue
                left, right = min(up, down), max(up, down)
                start = max(0, math.floor((left - x0) / spacing) - 1)
                end = min(columns - 1, math.ceil((right - x0) / spacing) + 1)
                for i in range(start, end + 1):
                    x = x0 + i * spacing
                    if (x >= left) & (x < right):
                        ray = i * rows + j
                        if writes:
                            z = 0.5 * (low + high)
                            if nz != 0.0:
                                z = a[2] - (nx * (x - a[0]) + ny * (y - a[1])) / nz
                            depth[cursor[ray]] = min(max(z, low), high)
                            sign[cursor[ray]] = -1.0 if down <= up else 1.0
                        cursor[ray] += 1

    return rasterise


@cache
def _make_pair() -> Any:
    """Entry point: sorts the crossings of each ray and pairs them, in place.

    Args:
        first: [rays + 1], where the crossings of each ray begin.
        depth: [crossings] m; on return low, high, low, ...
        sign: [crossings]
        found: [rays], on return the number of intervals of each ray.
    """

    @entry
    def pair(first, depth, sign, found):
        for ray in range(found.shape[0]):
            begin, end = first[ray], first[ray + 1]
            for n in range(begin + 1, end):
                z, s, m = depth[n], sign[n], n - 1
                while m >= begin and depth[m] > z:
                    depth[m + 1], sign[m + 1] = depth[m], sign[m]
                    m -= 1
                depth[m + 1], sign[m + 1] = z, s
            inside, count, low = 0.0, 0, 0.0
            for n in range(begin, end):
                z, before = depth[n], inside
                inside += sign[n]
                if before == 0.0 and inside == 1.0:
                    low = z
                elif before == 1.0 and inside == 0.0 and z > low:
                    depth[begin + 2 * count] = low
                    depth[begin + 2 * count + 1] = z
                    count += 1
            found[ray] = count

    return pair


def peel(vertices: Array, faces: Array, grid: PixelGrid) -> Intervals:
    """The intervals of all rays of a grid inside a closed mesh.

    Args:
        vertices: [n, 3] m.
        faces: [m, 3], counterclockwise as seen from outside.
        grid: of the rays.
    """
    order = [(grid.axis + 1) % 3, (grid.axis + 2) % 3, grid.axis]
    corners = np.ascontiguousarray(vertices[faces][:, :, order], dtype=float)
    columns, rows = grid.counts
    frame = (corners, *map(float, grid.origin), float(grid.spacing), int(columns), int(rows))
    cursor = np.zeros(columns * rows, dtype=np.int64)
    _make_rasterise()(*frame, cursor, np.zeros(0), np.zeros(0), False)
    first = np.concatenate([[0], np.cumsum(cursor)])
    depth, sign = np.zeros(first[-1]), np.zeros(first[-1])
    _make_rasterise()(*frame, first[:-1].copy(), depth, sign, True)
    found = np.zeros(columns * rows, dtype=np.int64)
    _make_pair()(first, depth, sign, found)
    ray = np.repeat(np.arange(len(found)), found)
    nth = np.arange(len(ray)) - np.repeat(np.cumsum(found) - found, found)
    at = first[ray] + 2 * nth
    return Intervals(ray, depth[at], depth[at + 1])


def fill(intervals: Intervals, rays: int, origin: float, spacing: float, count: int) -> Array:
    """Mask [rays, count] of the points origin + k spacing of each ray that are inside."""
    begin = np.clip(np.ceil((intervals.low - origin) / spacing), 0, count).astype(int)
    end = np.clip(np.ceil((intervals.high - origin) / spacing), 0, count).astype(int)
    steps = np.zeros((rays, count + 1), dtype=np.int32)
    np.add.at(steps, (intervals.ray, begin), 1)
    np.add.at(steps, (intervals.ray, end), -1)
    return np.asarray(np.cumsum(steps, axis=1)[:, :-1] > 0)
