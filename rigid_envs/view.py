"""What a picture shows, before any pixel is drawn: solids, camera, paint order, light and ground.

World frame: metres, z up, ground at z = 0. The ground has lines every 5 cm, stronger lines and a
checker every 10 cm, so that a picture has a scale.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from physics.rotation import rotation_matrix
from physics.validation import number, positive, unit_quaternion, vector

Array = np.ndarray
Color = tuple[int, int, int]

LINE_SPACING = 0.05  # m, between lines of the ground; every second one is emphasised
LINE_WIDTH = 0.0012  # m
GROUND, GROUND_TILE, HORIZON = np.array([[236, 238, 241], [228, 231, 236], [250, 251, 253]])
TO_LIGHT = np.array([-0.22, -0.52, 0.825]) / np.linalg.norm([-0.22, -0.52, 0.825])
LIGHT_SIZE = 0.06  # half-width over distance: shadows are sharp at contacts and soft from above
SHADOW_SAMPLES = 10  # points of the light that cast a shadow each
NEAR = 0.1  # least depth that is drawn, as a share of the camera's distance

_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_ROUND_TRIP = (0, 1, 3, 2, 6, 7, 5, 4)  # along edges past all corners; in it each face is in order
# axis, side and corners of a box's faces
FACES = [
    (axis, side, [k for k in _ROUND_TRIP if _SIGNS[k, axis] == side])
    for axis in range(3)
    for side in (-1, 1)
]
_TURN = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
CIRCLE = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=-1)
ACROSS_LIGHT = np.linalg.svd(TO_LIGHT[None])[2][1:]  # [2, 3], unit vectors normal to the light
# the light's points lie on a sunflower's spiral, which covers a disc evenly
_SPIRAL = [
    np.sqrt((k + 0.5) / SHADOW_SAMPLES) * np.array([np.cos(2.4 * k), np.sin(2.4 * k)])
    for k in range(SHADOW_SAMPLES)
]
LIGHTS = TO_LIGHT + LIGHT_SIZE * np.array(_SPIRAL) @ ACROSS_LIGHT  # [samples, 3]


@dataclass(frozen=True, eq=False)
class Item:
    """A solid to draw.

    Attributes:
        shape: a Sphere, Box or Capsule of `physics`.
        position: (3,) m.
        orientation: (4,) quaternion x, y, z, w.
        color: red, green, blue in 0..255.

    Raises:
        TypeError: a shape of another type.
        ValueError: a position that is not three finite numbers, or a quaternion of zero length.
    """

    shape: Any
    position: Array
    orientation: Array
    color: Color

    def __post_init__(self) -> None:
        """Checks all values and makes the quaternion one of unit length."""
        kind = type(self.shape).__name__
        if kind not in ("Sphere", "Box", "Capsule"):
            raise TypeError(f"Item.shape must be a Sphere, Box or Capsule to be drawn, got {kind}")
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
    color: Color = (46, 174, 96)

    def __post_init__(self) -> None:
        """Checks position and radius."""
        object.__setattr__(self, "position", np.array(vector("Goal.position", self.position)))
        positive("Goal.radius", self.radius)


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


@dataclass(frozen=True)
class Camera:
    """A perspective camera.

    Attributes:
        target: (3,) m, the point in the middle of the picture.
        distance: m, from the target to the eye.
        azimuth: degrees about z of the eye as seen from the target. At -90, x points to the right
            of the picture and y into it.
        elevation: degrees of the eye above the horizontal, 1 to 90.
        field_of_view: degrees, over the height of the picture, 1 to 150.

    Raises:
        TypeError: a value is not a number.
        ValueError: a value is not finite or out of its range.
    """

    target: tuple[float, ...] = (0.0, 0.0, 0.0)
    distance: float = 0.88
    azimuth: float = -70.0
    elevation: float = 38.0
    field_of_view: float = 32.0

    def __post_init__(self) -> None:
        """Checks all values; the target becomes a tuple, as pictures are cached by camera."""
        object.__setattr__(self, "target", vector("Camera.target", self.target))
        positive("Camera.distance", self.distance)
        number("Camera.azimuth", self.azimuth)
        number("Camera.elevation", self.elevation, low=1.0, high=90.0)
        number("Camera.field_of_view", self.field_of_view, low=1.0, high=150.0)

    @cached_property
    def axes(self) -> Array:
        """[3, 3], rows are the world directions of the picture's right, up and forward."""
        a, e = np.radians([self.azimuth, self.elevation])
        outward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.stack([right, np.cross(outward, right), -outward])

    @cached_property
    def eye(self) -> Array:
        """[3] m, where the camera stands."""
        return np.array(self.target) - self.distance * self.axes[2]

    @property
    def near(self) -> float:
        """Least depth that is drawn, in m."""
        return NEAR * self.distance

    def focal_length(self, height: int) -> float:
        """Size in pixels of a metre at a depth of a metre, in a picture `height` pixels high."""
        return float(0.5 * height / np.tan(0.5 * np.radians(self.field_of_view)))

    def project(self, points: Array, width: int, height: int) -> tuple[Array, Array]:
        """Where world points appear in a picture of `width` x `height` pixels.

        Args:
            points: [..., 3] m; a depth less than `near` counts as `near`.
            width: pixels.
            height: pixels.

        Returns:
            Pixels [..., 2], right and down from the top left corner, and depths [...] m.
        """
        right, up, depth = np.moveaxis((points - self.eye) @ self.axes.T, -1, 0)
        scale = self.focal_length(height) / np.maximum(depth, self.near)
        return np.stack([0.5 * width + scale * right, 0.5 * height - scale * up], -1), depth


