"""Shapes: the geometry of a solid for contacts, mass properties and rendering.

A shape is a core plus a rounding radius. Its surface is the set of points at this radius from the
core. Its samples are points of the core, and each sample makes contact as a sphere of this radius.
The core of a sphere is its centre, the core of a capsule is its axis. The core of a box is slightly
inset, so its edges are rounded and an edge that rests on a face has a defined contact normal. The
outer dimensions of the box do not change.

Each sample has a weight. The stiffness of a sample is its weight times the contact stiffness of a
face. Weights do not depend on which samples touch. On a box, the weights of each face sum to 1,
those of each edge to 3/8, and a corner has 1/8. This holds at every spacing that puts samples on
the edges, so the penetration of a face under a load does not depend on the number of samples. A box
with samples at its corners only has 1/4 at each corner.

With `Fidelity.geometry` "shape" the interior of a face has no samples. Another solid touches it
first with a corner, an edge or a round surface, and that solid's own samples detect the contact.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from physics.scene import mass as mass_properties
from physics.scene.validation import positive, vector

Array = np.ndarray

# kinds of surface that samples are tested against
PLANE, SPHERE, BOX, CAPSULE, PARTICLES, CYLINDER, TORUS, GRID = range(8)


class Samples(NamedTuple):
    """Points at which a solid makes contact.

    Attributes:
        positions: [n, 3] m in the body frame.
        weights: [n], dimensionless fractions of a face's contact stiffness.
        radius: m, one for all samples, or [n] one for each.
        axial: whether they turn about z to face a surface, see `physics.collision.facing`.
    """

    positions: Array
    weights: Array
    radius: Any
    axial: bool = False


class Surface(NamedTuple):
    """A surface that samples are tested against.

    Attributes:
        kind: PLANE, SPHERE, BOX, CAPSULE, PARTICLES, CYLINDER, TORUS or GRID.
        parameters: m, of the core: the half extents of a box; 0, 0 and the half length of a
            capsule; twice the radius and the half length of a cylinder; twice the radius of a
            torus's circle and 0; the height of a plane, 0 and 0; of a grid, a box around the mesh;
            zeros for the other kinds.
        radius: m, rounding radius around the core.
        mesh: of a GRID, the Mesh.
    """

    kind: int
    parameters: tuple[float, float, float]
    radius: float
    mesh: Any = None


@runtime_checkable
class Shape(Protocol):
    """The interface of a shape. The origin of a shape's frame is its centre of mass."""

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
        """Principal moments [..., 3] in kg m^2 of a homogeneous solid of mass [...] in kg."""

    def scaled(self, factor: float) -> "Shape":
        """The shape with each length multiplied by `factor`."""

    def samples(self, spacing: float, rounding: float) -> Samples:
        """Samples of the core, for `Fidelity.geometry` "shape".

        Args:
            spacing: m, largest distance between neighbouring samples.
            rounding: m, radius of edges that are otherwise sharp; the core is inset by it.
        """

    def particles(self, spacing: float) -> Samples:
        """Spheres that cover the surface, for `Fidelity.geometry` "particle".

        Args:
            spacing: m, approximate distance between the centres of neighbouring spheres.
        """

    def surface(self, rounding: float) -> Surface:
        """The exact surface.

        Args:
            rounding: m, radius of edges that are otherwise sharp.
        """


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
        """The shape with each length multiplied by `factor`."""
        return Sphere(factor * self.radius)

    def samples(self, spacing: float, rounding: float) -> Samples:
        """One sample at the centre; it represents the sphere exactly."""
        return Samples(np.zeros((1, 3)), np.ones(1), self.radius)

    def particles(self, spacing: float) -> Samples:
        """One particle: the sphere itself."""
        return self.samples(spacing, 0.0)

    def surface(self, rounding: float) -> Surface:
        """A point as the core, with the sphere's radius."""
        return Surface(SPHERE, (0.0, 0.0, 0.0), self.radius)


@dataclass(frozen=True)
class Box:
    """A cuboid.

    Args:
        half_extents: (x, y, z) in m, half of the width along each body axis, above zero.
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
        """The shape with each length multiplied by `factor`."""
        x, y, z = self.half_extents
        return Box((factor * x, factor * y, factor * z))

    def samples(self, spacing: float, rounding: float) -> Samples:
        """Samples at the corners and along the edges of the inset core."""
        core = np.array(self.half_extents) - rounding
        counts = np.ceil(2.0 * np.array(self.half_extents) / spacing - 1e-9).astype(int)
        if counts.max() > 1:  # samples along some edges only would give faces different weights
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
        """A lattice of equal spheres over the surface.

        Their diameter is about `spacing` m. All have the same weight. The weights of the face with
        the most spheres sum to 1.
        """
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
        """A box as the core, inset by `rounding` m."""
        x, y, z = self.half_extents
        return Surface(BOX, (x - rounding, y - rounding, z - rounding), rounding)


@dataclass(frozen=True)
class Capsule:
    """A cylinder with a half sphere at each end. Its axis is the body's z axis.

    Args:
        radius: m, above zero.
        half_length: m, half of the length of the cylinder without its caps, above zero.
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
        """The shape with each length multiplied by `factor`."""
        return Capsule(factor * self.radius, factor * self.half_length)

    def samples(self, spacing: float, rounding: float) -> Samples:
        """Samples on the axis; their weights sum to 1.

        Each end has 1/3, or 1/2 if there are no samples between the ends.
        """
        count = max(1, math.ceil(2.0 * self.half_length / spacing - 1e-9))
        positions = np.zeros((count + 1, 3))
        positions[:, 2] = np.linspace(-self.half_length, self.half_length, count + 1)
        weights = np.full(count + 1, 1.0 / 3.0 / max(count - 1, 1))
        weights[[0, -1]] = 1.0 / 2.0 if count == 1 else 1.0 / 3.0
        return Samples(positions, weights, self.radius)

    def particles(self, spacing: float) -> Samples:
        """Spheres of the capsule's radius along the axis, at most one radius apart."""
        return self.samples(min(spacing, self.radius), 0.0)

    def surface(self, rounding: float) -> Surface:
        """A line segment as the core, with the capsule's radius."""
        return Surface(CAPSULE, (0.0, 0.0, self.half_length), self.radius)
