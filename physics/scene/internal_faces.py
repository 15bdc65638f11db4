"""Seams: where the boxes of a compound hide each other's faces.

Where one box stands on the face of another nothing can come through that face, and a sample that
passes from one to the other must not be pushed out by it. So each box knows the rectangles of its
faces that others hide. Where such a box reaches to the border of the face or beyond, what is beside
the border counts as over it too. Where equal compounds are stacked, samples lie on the very seam:
it counts as a little within the latter of the two boxes, for round-off not to leave a sample to
both.
"""

import math
from collections.abc import Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from physics.scene.part import Part
from physics.scene.shapes import Box

# how nearly boxes must lie along each other's axes, and share of a width that touching ones may be
# apart or overlap
_ASKEW, _SAME = 1e-6, 1e-6
# share of a box's width by which a seam counts as within the latter of two boxes
_ASIDE = 1e-3


class HiddenFace(NamedTuple):
    """A rectangle of a box's face that another box hides.

    Attributes:
        axis: 0 to 2, that the face lies across.
        sign: 1.0 or -1.0, the face's side.
        face: m, from the box's centre to where it ends.
        low: m, lower ends along the next axis and the one after it; -inf beside the border.
        high: m, upper ends, likewise.
    """

    axis: int
    sign: float
    face: float
    low: tuple[float, float]
    high: tuple[float, float]


def hidden_faces(parts: Sequence[Part]) -> list[list[HiddenFace]]:
    """What the others hide of each part's faces; only boxes along each other's axes do."""
    found: list[list[HiddenFace]] = [[] for _ in parts]
    for i, j in permutations(range(len(parts)), 2):
        width = min(parts[i].shape.width, parts[j].shape.width)
        found[i] += _between(parts[i], parts[j], math.copysign(_ASIDE * width, j - i))
    return found


def _between(part: Part, other: Part, aside: float) -> list[HiddenFace]:
    """What another part hides of a part's faces, which count as `aside` m farther out."""
    if not isinstance(part.shape, Box) or not isinstance(other.shape, Box):
        return []
    turn = np.abs(part.rotation.T @ other.rotation)
    if np.abs(turn - np.round(turn)).max() > _ASKEW:
        return []
    half, theirs = np.array(part.shape.half_extents), turn @ np.array(other.shape.half_extents)
    middle, same = part.inward(np.array(other.position)), _SAME * part.shape.width
    found = []
    for axis in range(3):
        across = [(axis + 1) % 3, (axis + 2) % 3]
        low, high = middle[across] - theirs[across], middle[across] + theirs[across]
        if np.any(high < same - half[across]) or np.any(low > half[across] - same):
            continue
        low = np.where(low < same - half[across], -math.inf, low)
        high = np.where(high > half[across] - same, math.inf, high)
        for sign in (-1.0, 1.0):
            manifold, far = sign * middle[axis] - theirs[axis], sign * middle[axis] + theirs[axis]
            if manifold < half[axis] + same and far > half[axis] + same:
                ends = (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
                found.append(HiddenFace(axis, sign, float(half[axis]) + aside, *ends))
    return found
