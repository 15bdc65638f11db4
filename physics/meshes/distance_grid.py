"""Signed distance of a closed mesh on a grid: negative inside, exact beside the triangles.

Near the surface every node gets the distance of the nearest triangle. Further out the nearest
triangle is passed on from node to node in sweeps along the eight diagonals: a node takes it from a
neighbour if it is nearer than its own. The sign follows from depth peeling through all nodes.

Source: H. Zhao, "A fast sweeping method for eikonal equations" (2005), for the order of the sweeps.
"""

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from physics.compiler.jit import entry, stage
from physics.meshes.peeling import PixelGrid, fill, peel

Array = np.ndarray

# cells between the bounding box of the mesh and the border of the grid
MARGIN = 4
# cells around a triangle's bounding box within which its distance is computed directly
_BAND = 1
# blocks of cells along the longest side that have a surface point each
_BLOCKS = 12


class DistanceGrid(NamedTuple):
    """Signed distances at the nodes of a grid of cubes.

    Attributes:
        values: [nx, ny, nz] m.
        origin: [3] m, of the first node.
        cell: m.
        low: [3] m, lower corner of the mesh's bounding box.
        high: [3] m, upper corner.
        points: [k, 3] m, nodes at the surface spread over all of it: guesses of the nearest point.
    """

    values: Array
    origin: Array
    cell: float
    low: Array
    high: Array
    points: Array


@stage
def _segment_square(px, py, pz, ux, uy, uz):
    """Squared distance of p from the segment from the origin to u."""
    along = px * ux + py * uy + pz * uz
    s = min(max(along / max(ux * ux + uy * uy + uz * uz, 1e-300), 0.0), 1.0)
    dx, dy, dz = px - s * ux, py - s * uy, pz - s * uz
    return dx * dx + dy * dy + dz * dz


@stage
def triangle_square(corners, t, x, y, z):
    """Squared distance in m^2 of a point from triangle t of corners [m, 3, 3] m."""
    ax, ay, az = corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2]
    ux, uy, uz = corners[t, 1, 0] - ax, corners[t, 1, 1] - ay, corners[t, 1, 2] - az
    vx, vy, vz = corners[t, 2, 0] - ax, corners[t, 2, 1] - ay, corners[t, 2, 2] - az
    px, py, pz = x - ax, y - ay, z - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nn = nx * nx + ny * ny + nz * nz
    # over the triangle if on the inner side of all edges: a test by triple products
    over = nx * (uy * pz - uz * py) + ny * (uz * px - ux * pz) + nz * (ux * py - uy * px) >= 0.0
    over &= nx * (py * vz - pz * vy) + ny * (pz * vx - px * vz) + nz * (px * vy - py * vx) >= 0.0
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    qx, qy, qz = px - ux, py - uy, pz - uz
    over &= nx * (wy * qz - wz * qy) + ny * (wz * qx - wx * qz) + nz * (wx * qy - wy * qx) >= 0.0
    if over and nn > 0.0:
        height = nx * px + ny * py + nz * pz
        return height * height / nn
    nearest = _segment_square(px, py, pz, ux, uy, uz)
    nearest = min(nearest, _segment_square(px, py, pz, vx, vy, vz))
    return min(nearest, _segment_square(qx, qy, qz, wx, wy, wz))


@stage
def _nodes_around(corners, t, axis, origin, cell, count):
    """First and last node along an axis that are around triangle t."""
    a, b, c = corners[t, 0, axis], corners[t, 1, axis], corners[t, 2, axis]
    first = math.floor((min(a, min(b, c)) - origin) / cell) - _BAND
    last = math.ceil((max(a, max(b, c)) - origin) / cell) + _BAND
    return max(first, 0), min(last, count - 1)


