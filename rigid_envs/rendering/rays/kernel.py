"""The entry of the renderer: pictures of many worlds, one after another."""

from typing import Any, NamedTuple

import numpy as np

from physics.compiler.bundles import bundle
from physics.compiler.jit import factory, large_entry
from rigid_envs.rendering.rays.overlay import draw_decals, draw_glass, draw_polygons
from rigid_envs.rendering.rays.shading import paint, smooth
from rigid_envs.rendering.rays.shadows import find_shadows
from rigid_envs.rendering.rays.visibility import find_nearest

Array = np.ndarray


class Drawn(NamedTuple):
    """What is drawn.

    Attributes:
        primitives: [worlds, n], of PRIMITIVE: the solids.
        order: [worlds, n], their indices, those nearest to the sun first.
        glass: [worlds, g], of PRIMITIVE: what is see-through, far ones first.
        decals: [worlds, d], of DECAL.
        polygons: [worlds, p], of POLYGON.
        camera: [1], of CAMERA.
        sun_frame: [3, 3], rows are two unit vectors across the light, and the one to the sun.
        points: [samples, 3], directions to points of the sun.
        tiles: [rows, columns, 3], picture of the empty ground.
        tile_depth: [rows, columns] m, its depth; infinite above the horizon.
    """

    primitives: Array
    order: Array
    glass: Array
    decals: Array
    polygons: Array
    camera: Array
    sun_frame: Array
    points: Array
    tiles: Array
    tile_depth: Array


class Memory(NamedTuple):
    """Working memory of a thread.

    Attributes:
        depth, shown, hidden: [rows, columns] of numbers, integers and bytes.
        ground: [rows, columns, 3] bytes.
        around: [9, 2] integers.
        starts, entries, slabs, spans: that of `find_shadows`.
    """

    depth: Array
    shown: Array
    hidden: Array
    ground: Array
    around: Array
    starts: Array
    entries: Array
    slabs: Array
    spans: Array


class Pictures(NamedTuple):
    """What is written.

    Attributes:
        rgb: [worlds, rows, columns, 3] bytes; of no worlds if it isn't wanted.
        depths: [worlds, rows, columns] m; likewise.
        solids: [worlds, rows, columns], the solids that are seen; likewise.
    """

    rgb: Array
    depths: Array
    solids: Array


@factory
def make_draw() -> Any:
    """Entry point: draws the worlds first <= w < last.

    Args:
        first, last: worlds.
        drawn, memory, pictures: see `Drawn`, `Memory` and `Pictures`.
        smooths: whether borders are smoothed.
        ground_solid: which solid the ground is, -1 if none.
    """

    @large_entry
    def draw(first, last, drawn, memory, pictures, smooths, ground_solid):
        drawn, memory, pictures = bundle(drawn), bundle(memory), bundle(pictures)
        primitives, order, view = drawn.primitives, drawn.order, drawn.camera[0]
        points, tiles, tile_depth = drawn.points, drawn.tiles, drawn.tile_depth
        sun_frame = drawn.sun_frame
        depth, shown, hidden, ground = memory.depth, memory.shown, memory.hidden, memory.ground
        spans, rgb, depths, solids = memory.spans, pictures.rgb, pictures.depths, pictures.solids
        rows, columns = depth.shape
        samples, sun = len(points), sun_frame[2]
        for w in range(first, last):
            for row in range(rows):
                for column in range(columns):
                    depth[row, column] = tile_depth[row, column]
                    shown[row, column] = -1
                    hidden[row, column] = 0
            find_nearest(primitives[w], view, depth, shown)
            if rgb.shape[0] > 0:
                find_shadows(
                    primitives[w], order[w], view, sun_frame, points, depth, shown,
                    memory.starts, memory.entries, memory.slabs, spans, hidden,
                )  # fmt: skip
                below = tiles
                if drawn.decals.shape[1] > 0:
                    below = ground
                    for row in range(rows):
                        for column in range(columns):
                            for k in range(3):
                                ground[row, column, k] = tiles[row, column, k]
                    draw_decals(drawn.decals[w], view, ground)
                paint(primitives[w], view, sun, samples, shown, hidden, below, spans, rgb[w])
                if smooths:
                    smooth(
                        primitives[w], view, sun, samples, shown, hidden, below, memory.around,
                        spans, rgb[w],
                    )  # fmt: skip
                draw_glass(drawn.glass[w], view, sun, depth, rgb[w])
                draw_polygons(drawn.polygons[w], rgb[w])
            for row in range(rows):
                for column in range(columns):
                    if depths.shape[0] > 0:
                        depths[w, row, column] = depth[row, column]
                    if solids.shape[0] > 0:
                        n = shown[row, column]
                        solid = primitives[w, n].solid if n >= 0 else -1
                        if (n < 0) & (tile_depth[row, column] < 1e300):
                            solid = ground_solid
                        solids[w, row, column] = solid

    return draw
