"""Shapes: what a body looks like to a contact, to a scale and to a camera.

A shape is a core plus a rounding radius. Its surface is the set of points at that radius from the
core, its samples lie on the core and each carries a sphere of the radius. A sphere's core is its
centre and a capsule's its axis. A box is rounded a little, so that an edge that rests on a face has
a defined normal; its outer faces stay where the user put them.

Samples carry weights. A body's contact stiffness is shared out by them, and they are fixed, so the
sink under a load depends neither on the number of samples nor on the number that touch. A box's
weight is spread over corners and edges such that each face has 1 in sum, each edge 3/8 and each
corner 1/8, at every spacing that samples edges (corners alone have 1/4 each). The inside of a face
carries no sample in the `shape` geometry: the first touch with it is always a corner or an edge of
the other body, which has its own.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from physics.scene import mass as mass_properties
from physics.scene.validation import positive, vector

Array = np.ndarray

# kinds of surface that a sample can be tested against
PLANE, SPHERE, BOX, CAPSULE, PARTICLES = range(5)


class Samples(NamedTuple):
    """Points that make contact.

    Attributes:
        positions: [n, 3] m in the body frame.
        weights: [n].
        radius: m, of all; or [n] of each.
    """

    positions: Array
    weights: Array
    radius: Any


class Surface(NamedTuple):
    """What samples are tested against: kind, three parameters of the core, rounding radius m."""

    kind: int
    parameters: tuple[float, float, float]
    radius: float


@runtime_checkable
class Shape(Protocol):
    """What the engine asks of a shape. Frames are centred at the centre of mass."""

    @property
    def volume(self) -> float:
        """Volume in m^3."""

    @property
    def width(self) -> float:
        """Smallest width in m."""

    @property
    def reach(self) -> float:
        """Largest distance of a surface point from the centre, in m."""

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2 of the solid with this mass [...] in kg."""

    def scaled(self, factor: float) -> "Shape":
        """The same shape, each length times a factor."""

    def samples(self, spacing: float, rounding: float) -> Samples:
        """Core samples at most `spacing` m apart, the core inset by `rounding` m."""

    def particles(self, spacing: float) -> Samples:
        """Spheres about `spacing` m wide that cover the surface."""

    def surface(self, rounding: float) -> Surface:
        """The exact surface, its edges rounded by `rounding` m where they are sharp."""


@dataclass(frozen=True)
class Sphere:
    """A ball.

    Args:
        radius: m, above zero.
    """

    radius: float

    def __post_init__(self) -> None:
        """Checks the radius."""
        object.__setattr__(self, "radius", positive("Sphere.radius", self.radius))

    @property
    def volume(self) -> float:
        """Volume in m^3."""
        return 4.0 / 3.0 * math.pi * self.radius**3

    @property
    def width(self) -> float:
        """Diameter in m."""
        return 2.0 * self.radius

    @property
    def reach(self) -> float:
        """Radius in m."""
        return self.radius

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2."""
        return mass_properties.sphere_inertia(mass, self.radius)

    def scaled(self, factor: float) -> "Sphere":
        """The same shape, each length times a factor."""
        return Sphere(factor * self.radius)

    def samples(self, spacing: float, rounding: float) -> Samples:
        """The centre alone: exact."""
        return Samples(np.zeros((1, 3)), np.ones(1), self.radius)

    def particles(self, spacing: float) -> Samples:
        """One particle: a sphere is one."""
        return self.samples(spacing, 0.0)

    def surface(self, rounding: float) -> Surface:
        """A point core with the sphere's radius."""
        return Surface(SPHERE, (0.0, 0.0, 0.0), self.radius)


