"""Particles: one rigid solid made of equal balls, as the first lecture builds chess pieces.

As for every shape, the origin of the frame is the centre of mass, and the axes are the principal
axes of inertia. Each particle is a solid ball: it adds the inertia of its own ball, so that a
single particle and particles on a line rotate too. Where balls overlap, their mass counts twice.

The balls are the samples, and a surface of the solid is the balls' surface: two such solids touch
ball against ball, and any other solid touches the balls with its exact surface, at both values of
`Fidelity.geometry`. A gap between balls is a gap.

All balls have the same weight, one over the largest number of balls on which the solid can lie. So
its flattest side has the weight 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from physics.directions import spread_directions
from physics.scene import mass as mass_properties
from physics.scene.principal_axes import check_principal_axes
from physics.scene.shapes import PARTICLES, Samples, Sphere, Surface
from physics.scene.validation import positive

Array = np.ndarray

# fraction of the radius below which two heights or positions count as one
_SAME = 1e-6
# directions, spread evenly, in which the solid is set down to find the sides that it can lie on
_SET_DOWN = 100


@dataclass(frozen=True)
class Particles:
    """A solid made of equal balls.

    The positions are translated so that the centre of mass is the origin. The attribute `positions`
    contains the translated positions.

    Args:
        positions: [n, 3] m, of the balls' centres.
        radius: m, of every ball, above zero.

    Raises:
        TypeError, ValueError: no positions, or not finite numbers of three columns; two balls at
            the same place; a radius that is not above zero; axes that are not the principal axes of
            inertia (the message gives the rotation that aligns them).
    """

    positions: Sequence[Sequence[float]]
    radius: float

    def __post_init__(self) -> None:
        """Checks the balls and moves them to their centre of mass."""
        object.__setattr__(self, "radius", positive("Particles.radius", self.radius))
        points = _checked(self.positions)
        center = points.mean(axis=0)
        if np.abs(center).max() > 1e-14 * (np.abs(points).max() + self.radius):
            points = points - center
        object.__setattr__(self, "positions", tuple(map(tuple, points.tolist())))
        same = max(_SAME * self.radius, np.finfo(float).tiny)
        order = np.lexsort(np.round(points / same).T)
        steps = np.abs(np.diff(points[order], axis=0)).max(axis=1, initial=0.0)
        if np.any(steps < same):
            i, j = sorted(order[np.argmin(steps) :][:2].tolist())
            raise ValueError(
                f"Particles.positions must differ, got {self.positions[i]} twice, at {i} and {j}"
            )
        check_principal_axes("Particles.positions", "positions", self._tensor)

    @cached_property
    def points(self) -> Array:
        """Positions [n, 3] m."""
        return np.array(self.positions)

    @cached_property
    def _tensor(self) -> Array:
        """Inertia tensor per kg of mass, [3, 3] in m^2."""
        n = len(self.points)
        return mass_properties.of_particles(self.points, np.full(n, 1.0 / n), self.radius).inertia

    @property
    def volume(self) -> float:
        """Sum of the balls' volumes, in m^3."""
        return len(self.positions) * Sphere(self.radius).volume

    @property
    def width(self) -> float:
        """Smallest width along x, y and z, in m."""
        return float(np.ptp(self.points, axis=0).min()) + 2.0 * self.radius

    @property
    def reach(self) -> float:
        """Largest distance of a surface point from the centre, in m."""
        return float(np.sqrt(np.sum(self.points**2, axis=1)).max()) + self.radius

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2."""
        return np.multiply.outer(mass, np.diag(self._tensor))

    def scaled(self, factor: float) -> "Particles":
        """The shape with each length multiplied by `factor`."""
        return Particles(tuple(map(tuple, (factor * self.points).tolist())), factor * self.radius)

    def samples(self, spacing: float, rounding: float) -> Samples:
        """The balls themselves, at any spacing."""
        weights = np.full(len(self.points), 1.0 / self._most_on_a_side)
        return Samples(self.points, weights, self.radius)

    def particles(self, spacing: float) -> Samples:
        """The balls themselves."""
        return self.samples(spacing, 0.0)

    def surface(self, rounding: float) -> Surface:
        """The balls' surface."""
        return Surface(PARTICLES, (0.0, 0.0, 0.0), self.radius)

    @cached_property
    def sides(self) -> Array:
        """Outward normals [k, 3] of sides on which the solid can lie.

        They are those to which it tips when it is set down with its axes or one of 100 directions
        pointing down.
        """
        starts = np.concatenate([np.eye(3), -np.eye(3), spread_directions(_SET_DOWN)])
        found = np.array([_tipped(self.points, start, _SAME * self.radius) for start in starts])
        return np.unique(np.round(found, 9), axis=0)

    @cached_property
    def _most_on_a_side(self) -> int:
        heights = self.points @ self.sides.T
        return int(np.sum(heights > heights.max(axis=0) - _SAME * self.radius, axis=0).max())


def _checked(given: Any) -> Array:
    """Positions as an array [n, 3].

    Raises:
        TypeError, ValueError: see `Particles`.
    """
    try:
        points = np.array(given, dtype=float)
    except OverflowError:  # an integer beyond all floats
        raise ValueError(f"Particles.positions must be finite, got {given!r}") from None
    except (TypeError, ValueError):
        raise TypeError(f"Particles.positions must be numbers [n, 3], got {given!r}") from None
    if points.ndim != 2 or points.shape[1:] != (3,) or not len(points):
        raise ValueError(
            f"Particles.positions must be at least one (x, y, z), shape (n, 3), got shape "
            f"{points.shape}"
        )
    if not np.all(np.isfinite(points)):
        bad = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise ValueError(f"Particles.positions must be finite, got {given[bad]!r} at {bad}")
    return points


def _tipped(points: Array, down: Array, same: float) -> Array:
    """Direction [3] that points down once the solid has tipped over a point, then over a line.

    Args:
        points: [n, 3] m, their centre is the origin.
        down: [3], a unit vector.
        same: m, below which a distance is round-off.
    """
    for _ in range(2):
        heights = points @ down
        pivot = points[np.argmax(heights)]
        below = heights > heights.max() - same
        arms = points - pivot
        line = arms[below][np.argmax(np.sum(arms[below] ** 2, axis=1))]
        aside = (pivot @ down) * down - pivot  # to where the centre of mass is
        if line @ line > same**2:  # it lies on a line or a side: across the line
            across = np.cross(down, line / np.sqrt(line @ line))
            if np.abs(arms[below] @ across).max() > same:
                break
            aside = (aside @ across) * across
        if aside @ aside < same**2:
            break  # balanced on a point or a line
        aside = aside / np.sqrt(aside @ aside)
        along = arms @ aside
        falling = along > same
        if not falling.any():
            break
        angle = np.arctan2(-arms[falling] @ down, along[falling]).min()
        down = np.cos(angle) * down + np.sin(angle) * aside
    return np.asarray(down)
