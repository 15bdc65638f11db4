"""Uniform grids in which neighbours are found: particles are sorted by cell.

There is a grid for each class of sizes (a *level*; the first has the largest particles). Its cells
are as long as the largest distance at which two of its particles, or one of them and a smaller one,
can be neighbours, so all neighbours are in the cell itself and the 26 around it. Cells are numbered
along z first: of each column, the three that matter follow each other.

A grid covers a box, surrounded by one layer of empty cells. Particles beyond the box count as if
they were in its outermost cells. That moves no two of them further apart, so it loses no neighbour.
"""

import math

from physics.compiler.jit import stage
from physics.granular.tables import HIGH, LOW, SKIN, SLABS

# factor on the length of cells while there are more than there is room for
_COARSER = 1.25


@stage
def set_up_grid(heap, scratch):
    """Lengths and numbers of the cells for the present skin; returns the number of all cells."""
    room = scratch.cell_start.shape[0] - 2
    low, high = LOW, HIGH
    factor = 1.0
    while True:
        base = 0
        for k in range(scratch.level.shape[0]):
            level = scratch.level[k]
            cell = factor * (2.0 * level.largest_radius + heap.scale[SKIN])
            level.cells_per_meter = 1.0 / cell
            level.base = base
            cells = 1
            for axis in range(3):
                span = heap.scale[high + axis] - heap.scale[low + axis]
                along = min(span / cell, room * 1.0)  # so that their product can't overflow
                level.count[axis] = max(1, math.ceil(along))
                cells = min(cells * (level.count[axis] + 2), room + 1)
            base += cells
        if base <= room:
            return base
        factor *= _COARSER


@stage
def cell_coordinate(position, low, cells_per_meter, count):
    """1 ... count: which cell along an axis."""
    return min(int(max((position - low) * cells_per_meter, 0.0)), count - 1) + 1


@stage
def cell_of(level, scale, x, y, z):
    """Number of the cell of a point in the grid of a level."""
    ix = cell_coordinate(x, scale[LOW], level.cells_per_meter, level.count[0])
    iy = cell_coordinate(y, scale[LOW + 1], level.cells_per_meter, level.count[1])
    iz = cell_coordinate(z, scale[LOW + 2], level.cells_per_meter, level.count[2])
    return level.base + (ix * (level.count[1] + 2) + iy) * (level.count[2] + 2) + iz


@stage
def find_cells(heap, scratch, slab, first, last):
    """Writes the cell of the particles first <= n < last, which are a slab's."""
    low, high = scratch.cell_start.shape[0], 0
    for n in range(first, last):
        level = scratch.level[heap.level_of[n]]
        x, y, z = heap.particle[n, 0], heap.particle[n, 1], heap.particle[n, 2]
        cell = cell_of(level, heap.scale, x, y, z)
        scratch.cell_of[n] = cell
        low, high = min(low, cell), max(high, cell)
    scratch.cell_range[slab, 0] = low
    scratch.cell_range[slab, 1] = high


@stage
def particles_of_slab(heap, slab):
    """First particle of a slab of bodies, and the first after it."""
    groups = heap.body.shape[0]
    lanes = (heap.first.shape[0] - 1) // groups
    first, last = groups * slab // SLABS * lanes, groups * (slab + 1) // SLABS * lanes
    return heap.first[first], heap.first[last]


@stage
def count_particles(heap, scratch, slab, cells):
    """Counts the particles of each cell in a slab of cells, and of the slab."""
    first, last = cells * slab // SLABS, cells * (slab + 1) // SLABS
    start, of = scratch.cell_start, scratch.cell_of
    for c in range(first, last):
        start[c] = 0
    total = 0
    for s in range(SLABS):
        if scratch.cell_range[s, 0] < last and scratch.cell_range[s, 1] >= first:
            begin, end = particles_of_slab(heap, s)
            for n in range(begin, end):
                c = of[n]
                if first <= c < last:
                    start[c] += 1
                    total += 1
    scratch.total[slab] = total


@stage
def sort_particles(heap, scratch, slab, cells):
    """Sorts the particles of a slab of cells by cell; within a cell they keep their order."""
    first, last = cells * slab // SLABS, cells * (slab + 1) // SLABS
    start, of, particle = scratch.cell_start, scratch.cell_of, heap.particle
    index, sorted_particle = scratch.sorted_index, scratch.sorted_particle
    place = 0
    for s in range(slab):
        place += scratch.total[s]
    # start[c] is for now where the next particle of cell c goes; the end of the cell afterwards
    for c in range(first, last):
        count = start[c]
        start[c] = place
        place += count
    for s in range(SLABS):
        if scratch.cell_range[s, 0] < last and scratch.cell_range[s, 1] >= first:
            begin, end = particles_of_slab(heap, s)
            for n in range(begin, end):
                c = of[n]
                if first <= c < last:
                    p = start[c]
                    start[c] = p + 1
                    index[p] = n
                    for axis in range(4):
                        sorted_particle[p, axis] = particle[n, axis]


@stage
def cells_begin(scratch, cell):
    """Where the particles of a cell begin among the sorted ones: where the cell before it ends."""
    return scratch.cell_start[cell - 1]
