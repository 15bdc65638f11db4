"""The entry of the renderer: pictures of many worlds, one after another."""

from typing import Any

from physics.compiler.jit import factory, large_entry
from rigid_envs.rendering.rays.overlay import draw_decals, draw_glass, draw_polygons
from rigid_envs.rendering.rays.shading import paint, smooth
from rigid_envs.rendering.rays.shadows import find_shadows
from rigid_envs.rendering.rays.visibility import find_nearest


@factory
def make_draw() -> Any:
    """Entry point: draws the worlds first <= w < last.

    Args:
        first, last: worlds.
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
        smooths: whether borders are smoothed.
        depth, shown, hidden, ground, around, starts, entries, slabs, spans: working memory: [rows,
            columns] of numbers, integers and bytes, [rows, columns, 3] bytes, [9, 2] integers, and
            that of `find_shadows`.
        rgb: [worlds, rows, columns, 3] bytes, is written.
        depths: [worlds, rows, columns] m, is written; of no worlds if it isn't wanted.
        solids: [worlds, rows, columns], the solids that are seen; likewise.
        ground_solid: which solid the ground is, -1 if none.
    """

    @large_entry
    def draw(
        first, last, primitives, order, glass, decals, polygons, camera, sun_frame, points, tiles,
        tile_depth, smooths, depth, shown, hidden, ground, around, starts, entries, slabs, spans,
        rgb, depths, solids, ground_solid,
    ):  # fmt: skip
        rows, columns = depth.shape
        view, samples, sun = camera[0], len(points), sun_frame[2]
        for w in range(first, last):
            for row in range(rows):
                for column in range(columns):
                    depth[row, column] = tile_depth[row, column]
                    shown[row, column] = -1
                    hidden[row, column] = 0
            find_nearest(primitives[w], view, depth, shown)
            if rgb.shape[0] > 0:
                find_shadows(
                    primitives[w], order[w], view, sun_frame, points, depth, shown, starts,
                    entries, slabs, spans, hidden,
                )  # fmt: skip
                below = tiles
                if decals.shape[1] > 0:
                    below = ground
                    for row in range(rows):
                        for column in range(columns):
                            for k in range(3):
                                ground[row, column, k] = tiles[row, column, k]
                    draw_decals(decals[w], view, ground)
                paint(primitives[w], view, sun, samples, shown, hidden, below, spans, rgb[w])
                if smooths:
                    smooth(
                        primitives[w], view, sun, samples, shown, hidden, below, around, spans,
                        rgb[w],
                    )  # fmt: skip
                draw_glass(glass[w], view, sun, depth, rgb[w])
                draw_polygons(polygons[w], rgb[w])
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
