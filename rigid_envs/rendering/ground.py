"""The empty ground as a camera sees it: squares of 10 cm that fade out around what is looked at.

Above the horizon is the sky.
"""

import numpy as np

from rigid_envs.rendering.camera import Camera

Array = np.ndarray

LINE_SPACING = 0.05  # m, between lines of the ground; every second one is emphasised
LINE_WIDTH = 0.0012  # m
GROUND, TILE, HORIZON, ZENITH = np.array(
    [[231, 234, 239], [219, 224, 232], [247, 248, 251], [205, 219, 238]]
)
# where the squares begin to fade and where they end, in halves of the picture's height
FADE = (0.9, 3.2)
_LINES = ((LINE_SPACING, 20.0), (2.0 * LINE_SPACING, 30.0))  # m, darkness of 255


_ROWS = 64  # that are computed at once, for memory


def ground(camera: Camera, width: int, height: int, floor: float | None) -> tuple[Array, Array]:
    """Colours [height, width, 3] uint8 and depths [height, width] m, infinite above the horizon.

    Where a pixel is wider than a line or a square, the mean of what it covers is drawn.

    Args:
        camera: which looks.
        width: pixels.
        height: pixels.
        floor: m, height of the ground; None if there is none.
    """
    picture, depth = np.empty((height, width, 3), np.uint8), np.empty((height, width))
    for first in range(0, height, _ROWS):
        rows = slice(first, first + _ROWS)
        ray = camera.rays(width, height, rows)
        picture[rows], depth[rows] = _rows(camera, ray, height, floor)
    return picture, depth


def _rows(camera: Camera, ray: Array, height: int, floor: float | None) -> tuple[Array, Array]:
    """Colours and depths of some rows, of which `ray` [rows, width, 3] are the rays."""
    above = camera.eye[2] - (floor or 0.0)
    down = (ray[..., 2] < 0.0) & (floor is not None)
    depth = np.where(down, above / np.maximum(-ray[..., 2], 1e-300), np.inf)
    bounded = above / np.maximum(-ray[..., 2:], 1e-4)
    point = camera.eye[:2] + bounded * ray[..., :2]
    pixel = _footprint(camera, ray, height, above)  # m, of a pixel on the ground along x and y
    tile = np.floor(point / (2.0 * LINE_SPACING)).sum(-1, keepdims=True) % 2.0
    tile *= np.clip(1.5 - pixel.max(-1, keepdims=True) / LINE_SPACING, 0.0, 1.0)
    picture = GROUND + tile * (TILE - GROUND)
    for spacing, strength in _LINES:
        offset = np.abs(point - spacing * np.round(point / spacing))
        cover = (0.5 * (LINE_WIDTH + pixel) - offset) / pixel
        cover = np.clip(cover, 0.0, np.minimum(LINE_WIDTH / pixel, 1.0))
        picture -= strength * cover.max(-1, keepdims=True)
    # fades from the border of what the picture shows of the plane through the target
    shown = camera.distance * np.tan(0.5 * np.radians(camera.field_of_view))
    away = np.linalg.norm(point - camera.target[:2], axis=-1, keepdims=True) / shown
    fade = np.clip((away - FADE[0]) / (FADE[1] - FADE[0]), 0.0, 1.0)
    picture += fade * fade * (3.0 - 2.0 * fade) * (HORIZON - picture)
    upwards = np.clip(ray[..., 2:] / np.linalg.norm(ray, axis=-1, keepdims=True), 0.0, 1.0)
    sky = HORIZON + np.sqrt(upwards) * (ZENITH - HORIZON)
    return np.where(down[..., None], picture, sky).astype(np.uint8), depth


def _footprint(camera: Camera, ray: Array, height: int, above: float) -> Array:
    """m, how far the ground's point moves along x and y from one pixel to the next."""
    pixel = 1.0 / camera.focal_length(height)
    steep = np.maximum(-ray[..., 2:], 1e-4)
    moved = [
        pixel * above / steep * np.abs(axis[:2] + ray[..., :2] * axis[2] / steep)
        for axis in camera.axes[:2]
    ]
    return np.asarray(moved[0] + moved[1] + 1e-9)
