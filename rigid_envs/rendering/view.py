"""What a picture shows: solids, what marks a goal, forces; and light and ground."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from physics.scene.validation import positive, unit_quaternion, vector
from rigid_envs.rendering.camera import Camera

Array = np.ndarray
Color = tuple[int, int, int]

LINE_SPACING = 0.05  # m, between lines of the ground; every second one is emphasised
LINE_WIDTH = 0.0012  # m
GROUND, GROUND_TILE, HORIZON = np.array([[236, 238, 241], [228, 231, 236], [250, 251, 253]])
TO_LIGHT = np.array([-0.22, -0.52, 0.825]) / np.linalg.norm([-0.22, -0.52, 0.825])
# of a scene's bodies in turn
BODY_COLORS = ((222, 132, 68), (86, 128, 196), (206, 92, 104), (118, 160, 84), (150, 112, 178))
GOAL_COLOR = (46, 174, 96)


@dataclass(frozen=True, eq=False)
class Particles:
    """Balls that stand for a solid: `positions` [n, 3] m in its frame, `radius` m, or [n]."""

    positions: Array
    radius: float | Array


@dataclass(frozen=True, eq=False)
class Item:
    """A solid to draw.

    Attributes:
        shape: a Sphere, Box, Capsule or Cylinder of `physics`.
        position: (3,) m.
        orientation: (4,) quaternion x, y, z, w.
        color: red, green, blue in 0..255.
        particles: drawn in a faint shape if given.

    Raises:
        TypeError: a shape of another type.
        ValueError: a position that is not three finite numbers, or a quaternion of zero length.
    """

    shape: Any
    position: Array
    orientation: Array
    color: Color
    particles: Particles | None = None

    def __post_init__(self) -> None:
        """Checks all values and makes the quaternion one of unit length."""
        kind = type(self.shape).__name__
        if kind not in ("Sphere", "Box", "Capsule", "Cylinder"):
            raise TypeError(
                f"Item.shape must be a Sphere, Box, Capsule or Cylinder to be drawn, got {kind}"
            )
        turn = unit_quaternion("Item.orientation", self.orientation)
        object.__setattr__(self, "position", np.array(vector("Item.position", self.position)))
        object.__setattr__(self, "orientation", np.array(turn))


@dataclass(frozen=True, eq=False)
class Goal:
    """A target: a translucent disc on the ground, and a ball at `position` (3,) m.

    The ball is smaller than `radius` m where it would sink into the ground, and absent below it.
    """

    position: Array
    radius: float
    color: Color = GOAL_COLOR

    def __post_init__(self) -> None:
        """Checks position and radius."""
        object.__setattr__(self, "position", np.array(vector("Goal.position", self.position)))
        positive("Goal.radius", self.radius)


@dataclass(frozen=True, eq=False)
class Ghost:
    """A place for a solid: a translucent box of its size, whose edges show through all solids.

    Attributes:
        half_extents: (3,) m.
        position: (3,) m, of its centre.
        color: red, green, blue in 0..255.
    """

    half_extents: Array
    position: Array
    color: Color = GOAL_COLOR

    def __post_init__(self) -> None:
        """Checks extents and position."""
        extents = vector("Ghost.half_extents", self.half_extents)
        object.__setattr__(self, "half_extents", np.array(extents))
        object.__setattr__(self, "position", np.array(vector("Ghost.position", self.position)))


@dataclass(frozen=True, eq=False)
class Mark:
    """A cross on the ground, under `position` (3,) m; `radius` m is the length of its arms."""

    position: Array
    radius: float
    color: Color = (196, 30, 58)

    def __post_init__(self) -> None:
        """Checks position and radius."""
        object.__setattr__(self, "position", np.array(vector("Mark.position", self.position)))
        positive("Mark.radius", self.radius)


Marker = Goal | Ghost | Mark
"""What is drawn without being solid."""


@dataclass(frozen=True, eq=False)
class Arrow:
    """An arrow from `origin` (3,) m along `vector` (3,) m, such as a contact force to scale."""

    origin: Array
    vector: Array
    color: Color = (140, 40, 170)

    def __post_init__(self) -> None:
        """Checks both points."""
        object.__setattr__(self, "origin", np.array(vector("Arrow.origin", self.origin)))
        object.__setattr__(self, "vector", np.array(vector("Arrow.vector", self.vector)))


def shade(color: Color | Array, normals: Array, to_eye: Array, gloss: float) -> Array:
    """Colours [..., 3] of surfaces with unit `normals` [..., 3]: sky, sun (Lambert), highlight."""
    light = 0.60 + 0.12 * normals[..., 2:] + 0.44 * np.maximum(normals @ TO_LIGHT[:, None], 0.0)
    halfway = (TO_LIGHT + to_eye) / np.linalg.norm(TO_LIGHT + to_eye)
    highlight = 255.0 * gloss * np.maximum(normals @ halfway[:, None], 0.0) ** 30
    return np.clip(np.array(color) * light + highlight, 0.0, 255.0)


@lru_cache(maxsize=4)
def ground(camera: Camera, width: int, height: int) -> Array:
    """Picture [width, height, 3] of the empty ground: each pixel's ray is cut with z = 0."""
    x = (np.arange(width)[:, None, None] + 0.5 - 0.5 * width) / camera.focal_length(height)
    y = (0.5 * height - np.arange(height)[None, :, None] - 0.5) / camera.focal_length(height)
    ray = camera.axes[2] + x * camera.axes[0] + y * camera.axes[1]
    depth = camera.eye[2] / np.maximum(-ray[..., 2:], 1e-4)
    point = camera.eye[:2] + depth * ray[..., :2]
    along, across = np.abs(np.gradient(point, axis=(0, 1)))
    pixel = along + across + 1e-9  # m, its width on the ground along x and y
    tile = np.floor(point / (2.0 * LINE_SPACING)).sum(-1, keepdims=True) % 2.0
    tile *= np.clip(1.5 - pixel.max(-1, keepdims=True) / LINE_SPACING, 0.0, 1.0)
    picture = GROUND + tile * (GROUND_TILE - GROUND)
    for spacing, strength in ((LINE_SPACING, 20.0), (2.0 * LINE_SPACING, 30.0)):
        offset = np.abs(point - spacing * np.round(point / spacing))
        cover = (0.5 * (LINE_WIDTH + pixel) - offset) / pixel
        cover = np.clip(cover, 0.0, np.minimum(LINE_WIDTH / pixel, 1.0))
        picture -= strength * cover.max(-1, keepdims=True)
    haze = np.clip(0.5 * depth / camera.distance - 0.6, 0.0, 1.0)
    return (picture + haze * (HORIZON - picture)).astype(np.uint8)