class Solids:
    """Items, and after them the balls of goals, as rounded boxes.

    Attributes:
        centre: [n, 3] m.
        axes: [n, 3, 3], columns are the body's axes in the world.
        half: [n, 3] m, half extents of the core; zero for a ball, along z for a capsule.
        radius: [n] m, by which the core is rounded; zero for a box.
        corners: [n, 8, 3] m, of the core, in the order of `_SIGNS`.
    """

    def __init__(self, items: Sequence[Item], balls: Sequence[Goal]) -> None:
        count = len(items) + len(balls)
        centres = [item.position for item in items] + [ball.position for ball in balls]
        turns = [item.orientation for item in items] + [np.array([0.0, 0.0, 0.0, 1.0])] * len(balls)
        self.centre = np.array(centres).reshape(count, 3)
        self.axes = rotation_matrix(np.array(turns).reshape(count, 4))
        self.half, self.radius = np.zeros((count, 3)), np.zeros(count)
        for i, item in enumerate(items):
            self.half[i] = getattr(item.shape, "half_extents", 0.0)
            self.half[i, 2] += getattr(item.shape, "half_length", 0.0)
            self.radius[i] = getattr(item.shape, "radius", 0.0)
        self.radius[len(items) :] = [min(ball.radius, ball.position[2]) for ball in balls]
        spokes = np.einsum("nij,kj,nj->nki", self.axes, _SIGNS, self.half)
        self.corners = self.centre[:, None] + spokes

    def outline(self, across: Array) -> Array:
        """Silhouettes [n, 36, 3] m as seen along the normal of `across` [2, 3], two unit vectors.

        Each point is the solid's furthest one in a direction of the plane; a box has as many
        different ones as its silhouette has corners.
        """
        ways = CIRCLE @ across
        signs = np.sign(np.einsum("kj,nji->nki", ways, self.axes))
        core = np.einsum("nij,nkj,nj->nki", self.axes, signs, self.half)
        return self.centre[:, None] + core + self.radius[:, None, None] * ways

    def is_in_front(self, a: int, b: int, eye: Array) -> bool:
        """Whether solid a can hide solid b from `eye` [3] m.

        Two convex solids apart have a plane between them, and only the one on the eye's side can
        hide the other; an order by distance fails for a small solid beside a large one. The plane
        is sought across the face normals and the shortest ways from a centre to the other's core.
        Touching solids overlap a little, so the plane of least overlap decides.
        """
        between = self.centre[a] - self.centre[b]
        ways = [*self.axes[a].T, *self.axes[b].T]
        for i, sight in ((a, -between), (b, between)):
            local = sight @ self.axes[i]
            ways.append(self.axes[i] @ (local - np.clip(local, -self.half[i], self.half[i])))
        length = np.linalg.norm(ways, axis=1)
        unit = np.array(ways)[length > 1e-9] / length[length > 1e-9, None]
        unit *= np.where(unit @ between < 0.0, -1.0, 1.0)[:, None]  # from b to a
        reach_a = np.abs(unit @ self.axes[a]) @ self.half[a] + self.radius[a]
        reach_b = np.abs(unit @ self.axes[b]) @ self.half[b] + self.radius[b]
        gap = unit @ between - reach_a - reach_b
        k = gap.argmax()
        return bool(unit[k] @ (eye - self.centre[b]) > reach_b[k] + 0.5 * gap[k])

    def paint_order(self, eye: Array) -> list[int]:
        """All indices, each after those of the solids that it can hide from `eye` [3] m."""
        sight = self.centre - eye
        distance = np.linalg.norm(sight, axis=1)
        sight /= distance[:, None]
        size = 1.2 * (np.linalg.norm(self.half, axis=1) + self.radius) / distance  # rad, generous
        meet = np.linalg.norm(sight[:, None] - sight, axis=2) < size[:, None] + size
        behind: list[set[int]] = [set() for _ in distance]
        for a, b in np.argwhere(np.triu(meet, 1)).tolist():
            front, back = (a, b) if self.is_in_front(a, b, eye) else (b, a)
            behind[front].add(back)
        order: list[int] = []
        waiting: list[int] = np.argsort(-distance).tolist()
        while waiting:  # a ring of solids, possible but rare, is cut where the fewest lie behind
            free = min(waiting, key=lambda i: len(behind[i].intersection(waiting)))
            order.append(free)
            waiting.remove(free)
        return order


def shade(color: Color, normals: Array, to_eye: Array, gloss: float) -> Array:
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
