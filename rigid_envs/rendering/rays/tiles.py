"""The empty ground as a camera sees it: squares of 10 cm that fade out around what is looked at.

Above the horizon is the sky. Where a pixel is wider than a line or a square, the mean of what it
covers is drawn.
"""

import math
from functools import cache
from typing import Any

from physics.compiler.jit import entry, stage

LINE_SPACING = 0.05  # m, between lines of the ground; every second one is emphasised
LINE_WIDTH = 0.0012  # m
LINE, EMPHASIS = 20.0, 30.0  # how much darker, of 255
TILE_WIDTH = 2.0 * LINE_SPACING
GROUND, TILE = (231.0, 234.0, 239.0), (219.0, 224.0, 232.0)
HORIZON, ZENITH = (247.0, 248.0, 251.0), (205.0, 219.0, 238.0)
# where the squares begin to fade and where they end, in halves of the picture's height
FADE = (0.9, 3.2)


@stage
def clipped(value, low, high):
    """The value within two limits."""
    return min(max(value, low), high)


@stage
def moved(axis_along, axis_down, ray_along, steep):
    """How far a point of the ground moves along x or y as its ray moves by one of the axes."""
    return abs(axis_along + ray_along * axis_down / steep)


@stage
def line_cover(at, spacing, pixel):
    """How much of a pixel's width the nearest of some parallel lines covers."""
    offset = abs(at - spacing * round(at / spacing))
    cover = (0.5 * (LINE_WIDTH + pixel) - offset) / pixel
    return clipped(cover, 0.0, min(LINE_WIDTH / pixel, 1.0))


@cache
def make_draw_ground() -> Any:
    """Entry point: colours and depths of the ground.

    Args:
        camera: [1], of CAMERA.
        target: [2] m, what is looked at.
        shown: m, half the height of what the picture shows of the plane through the target.
        has_floor: whether there is a ground.
        picture: [rows, columns, 3] bytes, is written.
        depth: [rows, columns] m, is written; infinite above the horizon.
    """

    @entry
    def draw_ground(camera, target, shown, has_floor, picture, depth):
        view = camera[0]
        right, up, forward = view.axes[0], view.axes[1], view.axes[2]
        above = view.eye[2]
        for row in range(depth.shape[0]):
            v = view.pixel * (view.half_height - row - 0.5)
            for column in range(depth.shape[1]):
                u = view.pixel * (column + 0.5 - view.half_width)
                ray_x = forward[0] + u * right[0] + v * up[0]
                ray_y = forward[1] + u * right[1] + v * up[1]
                ray_z = forward[2] + u * right[2] + v * up[2]
                if not has_floor or ray_z >= 0.0:
                    depth[row, column] = math.inf
                    length = math.sqrt(ray_x**2 + ray_y**2 + ray_z**2)
                    high = math.sqrt(max(ray_z, 0.0) / length)
                    for c in range(3):
                        picture[row, column, c] = HORIZON[c] + high * (ZENITH[c] - HORIZON[c])
                    continue
                depth[row, column] = above / -ray_z
                steep = max(-ray_z, 1e-4)
                x, y = view.eye[0] + above / steep * ray_x, view.eye[1] + above / steep * ray_y
                # m, how wide the pixel is on the ground
                scale = view.pixel * above / steep
                pixel_x = 1e-9 + scale * (
                    moved(right[0], right[2], ray_x, steep) + moved(up[0], up[2], ray_x, steep)
                )
                pixel_y = 1e-9 + scale * (
                    moved(right[1], right[2], ray_y, steep) + moved(up[1], up[2], ray_y, steep)
                )
                tile = (math.floor(x / TILE_WIDTH) + math.floor(y / TILE_WIDTH)) % 2.0
                tile *= clipped(1.5 - max(pixel_x, pixel_y) / LINE_SPACING, 0.0, 1.0)
                line = LINE * max(
                    line_cover(x, LINE_SPACING, pixel_x), line_cover(y, LINE_SPACING, pixel_y)
                ) + EMPHASIS * max(
                    line_cover(x, TILE_WIDTH, pixel_x), line_cover(y, TILE_WIDTH, pixel_y)
                )
                away = math.sqrt((x - target[0]) ** 2 + (y - target[1]) ** 2) / shown
                fade = clipped((away - FADE[0]) / (FADE[1] - FADE[0]), 0.0, 1.0)
                fade *= fade * (3.0 - 2.0 * fade)
                for c in range(3):
                    color = GROUND[c] + tile * (TILE[c] - GROUND[c]) - line
                    picture[row, column, c] = color + fade * (HORIZON[c] - color)

    return draw_ground
