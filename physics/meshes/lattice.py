"""Particles of a mesh: the points of a cubic lattice inside it, found by depth peeling."""

from typing import NamedTuple

import numpy as np

from physics.meshes.peeling import Intervals, PixelGrid, fill, peel

Array = np.ndarray

# directions to the six nearest points of a lattice
_NEIGHBOURS = [(axis, step) for axis in range(3) for step in (-1, 1)]


class Lattice(NamedTuple):
    """The points of a lattice inside a mesh.

    Attributes:
        positions: [n, 3] m.
        normals: [n, 3], sum of the directions in which the next point is outside; zero within.
        surface: mask [n] of the points with at least one of the six next points outside.
        spacing: m.
        volume: m^3, of the intervals between the mesh's layers, integrated over the rays.
    """

    positions: Array
    normals: Array
    surface: Array
    spacing: float
    volume: float


def lattice(vertices: Array, faces: Array, spacing: float, axis: int = 2) -> Lattice:
    """The points inside a closed mesh of a lattice that is centred on its bounding box.

    Each point stands for a cube of the lattice. The cubes of a box of whole cubes fill it exactly.

    Args:
        vertices: [n, 3] m.
        faces: [m, 3].
        spacing: m.
        axis: along which the rays pass.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    counts = np.maximum(1, np.ceil((high - low) / spacing - 1e-9).astype(int))
    first = 0.5 * (low + high) - 0.5 * spacing * (counts - 1)
    x, y = (axis + 1) % 3, (axis + 2) % 3
    grid = PixelGrid(axis, (first[x], first[y]), spacing, (int(counts[x]), int(counts[y])))
    intervals = peel(vertices, faces, grid)
    shape = (counts[x], counts[y], counts[axis])
    inside = fill(intervals, shape[0] * shape[1], first[axis], spacing, shape[2]).reshape(shape)
    inside = np.moveaxis(inside, (0, 1, 2), (x, y, axis))
    index = np.argwhere(inside)
    around = np.pad(inside, 1)
    normals, surface = np.zeros((len(index), 3)), np.zeros(len(index), dtype=bool)
    for k, step in _NEIGHBOURS:
        beside = index + 1
        beside[:, k] += step
        outside = ~around[tuple(beside.T)]
        normals[outside, k] += step
        surface |= outside
    volume = volume_of(intervals, spacing)
    return Lattice(first + spacing * index, normals, surface, spacing, volume)


def volume_of(intervals: Intervals, spacing: float) -> float:
    """Volume in m^3 of the intervals of rays that are `spacing` m apart."""
    return float(np.sum(intervals.high - intervals.low)) * spacing**2


def budgeted(vertices: Array, faces: Array, volume: float, budget: int, shell: bool) -> Lattice:
    """The finest lattice found that has at most `budget` points (on its surface, if `shell`).

    The spacing is searched by bisection of its logarithm, to 0.1 %.

    Args:
        vertices: [n, 3] m.
        faces: [m, 3].
        volume: m^3, of the mesh.
        budget: number of points.
        shell: whether only points on the surface count.
    """

    def count(points: Lattice) -> int:
        return int(points.surface.sum()) if shell else len(points.positions)

    # a lattice of this spacing has about `budget` points in all, so its surface has fewer
    high = (volume / budget) ** (1.0 / 3.0)
    found = lattice(vertices, faces, high)
    while count(found) > budget or not len(found.positions):
        high *= 1.1 if len(found.positions) else 0.5
        found = lattice(vertices, faces, high)
    low = 0.5 * high
    while shell and count(lattice(vertices, faces, low)) <= budget:
        low *= 0.5
    while high / low > 1.0 + 1e-3:
        middle = (low * high) ** 0.5
        points = lattice(vertices, faces, middle)
        if 0 < count(points) <= budget:
            high, found = middle, points
        else:
            low = middle
    return found
