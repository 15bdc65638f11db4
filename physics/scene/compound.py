"""Compound: one rigid solid made of spheres, boxes and capsules.

As for every shape, the origin of the frame is the centre of mass, and the axes are the principal
axes of inertia. All parts have the same density. Where parts overlap, their mass counts twice, so
place parts such that they touch without overlap.

A compound uses the samples of its parts, without those that other parts cover:

- A sample of a sphere or capsule is removed if its whole sphere lies inside another part.
- A sample of a box that lies on or inside another part is removed if at least 45 % of the
  directions around it point into solid. (On a flat face 50 % do.) Samples at protruding edges and
  corners therefore remain.
- Samples of one radius at the same position become one sample with their mean weight.

The weight of a sample is its weight in the part times the part's fraction of the volume, so a flat
compound rests level. Then all weights are multiplied by one factor: of the six sides normal to the
axes, the one with the largest sum of weights gets the sum 1.

Each part is a surface of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from physics.directions import spread_directions
from physics.scene.mass import MassProperties, combine
from physics.scene.part import Part, Simple
from physics.scene.principal_axes import check_principal_axes
from physics.scene.shapes import Box, Samples, Surface

Array = np.ndarray

# fraction of the compound's width below which the distance of two points is round-off
_SAME = 1e-6
# fraction of that width: distance from a point at which `_useful` tests every direction for solid
_AROUND = 1e-3
# fraction of directions into solid from which on a sample is removed; at a flat face it is 0.5
_FLAT = 0.45


_DIRECTIONS = spread_directions(200)


class SampleSet(NamedTuple):
    """Samples of one radius.

    Attributes:
        samples: the samples.
        face_normals: whether they belong to boxes, see `physics.collision.distances.box_distance`.
    """

    samples: Samples
    face_normals: bool


@dataclass(frozen=True)
class Compound:
    """Spheres, boxes and capsules joined into one solid.

    The parts are translated so that their common centre of mass is the origin. The attribute
    `parts` contains the translated parts.

    Args:
        parts: each a `Part`, (shape, position) or (shape, position, orientation).

    Raises:
        TypeError, ValueError: no parts; an invalid part; axes that are not the principal axes of
            inertia of the compound (the message gives the rotation that aligns them).
    """

    parts: Sequence[Part | tuple[Any, ...]]

    def __post_init__(self) -> None:
        """Checks the parts and moves them to their centre of mass."""
        given: Any = self.parts
        if isinstance(given, str) or not isinstance(given, Sequence):
            raise TypeError(f"Compound.parts must be a sequence of parts, got {given!r}")
        if not given:
            raise ValueError("Compound.parts must hold at least one part, got none")
        parts = [_part(i, item) for i, item in enumerate(given)]
        volumes = np.array([part.shape.volume for part in parts])
        places = np.array([part.position for part in parts])
        center = places[0] if len(parts) == 1 else volumes @ places / volumes.sum()
        if np.abs(center).max() > 1e-14 * max(part.farthest for part in parts):
            parts = [
                Part(part.shape, tuple(place), part.orientation)
                for part, place in zip(parts, places - center, strict=True)
            ]
        object.__setattr__(self, "parts", tuple(parts))
        check_principal_axes("Compound.parts", "parts", self._tensor)

    @cached_property
    def _tensor(self) -> Array:
        """Inertia tensor per kg of mass, [3, 3] in m^2."""
        whole = self.volume
        properties = [
            MassProperties(
                part.shape.volume / whole,
                np.array(part.position),
                np.diag(part.shape.inertia(part.shape.volume / whole)),
            )
            for part in self._parts
        ]
        return combine(properties, [part.rotation for part in self._parts]).inertia

    @property
    def _parts(self) -> tuple[Part, ...]:
        return tuple(part for part in self.parts if isinstance(part, Part))

    @property
    def only(self) -> Simple | None:
        """The shape of the only part, if there is one part and it is not rotated."""
        return self._parts[0].shape if len(self.parts) == 1 and self._parts[0].still else None

    @property
    def volume(self) -> float:
        """Sum of the parts' volumes, in m^3."""
        return sum(part.shape.volume for part in self._parts)

    @property
    def width(self) -> float:
        """Smallest width of a part, in m."""
        return min(part.shape.width for part in self._parts)

    @property
    def reach(self) -> float:
        """Largest distance of a surface point from the centre, in m."""
        return max(part.farthest for part in self._parts)

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2 of a compound of mass [...] in kg."""
        if self.only is not None:
            return self.only.inertia(mass)
        return np.multiply.outer(mass, np.diag(self._tensor))

    def scaled(self, factor: float) -> "Compound":
        """The compound with each length multiplied by `factor`."""
        return Compound(
            tuple(
                Part(
                    part.shape.scaled(factor),
                    tuple(factor * x for x in part.position),
                    part.orientation,
                )
                for part in self._parts
            )
        )

    def samples(self, spacing: float, rounding: float) -> Samples:
        """All `sample_sets` in one; the radius is an array [n] if there are several sets.

        Args:
            spacing: m, largest distance between neighbouring samples of a part.
            rounding: m by which boxes are inset.
        """
        sets = [one.samples for one in self.sample_sets(spacing, rounding)]
        if len(sets) == 1:
            return sets[0]
        radii = [np.full(len(one.weights), one.radius) for one in sets]
        return Samples(
            np.concatenate([one.positions for one in sets]),
            np.concatenate([one.weights for one in sets]),
            np.concatenate(radii),
        )

    def sample_sets(self, spacing: float, rounding: float) -> tuple[SampleSet, ...]:
        """Samples of the parts, without those that other parts cover, grouped by their radius.

        Samples of boxes are in a separate group.

        Args:
            spacing: m, largest distance between neighbouring samples of a part.
            rounding: m by which boxes are inset.
        """
        if self.only is not None:
            return (SampleSet(self.only.samples(spacing, rounding), isinstance(self.only, Box)),)
        same = _SAME * self.width
        groups: dict[tuple[Any, bool], list[Array]] = {}
        for i, part in enumerate(self._parts):
            # `_useful` needs the positions on the real edges, not those on the inset core
            inset, outer = (part.shape.samples(spacing, r) for r in (rounding, 0.0))
            edges = part.outward(outer.positions)
            weights = part.shape.volume / self.volume * inset.weights
            rows = np.column_stack([part.outward(inset.positions), weights, edges])
            kept = rows[self._useful(i, edges, outer.radius)]
            face_normals = isinstance(part.shape, Box)
            groups.setdefault((inset.radius, face_normals), []).append(kept)
        found = []
        for (radius, face_normals), blocks in groups.items():
            rows = np.concatenate(blocks)
            if len(rows):
                rows = _joined(rows, same)
                found.append(SampleSet(Samples(rows[:, :3], rows[:, 3], radius), face_normals))
        heaviest = _heaviest_side([group.samples for group in found], same)
        return tuple(
            SampleSet(samples._replace(weights=samples.weights / heaviest), face_normals)
            for samples, face_normals in found
        )

    def _useful(self, i: int, points: Array, radius: float | Array) -> Array:
        """Mask [n] of the samples of part i that other parts do not cover.

        The docstring of this module gives the rules.

        Args:
            i: index of the part.
            points: [n, 3] m, positions of its samples in the compound's frame.
            radius: m, of its samples; 0 for a box.
        """
        return uncovered(self._parts, i, points, self.width, radius)

    def particles(self, spacing: float) -> Samples:
        """Raises an error: compounds have no particles.

        Raises:
            ValueError: always.
        """
        raise ValueError("Fidelity.geometry 'particle' does not support a Compound: choose 'shape'")

    def surface(self, rounding: float) -> Surface:
        """The surface of the only part.

        Raises:
            ValueError: the compound has several parts, and so several surfaces, or a rotated part.
        """
        if self.only is None:
            raise ValueError("a Compound has a surface for each of its parts, not a common surface")
        return self.only.surface(rounding)


def uncovered(
    parts: Sequence[Part], i: int, points: Array, width: float, radius: float | Array = 0.0
) -> Array:
    """Mask [n] of points [n, 3] m of part i that other parts do not cover, see `Compound._useful`.

    `width` in m is the smallest one of all parts.
    """
    others = [part for j, part in enumerate(parts) if j != i]
    if not others:
        return np.ones(len(points), dtype=bool)
    deepest = np.min([part.distance(points) for part in others], axis=0)
    if np.any(radius):
        return np.asarray(deepest > -radius - _SAME * width)
    free = np.asarray(deepest > _SAME * width)
    around = points[~free, None] + _AROUND * width * _DIRECTIONS
    filled = np.min([part.distance(around) for part in parts], axis=0) < 0.0
    free[~free] = filled.mean(axis=1) < _FLAT
    return free


def _part(i: int, item: Any) -> Part:
    """The user's item `i` as a Part.

    Raises:
        TypeError, ValueError: it is not a valid part; the message names its index.
    """
    if isinstance(item, Part):
        return item
    if not isinstance(item, tuple | list) or not 2 <= len(item) <= 3:
        raise TypeError(
            f"Compound.parts[{i}] must be a Part, (shape, position) or (shape, position, "
            f"orientation), got {item!r}"
        )
    try:
        return Part(*item)
    except (TypeError, ValueError) as error:
        raise type(error)(f"Compound.parts[{i}]: {error}") from None


def _joined(rows: Array, same: float) -> Array:
    """Replaces rows at the same position on the edges by their mean.

    Args:
        rows: [n, 7], position m, weight, position on the edges m.
        same: m, distance below which two positions count as one.

    Returns:
        [k, 7], k <= n.
    """
    edges = rows[:, 4:]
    distance = np.sqrt(np.sum((edges[:, None] - edges) ** 2, axis=2))
    first = np.argmax(distance <= same, axis=1)
    return np.array([rows[first == k].mean(axis=0) for k in np.unique(first)])


def _heaviest_side(sets: list[Samples], same: float) -> float:
    """Largest sum of weights of one of the six sides normal to the axes.

    A side consists of the samples whose height is within `same` m of its lowest sample.
    """
    positions = np.concatenate([one.positions for one in sets])
    weights = np.concatenate([one.weights for one in sets])
    radii = np.concatenate([np.full(len(one.weights), one.radius) for one in sets])
    sums = []
    for normal in (*np.eye(3), *-np.eye(3)):
        height = positions @ normal - radii
        sums.append(weights[height <= height.min() + same].sum())
    return float(max(sums))
