"""Compound: one solid made of spheres, boxes and capsules that are joined for good.

Its frame is centred at its centre of mass and lies along its principal axes, as every shape's. Each
part has the same density. Where parts overlap, their mass counts twice: let them touch.

As the owner of samples it has those of its parts, but what the others cover. A sample of a box that
lies on or in another part stays where the solid around it fills less than half of all directions,
as at edges and corners that stick out; of samples that coincide one stays. A ball goes only where
another part swallows it. Samples weigh what they do in their part times its volume, so that a flat
compound lies level, and all by one factor such that of the six sides along its axes that it may lie
on the heaviest weighs 1.

As a surface each part is one by itself.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations, product
from typing import Any, NamedTuple

import numpy as np

from physics.scene.mass import MassProperties, combine
from physics.scene.part import Part, Simple
from physics.scene.shapes import Box, Samples, Surface

Array = np.ndarray

# of the compound's width: how near points count as one, and how far around a point is looked
_SAME, _AROUND = 1e-6, 1e-3
# share of all directions that solid fills around a sample that is no use: a flat face fills half
_FLAT = 0.45
# product of inertia, as a share of the tensor's trace, up to which axes count as principal
_ASKEW = 1e-9


def _directions(count: int) -> Array:
    """Unit vectors [count, 3] spread evenly over all directions (Fibonacci's spiral)."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    return np.stack([np.cos(turn), np.sin(turn), np.zeros(count)], axis=1) * np.sqrt(
        1.0 - z * z
    ).reshape(-1, 1) + z.reshape(-1, 1) * np.array([0.0, 0.0, 1.0])


_DIRECTIONS = _directions(200)


class SampleSet(NamedTuple):
    """Samples of one radius, and whether they are those of a box, see `box_distance`."""

    samples: Samples
    face_normals: bool


@dataclass(frozen=True)
class Compound:
    """Spheres, boxes and capsules joined into one solid.

    The parts are moved so that their common centre of mass is the origin: `parts` tells where they
    lie then.

    Args:
        parts: a `Part` each, or (shape, position) or (shape, position, orientation).

    Raises:
        TypeError, ValueError: no parts, or not such; axes that are not the principal ones of the
            whole, with the turn that makes them so.
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
        tensor = self._tensor
        askew = tensor - np.diag(np.diag(tensor))
        if np.abs(askew).max() > _ASKEW * np.trace(tensor):
            i, j = np.unravel_index(np.abs(askew).argmax(), (3, 3))
            raise ValueError(
                f"Compound.parts must have their principal axes along x, y and z, got a product of "
                f"inertia J_{'xyz'[i]}{'xyz'[j]} of {askew[i, j]:.3g} m^2 a kg: turn all parts by "
                f"the quaternion {_to_axes(tensor)}"
            )

    @cached_property
    def _tensor(self) -> Array:
        """[3, 3] m^2, inertia for each kg."""
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
        """The shape that this is but for its name, if it has one part."""
        return self._parts[0].shape if len(self.parts) == 1 and self._parts[0].still else None

    @property
    def volume(self) -> float:
        """Sum of the parts', in m^3."""
        return sum(part.shape.volume for part in self._parts)

    @property
    def width(self) -> float:
        """Smallest width in m of any part."""
        return min(part.shape.width for part in self._parts)

    @property
    def reach(self) -> float:
        """Largest distance of a surface point from the centre, in m."""
        return max(part.farthest for part in self._parts)

    def inertia(self, mass: float | Array) -> Array:
        """Principal moments [..., 3] in kg m^2 of the solid with this mass [...] in kg."""
        if self.only is not None:
            return self.only.inertia(mass)
        return np.multiply.outer(mass, np.diag(self._tensor))

    def scaled(self, factor: float) -> "Compound":
        """The same shape, each length times a factor."""
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
        """All `sample_sets` as one; their radii [n] where they differ."""
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
        """Core samples of the parts, but those that others cover, by their radius.

        Args:
            spacing: m that samples are apart at most.
            rounding: m by which boxes are inset.
        """
        if self.only is not None:
            return (SampleSet(self.only.samples(spacing, rounding), isinstance(self.only, Box)),)
        same = _SAME * self.width
        groups: dict[tuple[Any, bool], list[Array]] = {}
        for i, part in enumerate(self._parts):
            # which are of use is seen where the edges are, not where rounding insets them to
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
        """Which samples [n] of part i, at points [n, 3] m, are no part of another."""
        others = [part for j, part in enumerate(self._parts) if j != i]
        if not others:
            return np.ones(len(points), dtype=bool)
        deepest = np.min([part.distance(points) for part in others], axis=0)
        if np.any(radius):
            return np.asarray(deepest > -radius - _SAME * self.width)
        around = points[:, None] + _AROUND * self.width * _DIRECTIONS
        filled = np.min([part.distance(around) for part in self._parts], axis=0) < 0.0
        return (deepest > _SAME * self.width) | (filled.mean(axis=1) < _FLAT)

    def particles(self, spacing: float) -> Samples:
        """Not known of compounds.

        Raises:
            ValueError: always.
        """
        raise ValueError(
            "Fidelity.geometry 'particle' has no particles for a Compound: choose 'shape'"
        )

    def surface(self, rounding: float) -> Surface:
        """That of its only part; each of several has its own.

        Raises:
            ValueError: it has more than one part.
        """
        if self.only is None:
            raise ValueError("a Compound has a surface for each of its parts, and none of its own")
        return self.only.surface(rounding)


def _part(i: int, item: Any) -> Part:
    """Part i as given."""
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


def _to_axes(tensor: Array) -> tuple[float, ...]:
    """Quaternion of the smallest turn that brings principal axes to x, y and z."""
    axes = np.linalg.eigh(tensor)[1].T
    turns = [
        axes[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    R = max((turn for turn in turns if np.linalg.det(turn) > 0.0), key=np.trace)
    w = 0.5 * math.sqrt(max(1.0 + np.trace(R), 0.0))
    x, y, z = (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    return tuple(round(float(c), 15) for c in (x / (4 * w), y / (4 * w), z / (4 * w), w))


def _joined(rows: Array, same: float) -> Array:
    """Rows of position, weight and edge, of which those with one edge have become their mean."""
    edges = rows[:, 4:]
    apart = np.sqrt(np.sum((edges[:, None] - edges) ** 2, axis=2))
    first = np.argmax(apart <= same, axis=1)
    return np.array([rows[first == k].mean(axis=0) for k in np.unique(first)])


def _heaviest_side(sets: list[Samples], same: float) -> float:
    """Largest sum of weights that lie lowest, of the six sides along the axes."""
    positions = np.concatenate([one.positions for one in sets])
    weights = np.concatenate([one.weights for one in sets])
    radii = np.concatenate([np.full(len(one.weights), one.radius) for one in sets])
    sums = []
    for normal in (*np.eye(3), *-np.eye(3)):
        height = positions @ normal - radii
        sums.append(weights[height <= height.min() + same].sum())
    return float(max(sums))