@dataclass(frozen=True)
class Box:
    """A cuboid.

    Args:
        half_extents: (x, y, z) in m, half the width along each body axis, above zero.
    """

    half_extents: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Checks the extents."""
        extents = vector("Box.half_extents", self.half_extents)
        for axis, extent in zip("xyz", extents, strict=True):
            positive(f"Box.half_extents ({axis})", extent)
        object.__setattr__(self, "half_extents", extents)

    @property
    def volume(self) -> float:
        """Volume in m^3."""
        return 8.0 * math.prod(self.half_extents)

    @property
    def width(self) -> float:
        """Smallest width in m."""
        return 2.0 * min(self.half_extents)

    @property
    def reach(self) -> float:
        """Distance of a corner from the centre, in m."""
        return math.hypot(*self.half_extents)

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2."""
        return mass_properties.box_inertia(mass, np.array(self.half_extents))

    def scaled(self, factor: float) -> "Box":
        """The same shape, each length times a factor."""
        x, y, z = self.half_extents
        return Box((factor * x, factor * y, factor * z))

    def samples(self, spacing: float, rounding: float) -> Samples:
        """Corners, and points along the edges."""
        core = np.array(self.half_extents) - rounding
        counts = np.ceil(2.0 * np.array(self.half_extents) / spacing - 1e-9).astype(int)
        if counts.max() > 1:  # with points on some edges only, faces would differ in weight
            counts = np.maximum(counts, 2)
        corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * core
        positions = [corners]
        weights = [np.full(8, 1 / 8 if counts.max() > 1 else 1 / 4)]
        for axis, count in enumerate(counts):
            along = np.linspace(-core[axis], core[axis], count + 1)[1:-1]
            for u in (-1, 1):
                for v in (-1, 1):
                    points = np.empty((len(along), 3))
                    points[:, axis] = along
                    points[:, (axis + 1) % 3] = u * core[(axis + 1) % 3]
                    points[:, (axis + 2) % 3] = v * core[(axis + 2) % 3]
                    positions.append(points)
                    weights.append(np.full(len(along), 1 / 8 / max(len(along), 1)))
        return Samples(np.concatenate(positions), np.concatenate(weights), rounding)

    def particles(self, spacing: float) -> Samples:
        """A lattice of spheres over the surface; a face has weight 1 in sum if all are alike."""
        widths = 2.0 * np.array(self.half_extents)
        counts = np.maximum(2, np.round(widths / spacing).astype(int))
        radius = float(np.min(widths / counts)) / 2.0
        axes = [
            np.linspace(radius - h, h - radius, n)
            for h, n in zip(self.half_extents, counts, strict=True)
        ]
        lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        index = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1)
        outside = np.any((index == 0) | (index == counts - 1), axis=-1)
        positions = lattice[outside]
        face = max(counts[i] * counts[j] for i, j in ((0, 1), (1, 2), (0, 2)))
        return Samples(positions, np.full(len(positions), 1.0 / face), radius)

    def surface(self, rounding: float) -> Surface:
        """A box core inset by the rounding."""
        x, y, z = self.half_extents
        return Surface(BOX, (x - rounding, y - rounding, z - rounding), rounding)


@dataclass(frozen=True)
class Capsule:
    """A cylinder with half spheres at its ends; its axis is the body's z axis.

    Args:
        radius: m, above zero.
        half_length: m, half the length of the cylinder without its caps, above zero.
    """

    radius: float
    half_length: float

    def __post_init__(self) -> None:
        """Checks radius and length."""
        object.__setattr__(self, "radius", positive("Capsule.radius", self.radius))
        object.__setattr__(self, "half_length", positive("Capsule.half_length", self.half_length))

    @property
    def volume(self) -> float:
        """Volume in m^3."""
        return math.pi * self.radius**2 * (2.0 * self.half_length + 4.0 / 3.0 * self.radius)

    @property
    def width(self) -> float:
        """Diameter in m."""
        return 2.0 * self.radius

    @property
    def reach(self) -> float:
        """Distance of a tip from the centre, in m."""
        return self.radius + self.half_length

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2."""
        return mass_properties.capsule_inertia(mass, self.radius, self.half_length)

    def scaled(self, factor: float) -> "Capsule":
        """The same shape, each length times a factor."""
        return Capsule(factor * self.radius, factor * self.half_length)

    def samples(self, spacing: float, rounding: float) -> Samples:
        """Points on the axis; lying flat it has weight 1 in sum, on a tip a third or a half."""
        count = max(1, math.ceil(2.0 * self.half_length / spacing - 1e-9))
        positions = np.zeros((count + 1, 3))
        positions[:, 2] = np.linspace(-self.half_length, self.half_length, count + 1)
        weights = np.full(count + 1, 1.0 / 3.0 / max(count - 1, 1))
        weights[[0, -1]] = 1.0 / 2.0 if count == 1 else 1.0 / 3.0
        return Samples(positions, weights, self.radius)

    def particles(self, spacing: float) -> Samples:
        """Spheres of the capsule's radius along the axis, at most a radius apart."""
        return self.samples(min(spacing, self.radius), 0.0)

    def surface(self, rounding: float) -> Surface:
        """A segment core with the capsule's radius."""
        return Surface(CAPSULE, (0.0, 0.0, self.half_length), self.radius)