@cache
def _make_near() -> Any:
    """Entry point: writes squared distance and triangle of the nodes around each triangle."""

    @entry
    def near(corners, ox, oy, oz, cell, square, nearest):
        nx, ny, nz = square.shape
        for t in range(corners.shape[0]):
            i0, i1 = _nodes_around(corners, t, 0, ox, cell, nx)
            j0, j1 = _nodes_around(corners, t, 1, oy, cell, ny)
            k0, k1 = _nodes_around(corners, t, 2, oz, cell, nz)
            for i in range(i0, i1 + 1):
                for j in range(j0, j1 + 1):
                    for k in range(k0, k1 + 1):
                        x, y, z = ox + i * cell, oy + j * cell, oz + k * cell
                        s = triangle_square(corners, t, x, y, z)
                        if s < square[i, j, k]:
                            square[i, j, k], nearest[i, j, k] = s, t

    return near


@cache
def _make_sweep() -> Any:
    """Entry point: passes the nearest triangles on, once along each of the eight diagonals."""

    @entry
    def sweep(corners, ox, oy, oz, cell, square, nearest):
        nx, ny, nz = square.shape
        for sweep in range(8):
            dx = 1 if sweep & 1 else -1
            dy = 1 if sweep & 2 else -1
            dz = 1 if sweep & 4 else -1
            for p in range(nx):
                i = p if dx > 0 else nx - 1 - p
                for q in range(ny):
                    j = q if dy > 0 else ny - 1 - q
                    for r in range(nz):
                        k = r if dz > 0 else nz - 1 - r
                        x, y, z = ox + i * cell, oy + j * cell, oz + k * cell
                        for n in range(1, 8):  # the seven neighbours behind
                            a = i - dx if n & 1 else i
                            b = j - dy if n & 2 else j
                            c = k - dz if n & 4 else k
                            if (a < 0) | (a >= nx) | (b < 0) | (b >= ny) | (c < 0) | (c >= nz):
                                continue
                            t = nearest[a, b, c]
                            if t >= 0 and t != nearest[i, j, k]:
                                s = triangle_square(corners, t, x, y, z)
                                if s < square[i, j, k]:
                                    square[i, j, k], nearest[i, j, k] = s, t

    return sweep


def distance_grid(vertices: Array, faces: Array, cells: int) -> DistanceGrid:
    """The signed distance of a closed mesh.

    Args:
        vertices: [n, 3] m.
        faces: [m, 3], counterclockwise as seen from outside.
        cells: along the longest side of the bounding box.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    cell = float((high - low).max()) / cells
    counts = np.ceil((high - low) / cell - 1e-9).astype(int) + 2 * MARGIN + 1
    origin = 0.5 * (low + high) - 0.5 * cell * (counts - 1)
    corners = np.ascontiguousarray(vertices[faces], dtype=float)
    square, nearest = np.full(tuple(counts), np.inf), np.full(tuple(counts), -1)
    frame = (corners, *map(float, origin), cell, square, nearest)
    _make_near()(*frame)
    _make_sweep()(*frame)
    grid = PixelGrid(2, (origin[0], origin[1]), cell, (int(counts[0]), int(counts[1])))
    rays = int(counts[0] * counts[1])
    inside = fill(peel(vertices, faces, grid), rays, origin[2], cell, int(counts[2]))
    values = np.sqrt(square)
    points = origin + cell * _surface_nodes(values / cell, max(1, cells // _BLOCKS))
    signed = np.where(inside.reshape(values.shape), -values, values)
    return DistanceGrid(signed, origin, cell, low, high, points)


def _surface_nodes(away: Array, block: int) -> Array:
    """Indices [k, 3] of the node nearest to the surface in each block of nodes that it crosses.

    Args:
        away: [nx, ny, nz] distance from the surface in cells.
        block: nodes along a side of a block.
    """
    nodes = np.argwhere(away <= 0.5 * math.sqrt(3.0))
    nodes = nodes[np.argsort(away[tuple(nodes.T)], kind="stable")]
    return np.asarray(nodes[np.unique(nodes // block, axis=0, return_index=True)[1]])
