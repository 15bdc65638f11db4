"""Torus: a ring that lies on a circle and rolls upright on a point.

Its core is a circle, with the minor radius around it. As a cylinder it has two sets of samples:

- Over a ground or large static box eight samples of equal weight turn about its axis such that the
  first one faces the surface, see `physics.collision.facing`. So it touches in its lowest point at
  every angle. Flat all of them touch, with the weight 1 in all; upright one touches, with 1/8, as a
  corner of a box.
- Elsewhere they are fixed balls of equal weight, 1 in all, at most one minor radius apart.
"""

import math
from dataclasses import dataclass

import numpy as np

from physics.scene import mass as mass_properties
from physics.scene.cylinder import RIM_SAMPLES, circle
from physics.scene.shapes import TORUS, Samples, Surface
from physics.scene.validation import positive

Array = np.ndarray


@dataclass(frozen=True)
class Torus:
    """A ring of circular cross section. Its axis is the body's z axis.

    Args:
        major_radius: m, of the circle in the middle of the ring.
        minor_radius: m, of the cross section, above zero and below the major radius.

    Raises:
        TypeError, ValueError: an argument is not a number, not finite or out of range.
    """

    major_radius: float
    minor_radius: float

    def __post_init__(self) -> None:
        """Checks both radii."""
        for name in ("major_radius", "minor_radius"):
            object.__setattr__(self, name, positive(f"Torus.{name}", getattr(self, name)))
        if self.minor_radius >= self.major_radius:
            raise ValueError(
                f"Torus.minor_radius must be below major_radius {self.major_radius:g} m, so that "
                f"the ring has a hole, got {self.minor_radius!r}"
            )

    @property
    def volume(self) -> float:
        """Volume in m^3."""
        return 2.0 * math.pi**2 * self.major_radius * self.minor_radius**2

    @property
    def width(self) -> float:
        """Thickness of the ring in m."""
        return 2.0 * self.minor_radius

    @property
    def reach(self) -> float:
        """Outer radius in m."""
        return self.major_radius + self.minor_radius

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2."""
        return mass_properties.torus_inertia(mass, self.major_radius, self.minor_radius)

    def scaled(self, factor: float) -> "Torus":
        """The shape with each length multiplied by `factor`."""
        return Torus(factor * self.major_radius, factor * self.minor_radius)

    def samples(self, spacing: float, rounding: float) -> Samples:
        """Samples that turn: eight on the core, at any spacing."""
        weights = np.full(RIM_SAMPLES, 1.0 / RIM_SAMPLES)
        return Samples(
            circle(RIM_SAMPLES, self.major_radius), weights, self.minor_radius, axial=True
        )

    def fixed_samples(self, spacing: float, rounding: float) -> tuple[Samples, ...]:
        """Samples that do not turn: the particles."""
        return (self.particles(spacing),)

    def particles(self, spacing: float) -> Samples:
        """Spheres of the minor radius on the core, at most that radius apart."""
        apart = min(spacing, self.minor_radius)
        count = math.ceil(2.0 * math.pi * self.major_radius / apart - 1e-9)
        return Samples(
            circle(count, self.major_radius), np.full(count, 1.0 / count), self.minor_radius
        )

    def surface(self, rounding: float) -> Surface:
        """A circle as the core, with the minor radius."""
        return Surface(TORUS, (self.major_radius, self.major_radius, 0.0), self.minor_radius)
