"""Pairs of solids that are near each other, by a uniform grid with a level for each size of solid.

A solid whose bounding sphere, margin included, has a radius between e/4 and e/2 is entered into the
level with cells of edge e. Two of the same level that are near each other are in neighbouring
cells, and so is a solid in a coarser level and the cell there in which a smaller one lies. Cells
are found by a hash, so the grid needs no bounds. The work grows with the number of solids, and with
the number of levels that are in use.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from physics.compiler.jit import entry, stage
from physics.manybody.tables import POSITION, ROTATION

Array = np.ndarray

# large primes: neighbouring cells get unrelated buckets (Teschner et al. 2003)
_PRIMES = (73856093, 19349663, 83492791, 49979687)


@stage
def _bucket(x, y, z, level, count):
    """Number of the bucket of a cell; `count` is a power of two."""
    mixed = (x * _PRIMES[0]) ^ (y * _PRIMES[1]) ^ (z * _PRIMES[2]) ^ (level * _PRIMES[3])
    return mixed & (count - 1)


@stage
def _are_near(frame, box, reach, margin, p, q):
    """Whether bounding spheres, and the box of the larger solid, meet; with their margins."""
    apart = margin[p] + margin[q]
    dx = frame[q, POSITION] - frame[p, POSITION]
    dy = frame[q, POSITION + 1] - frame[p, POSITION + 1]
    dz = frame[q, POSITION + 2] - frame[p, POSITION + 2]
    far = reach[p] + reach[q] + apart
    if dx * dx + dy * dy + dz * dz > far * far:
        return False
    # the larger one's own box is tighter than its box along the world's axes
    large, small = (p, q) if reach[p] >= reach[q] else (q, p)
    room = reach[small] + apart
    for axis in range(3):
        along = (
            frame[large, ROTATION + axis] * dx
            + frame[large, ROTATION + 3 + axis] * dy
            + frame[large, ROTATION + 6 + axis] * dz
        )
        if abs(along) > box[large, axis] + room:
            return False
    return True


@stage
def _enter(frame, box, reach, margin, kind, plane, level, edge, grid):
    """Enters all solids but grounds into the cells of their levels."""
    bucket, buckets = grid.bucket, grid.bucket.shape[0] - 2
    for n in range(buckets + 2):
        bucket[n] = 0
    places = frame.shape[0]
    for p in range(places):
        if kind[p] >= 0 and plane[p] == 0:
            size = edge[level[p]]
            for c in range(3):
                grid.cell[p, c] = math.floor(frame[p, POSITION + c] / size)
            cell = grid.cell[p]
            bucket[_bucket(cell[0], cell[1], cell[2], level[p], buckets) + 2] += 1
    for n in range(buckets):
        bucket[n + 2] += bucket[n + 1]
    # bucket[n + 1] is where those of n begin; it moves to their end, where those of n + 1 begin
    for p in range(places):
        if kind[p] < 0 or plane[p] != 0:
            continue
        cell = grid.cell[p]
        n = _bucket(cell[0], cell[1], cell[2], level[p], buckets) + 1
        entry, bucket[n] = bucket[n], bucket[n] + 1
        grid.entered[entry] = p
        for c in range(3):
            row = ROTATION + 3 * c
            along = (
                abs(frame[p, row]) * box[p, 0]
                + abs(frame[p, row + 1]) * box[p, 1]
                + abs(frame[p, row + 2]) * box[p, 2]
            )
            extent = min(along, reach[p]) + margin[p]
            grid.low[entry, c] = frame[p, POSITION + c] - extent
            grid.high[entry, c] = frame[p, POSITION + c] + extent


class Grid(NamedTuple):
    """Working memory of the search.

    Attributes:
        cell: [places, 3] of each solid.
        bucket: [buckets + 2] where the solids of each bucket begin; the number is a power of two.
        entered: [places] the solids by bucket.
        low: [places, 3] m, of their bounding boxes along the world's axes, with margins.
        high: likewise.
    """

    cell: Array
    bucket: Array
    entered: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, places: int) -> "Grid":
        """For a number of places."""
        buckets = 1 << max(4, int(np.ceil(np.log2(2 * places))))
        return cls(
            cell=np.zeros((places, 3), np.int64),
            bucket=np.zeros(buckets + 2, np.int64),
            entered=np.zeros(places, np.int64),
            low=np.zeros((places, 3)),
            high=np.zeros((places, 3)),
        )


@cache
def make_near_pairs():
    """Entry point: lists all near pairs that can touch."""

    @entry
    def near_pairs(
        frame, box, reach, margin, kind, plane, level, edge, bodies, pair, grid, found
    ):  # fmt: skip
        """Number of pairs; those beyond the length of `found` are counted only.

        Args:
            frame: [places, ...] see `Crowd.frame`.
            box: [places, 3] m, half extents along the solid's own axes.
            reach: [places] m, of bounding spheres.
            margin: [places] m.
            kind: [places] of each solid, -1 where there is none.
            plane: [places] 1: a ground, whose frame holds its height.
            level: [places] of the grid.
            edge: [levels] m, of cells; 0 for a level without solids.
            bodies: number of places of bodies, which come before those of statics.
            pair: [kinds, kinds] -1 where solids can't touch.
            grid: working memory.
            found: [n] written, place of the first solid times the number of places plus that of the
                second. The first has the smaller kind, or the smaller place.
        """
        _enter(frame, box, reach, margin, kind, plane, level, edge, grid)
        places, buckets, count = frame.shape[0], grid.bucket.shape[0] - 2, 0
        low, high, cell, entered = grid.low, grid.high, grid.cell, grid.entered
        entries = grid.bucket[buckets]
        for e in range(entries):
            p = entered[e]
            lx, ly, lz = low[e, 0], low[e, 1], low[e, 2]
            hx, hy, hz = high[e, 0], high[e, 1], high[e, 2]
            for other in range(level[p], edge.shape[0]):
                same = other == level[p]
                if edge[other] == 0.0:
                    continue
                x = math.floor(frame[p, POSITION] / edge[other])
                y = math.floor(frame[p, POSITION + 1] / edge[other])
                z = math.floor(frame[p, POSITION + 2] / edge[other])
                # of neighbouring cells of one level each looks at half of the others
                for step in range(13 if same else 0, 27):
                    u, v, w = x + step // 9 - 1, y + step // 3 % 3 - 1, z + step % 3 - 1
                    n = _bucket(u, v, w, other, buckets)
                    first = e + 1 if same and step == 13 else grid.bucket[n]
                    for m in range(first, grid.bucket[n + 1]):
                        apart = (low[m, 0] > hx) | (high[m, 0] < lx)
                        apart |= (low[m, 1] > hy) | (high[m, 1] < ly)
                        apart |= (low[m, 2] > hz) | (high[m, 2] < lz)
                        if apart:
                            continue
                        q = entered[m]
                        if level[q] != other or cell[q, 0] != u or cell[q, 1] != v:
                            continue
                        if cell[q, 2] != w or (p >= bodies and q >= bodies):
                            continue
                        if pair[kind[p], kind[q]] < 0:
                            continue
                        if _are_near(frame, box, reach, margin, p, q):
                            swap = kind[q] < kind[p] or (kind[q] == kind[p] and q < p)
                            one, two = (q, p) if swap else (p, q)
                            if count < found.shape[0]:
                                found[count] = one * places + two
                            count += 1
        for q in range(bodies, places):
            if kind[q] < 0 or plane[q] == 0:
                continue
            for e in range(entries):
                p = entered[e]
                if p < bodies and pair[kind[p], kind[q]] >= 0 and low[e, 2] < frame[q, 2]:
                    if count < found.shape[0]:
                        found[count] = p * places + q
                    count += 1
        return count

    return near_pairs


def grid_levels(sizes: Array) -> tuple[Array, Array]:
    """Level of each solid, by its radius [n] m with the margin; and edges [levels] of cells.

    An edge is twice the largest radius in the level; 0 for a level without solids.
    """
    smallest = float(sizes.min())
    level = np.floor(np.log2(sizes / smallest) + 1e-9).astype(np.int64)
    largest = np.zeros(int(level.max()) + 1)
    np.maximum.at(largest, level, sizes)
    return level, 2.0 * largest
