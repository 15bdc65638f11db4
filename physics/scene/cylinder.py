"""Cylinder: a shape that stands on its faces and rolls on its side.

Its core is a cylinder inset by the rounding, so its rims are rounded. It has two sets of samples:

- Over a ground or large static box they turn about the axis such that the first one faces the
  surface, see `physics.collision.facing`. On its side a cylinder therefore rests on its lowest line
  at every angle, and rolls without the corners that fixed samples would give it. Eight samples lie
  on each rim. A face has the weight 1, a point of a rim 1/8 (as a corner of a box), and the side 1
  with the two rim points at its ends.
- Elsewhere they are fixed: sixteen on each rim, and balls of its radius, in a row on the axis of a
  cylinder that is longer than wide. A face has the weight 1, and so has the row with one point of
  each rim. The balls end below the faces by twice the rounding, so that they bear no face.
"""

import math
from dataclasses import dataclass

import numpy as np

from physics.scene import mass as mass_properties
from physics.scene.shapes import CYLINDER, Samples, Surface
from physics.scene.validation import positive

Array = np.ndarray

# samples of a rim, of those that turn and of the fixed ones. Multiples of four: the samples have
# the extents of the circle along x and y
RIM_SAMPLES, FIXED_RIM_SAMPLES = 8, 16


def circle(count: int, radius: float, height: float = 0.0) -> Array:
    """Points [count, 3] m on a circle about the z axis, the first one at angle 0."""
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle + height], axis=-1)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder. Its axis is the body's z axis.

    Args:
        radius: m, above zero.
        half_length: m, half of its length, above zero.

    Raises:
        TypeError, ValueError: an argument is not a number, not finite or not above zero.
    """

    radius: float
    half_length: float

    def __post_init__(self) -> None:
        """Checks radius and length."""
        object.__setattr__(self, "radius", positive("Cylinder.radius", self.radius))
        object.__setattr__(self, "half_length", positive("Cylinder.half_length", self.half_length))

    @property
    def volume(self) -> float:
        """Volume in m^3."""
        return 2.0 * math.pi * self.radius**2 * self.half_length

    @property
    def width(self) -> float:
        """The smaller of diameter and length, in m."""
        return 2.0 * min(self.radius, self.half_length)

    @property
    def reach(self) -> float:
        """Distance of a rim from the centre, in m."""
        return math.hypot(self.radius, self.half_length)

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2."""
        return mass_properties.cylinder_inertia(mass, self.radius, self.half_length)

    def scaled(self, factor: float) -> "Cylinder":
        """The shape with each length multiplied by `factor`."""
        return Cylinder(factor * self.radius, factor * self.half_length)

    def samples(self, spacing: float, rounding: float) -> Samples:
        """Samples that turn: on both rims of the inset core, and on a line of its side."""
        radius, end = self.radius - rounding, self.half_length - rounding
        count = max(2, math.ceil(2.0 * self.half_length / spacing - 1e-9))
        side = np.zeros((count, 3))
        side[:, 0], side[:, 2] = radius, end * ((2.0 * np.arange(count) + 1.0) / count - 1.0)
        rim = 1.0 / RIM_SAMPLES
        positions = [circle(RIM_SAMPLES, radius, -end), circle(RIM_SAMPLES, radius, end), side]
        weights = np.full(2 * RIM_SAMPLES + count, rim)
        weights[2 * RIM_SAMPLES :] = (1.0 - 2.0 * rim) / count
        return Samples(np.concatenate(positions), weights, rounding, axial=True)

    def fixed_samples(self, spacing: float, rounding: float) -> tuple[Samples, ...]:
        """Samples that do not turn: on both rims of the inset core, and balls on the axis."""
        radius, end = self.radius - rounding, self.half_length - rounding
        rims = [circle(FIXED_RIM_SAMPLES, radius, z) for z in (-end, end)]
        rim = 1.0 / FIXED_RIM_SAMPLES
        sets = [Samples(np.concatenate(rims), np.full(2 * FIXED_RIM_SAMPLES, rim), rounding)]
        row = self.half_length - 2.0 * rounding - self.radius  # half its length
        if row > 0.0:
            count = max(1, math.ceil(2.0 * row / spacing - 1e-9)) + 1
            balls = np.zeros((count, 3))
            balls[:, 2] = np.linspace(-row, row, count)
            weights = np.full(count, (1.0 - 2.0 * rim) / count)
            sets.append(Samples(balls, weights, self.radius))
        return tuple(sets)

    def particles(self, spacing: float) -> Samples:
        """Equal spheres in rings over both faces and the side.

        Their diameter is about `spacing` m. The weights of a face sum to 1.
        """
        layers = max(2, round(2.0 * self.half_length / spacing))
        radius = min(self.half_length / layers, 0.5 * self.radius)
        rings = np.arange(self.radius - radius, 0.0, -2.0 * radius)
        counts = [max(1, round(math.pi * ring / radius)) for ring in rings]
        heights = np.linspace(radius - self.half_length, self.half_length - radius, layers)
        positions = [
            circle(count, ring, height)
            for layer, height in enumerate(heights)
            for k, (count, ring) in enumerate(zip(counts, rings, strict=True))
            if k == 0 or layer in (0, layers - 1)
        ]
        points = np.concatenate(positions)
        return Samples(points, np.full(len(points), 1.0 / sum(counts)), radius)

    def surface(self, rounding: float) -> Surface:
        """A cylinder as the core, inset by `rounding` m."""
        radius = self.radius - rounding
        return Surface(CYLINDER, (radius, radius, self.half_length - rounding), rounding)
