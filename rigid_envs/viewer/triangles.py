"""Triangles of the engine's shapes, as a browser draws them."""

from typing import Any, NamedTuple

import numpy as np

from physics import Box, Capsule, Compound, Cylinder, Mesh, Part, Sphere, Torus
from physics import Particles as ParticleShape
from physics.rotation import rotate

Array = np.ndarray

BEVEL = 0.06  # radius of a drawn box's edges, as a fraction of its smallest half width
ROUND = 48  # sides of what is drawn for a circle, a multiple of 4
COARSE = 16  # the same for each ball of many


class Triangles(NamedTuple):
    """Vertices [n, 3] m in the body frame and faces [m, 3], counterclockwise from outside."""

    vertices: Array
    faces: Array


def triangles(shape: Any) -> Triangles:
    """The surface of a shape.

    Raises:
        TypeError: not a shape that can be drawn.
    """
    match shape:
        case Sphere():
            return rounded(np.zeros(3), shape.radius)
        case Capsule():
            return rounded(np.array([0.0, 0.0, shape.half_length]), shape.radius)
        case Box():
            radius = BEVEL * min(shape.half_extents)
            return rounded(np.array(shape.half_extents) - radius, radius, sides=12)
        case Cylinder():
            return cylinder(shape.radius, shape.half_length)
        case Torus():
            return _torus(shape.major_radius, shape.minor_radius)
        case Mesh():  # no shared vertices, so that its edges look sharp
            corners = shape.triangles.reshape(-1, 3)
            return Triangles(corners, np.arange(len(corners)).reshape(-1, 3))
        case ParticleShape():
            radii = np.broadcast_to(shape.radius, len(shape.points))
            balls = [rounded(np.zeros(3), float(radius), sides=COARSE) for radius in radii]
            pairs = zip(balls, shape.points, strict=True)
            return _joined([ball._replace(vertices=ball.vertices + p) for ball, p in pairs])
        case Compound():
            return _joined([_placed(part) for part in shape.parts])
    raise TypeError(f"a {type(shape).__name__} can't be drawn")


def rounded(core: Array, radius: float, sides: int = ROUND) -> Triangles:
    """A box of half extents `core` [3] m rounded by `radius` m: also a ball or a capsule.

    A sphere is cut into octants, and each octant is moved to its corner of the core.

    Args:
        core: half extents in m; zero along axes in which the shape has no core.
        radius: m.
        sides: of a circle, a multiple of 4.
    """
    quarter = np.linspace(0.0, 0.5 * np.pi, sides // 4 + 1)
    azimuth = np.concatenate([quarter + k * 0.5 * np.pi for k in range(4)])
    signs_x = np.repeat([1.0, -1.0, -1.0, 1.0], len(quarter))
    signs_y = np.repeat([1.0, 1.0, -1.0, -1.0], len(quarter))
    latitude = np.concatenate([quarter - 0.5 * np.pi, quarter])
    signs_z = np.repeat([-1.0, 1.0], len(quarter))
    up, around = np.meshgrid(latitude, azimuth, indexing="ij")
    directions = np.stack(
        [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1
    )
    signs = np.stack(np.broadcast_arrays(signs_x, signs_y, signs_z[:, None]), axis=-1)
    points = signs * core + radius * directions
    rows, columns = up.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    corners = np.arange(4) * len(quarter)
    top, bottom = index[-1, corners], index[0, corners]
    caps = [top[[0, 1, 2]], top[[0, 2, 3]], bottom[[0, 2, 1]], bottom[[0, 3, 2]]]
    faces = np.concatenate([_quads(index, wrap_rows=False), caps])
    return _merged(points.reshape(-1, 3), faces)


def cylinder(radius: float, half_length: float) -> Triangles:
    """A cylinder about z with sharp rims."""
    turn = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    circle = radius * np.stack([np.cos(turn), np.sin(turn), np.zeros(ROUND)], axis=-1)
    lift = np.array([0.0, 0.0, half_length])
    side = np.stack([circle - lift, circle + lift])
    index = np.arange(2 * ROUND).reshape(2, ROUND)
    fan = np.stack([np.zeros(ROUND - 2), np.arange(1, ROUND - 1), np.arange(2, ROUND)], axis=-1)
    parts = [
        Triangles(side.reshape(-1, 3), _quads(index, wrap_rows=False)),
        Triangles(circle + lift, fan.astype(int)),
        Triangles(circle - lift, fan.astype(int)[:, ::-1]),
    ]
    return _joined(parts)


def _torus(major: float, minor: float) -> Triangles:
    turn = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    across, around = np.meshgrid(turn, turn, indexing="ij")
    out = major + minor * np.cos(across)
    points = np.stack([out * np.cos(around), out * np.sin(around), minor * np.sin(across)], axis=-1)
    index = np.arange(ROUND * ROUND).reshape(ROUND, ROUND)
    return Triangles(points.reshape(-1, 3), _quads(index, wrap_rows=True))


def _quads(index: Array, wrap_rows: bool) -> Array:
    """Two triangles for each cell of a grid of vertices [rows, columns]; columns form a ring."""
    if wrap_rows:
        index = np.concatenate([index, index[:1]])
    right = np.roll(index, -1, axis=1)
    a, b, c, d = index[:-1], right[:-1], right[1:], index[1:]
    return np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)


def _merged(points: Array, faces: Array) -> Triangles:
    """Equal vertices become one, and triangles without area are left out."""
    scale = max(float(np.abs(points).max()), 1e-12)
    _, first, place = np.unique(
        np.round(points / scale, 9), axis=0, return_index=True, return_inverse=True
    )
    faces = place.reshape(-1)[faces]
    proper = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return Triangles(points[first], faces[proper])


def _placed(part: Any) -> Triangles:
    assert isinstance(part, Part)
    local = triangles(part.shape)
    turned = rotate(np.array(part.orientation), local.vertices) + np.array(part.position)
    return local._replace(vertices=turned)


def _joined(parts: list[Triangles]) -> Triangles:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts[:-1], strict=True)]
    return Triangles(np.concatenate([part.vertices for part in parts]), np.concatenate(faces))
