"""Points spread over the surface of a shape, with normals and areas, for integrals over it.

Solids of revolution: Gauss points along the profile, or evenly spaced ones on a closed profile,
times evenly spaced angles. Boxes: Gauss points on each face. So the integral of a polynomial of low
degree is exact; that of a function that is cut off where a face turns away from the flow converges.
A compound, and particles, have the points of their parts without those inside of other parts. A
mesh has the centres of its triangles, the larger of which are divided.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.mesh import Mesh
from physics.scene.part import Part
from physics.scene.particles import Particles
from physics.scene.shapes import Box, Capsule, Shape, Sphere
from physics.scene.torus import Torus

Array = np.ndarray


class SurfacePoints(NamedTuple):
    """Points of a surface in the body frame.

    Attributes:
        positions: [n, 3] m.
        normals: [n, 3], outward unit vectors.
        areas: [n] m^2; their sum is the area of the surface.
    """

    positions: Array
    normals: Array
    areas: Array


class _Profile(NamedTuple):
    """Points of half a cross section: [k] each.

    Attributes:
        r: m, distance from the z axis.
        z: m.
        normal_r: outward normal along r.
        normal_z: along z.
        area: m^2 per rad about the axis.
    """

    r: Array
    z: Array
    normal_r: Array
    normal_z: Array
    area: Array


def surface_points(shape: Shape, count: int) -> SurfacePoints:
    """About `count` points of a shape's surface.

    Raises:
        TypeError: the shape is of no type that has surface points.
    """
    for kind, make in _MAKERS.items():
        if isinstance(shape, kind):
            return make(shape, count)
    known = ", ".join(kind.__name__ for kind in _MAKERS)
    raise TypeError(f"SurfaceDrag acts on bodies with one of the shapes {known}, got {shape!r}")


def _gauss(low: float, high: float, count: int) -> tuple[Array, Array]:
    """Gauss points and weights of an interval."""
    points, weights = np.polynomial.legendre.leggauss(count)
    half = 0.5 * (high - low)
    return low + half * (points + 1.0), half * weights


def _number(length: float, apart: float) -> int:
    """Of points on a length, both in m: at least two."""
    return max(2, math.ceil(length / apart - 1e-9))


def _of_revolution(profiles: list[_Profile], apart: float) -> SurfacePoints:
    """Profiles turned about z, with points at most about `apart` m from each other."""
    blocks = []
    for r, z, normal_r, normal_z, area in profiles:
        count = 4 * _number(0.5 * math.pi * float(r.max()), apart)
        angle = 2.0 * np.pi * (np.arange(count) + 0.5) / count
        cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
        one = np.ones_like(cosine)
        rows = (r * cosine, r * sine, z * one, normal_r * cosine, normal_r * sine, normal_z * one,
                2.0 * np.pi / count * area * one)  # fmt: skip
        blocks.append(np.stack([row.ravel() for row in rows], axis=1))
    table = np.concatenate(blocks)
    return SurfacePoints(table[:, :3], table[:, 3:6], table[:, 6])


def _half_sphere(radius: float, center: float, side: float, apart: float) -> _Profile:
    """A half sphere about z = center, on the `side` +1 or -1; radius and center in m."""
    u, w = _gauss(0.0, 1.0, _number(0.5 * math.pi * radius, apart))
    across = np.sqrt(1.0 - u * u)
    return _Profile(radius * across, center + side * radius * u, across, side * u, radius**2 * w)


def _tube(radius: float, half_length: float, apart: float) -> _Profile:
    """The side of a cylinder."""
    z, w = _gauss(-half_length, half_length, _number(2.0 * half_length, apart))
    return _Profile(0.0 * z + radius, z, 0.0 * z + 1.0, 0.0 * z, radius * w)


def _disc(radius: float, z: float, apart: float) -> _Profile:
    """A disc at height z m, facing away from z = 0."""
    square, w = _gauss(0.0, radius**2, _number(radius, apart))
    flat = 0.0 * square
    return _Profile(np.sqrt(square), flat + z, flat, flat + math.copysign(1.0, z), 0.5 * w)


def _apart(area: float, count: int) -> float:
    """Distance of points in m of which each has an equal part of an area in m^2."""
    return math.sqrt(area / count)


def _sphere(shape: Sphere, count: int) -> SurfacePoints:
    apart = _apart(4.0 * math.pi * shape.radius**2, count)
    return _of_revolution([_half_sphere(shape.radius, 0.0, s, apart) for s in (-1.0, 1.0)], apart)


def _capsule(shape: Capsule, count: int) -> SurfacePoints:
    r, half = shape.radius, shape.half_length
    apart = _apart(4.0 * math.pi * r * (r + half), count)
    caps = [_half_sphere(r, side * half, side, apart) for side in (-1.0, 1.0)]
    return _of_revolution([_tube(r, half, apart), *caps], apart)


def _cylinder(shape: Cylinder, count: int) -> SurfacePoints:
    r, half = shape.radius, shape.half_length
    apart = _apart(2.0 * math.pi * r * (r + 2.0 * half), count)
    discs = [_disc(r, side * half, apart) for side in (-1.0, 1.0)]
    return _of_revolution([_tube(r, half, apart), *discs], apart)


def _torus(shape: Torus, count: int) -> SurfacePoints:
    R, a = shape.major_radius, shape.minor_radius
    apart = _apart(4.0 * math.pi**2 * R * a, count)
    k = 4 * max(4, _number(0.5 * math.pi * a, apart))  # fewer blur where the tube turns away
    angle = 2.0 * np.pi * (np.arange(k) + 0.5) / k
    cosine, sine = np.cos(angle), np.sin(angle)
    r = R + a * cosine
    return _of_revolution([_Profile(r, a * sine, cosine, sine, 2.0 * np.pi / k * a * r)], apart)


def _box(shape: Box, count: int) -> SurfacePoints:
    half = shape.half_extents
    a, b, c = half
    apart = _apart(8.0 * (a * b + b * c + c * a), count)
    blocks = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        x, p = _gauss(-half[u], half[u], _number(2.0 * half[u], apart))
        y, q = _gauss(-half[v], half[v], _number(2.0 * half[v], apart))
        for side in (-1.0, 1.0):
            rows = np.zeros((len(x) * len(y), 7))
            rows[:, u], rows[:, v] = np.repeat(x, len(y)), np.tile(y, len(x))
            rows[:, axis], rows[:, 3 + axis] = side * half[axis], side
            rows[:, 6] = np.outer(p, q).ravel()
            blocks.append(rows)
    table = np.concatenate(blocks)
    return SurfacePoints(table[:, :3], table[:, 3:6], table[:, 6])


def _compound(shape: Compound, count: int) -> SurfacePoints:
    parts = [part for part in shape.parts if isinstance(part, Part)]
    each = [surface_points(part.shape, max(1, count // len(parts))) for part in parts]
    found = []
    for i, (part, points) in enumerate(zip(parts, each, strict=True)):
        places = part.outward(points.positions)
        others = [other.distance(places) for j, other in enumerate(parts) if j != i]
        free = np.min(others, axis=0) > 0.0 if others else np.ones(len(places), dtype=bool)
        turned = points.normals @ part.rotation.T
        found.append(SurfacePoints(places[free], turned[free], points.areas[free]))
    return _joined(found)


def _particles(shape: Particles, count: int) -> SurfacePoints:
    ball = surface_points(Sphere(shape.radius), max(1, count // len(shape.points)))
    found = []
    for i, center in enumerate(shape.points):
        places = center + ball.positions
        others = np.delete(shape.points, i, axis=0)
        near = others[np.sum((others - center) ** 2, axis=1) < 4.0 * shape.radius**2]
        squares = np.sum((places[:, None] - near) ** 2, axis=2)
        free = np.all(squares > shape.radius**2, axis=1)
        found.append(SurfacePoints(places[free], ball.normals[free], ball.areas[free]))
    return _joined(found)


def _mesh(shape: Mesh, count: int) -> SurfacePoints:
    corners = shape.triangles
    largest = float(np.linalg.norm(_area_vectors(corners), axis=1).sum()) / count
    while True:
        areas = np.linalg.norm(_area_vectors(corners), axis=1)
        large = areas > largest * (1.0 + 1e-9)
        if not large.any():
            break
        whole = corners[large]
        middles = 0.5 * (whole + np.roll(whole, -1, axis=1))  # of the edges that begin at a corner
        tips = [np.stack([whole[:, k], middles[:, k], middles[:, k - 1]], axis=1) for k in range(3)]
        corners = np.concatenate([corners[~large], middles, *tips])
    vectors = _area_vectors(corners)
    areas = np.linalg.norm(vectors, axis=1)
    solid = areas > 0.0
    return SurfacePoints(
        corners[solid].mean(axis=1), vectors[solid] / areas[solid, None], areas[solid]
    )


def _area_vectors(corners: Array) -> Array:
    """Outward normals [n, 3] of triangles [n, 3, 3], with the area in m^2 as their length."""
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    return 0.5 * np.cross(second - first, third - first)


def _joined(parts: list[SurfacePoints]) -> SurfacePoints:
    """All points in one."""
    return SurfacePoints(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


_MAKERS: dict[type, Callable[[Any, int], SurfacePoints]] = {
    Sphere: _sphere,
    Box: _box,
    Capsule: _capsule,
    Cylinder: _cylinder,
    Torus: _torus,
    Compound: _compound,
    Particles: _particles,
    Mesh: _mesh,
}
