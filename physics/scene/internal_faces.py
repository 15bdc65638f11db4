"""Hidden faces: the areas of box faces that other boxes of a compound, or flush statics, cover.

Where one box of a compound touches the face of another, no solid can enter through the covered
area. A sample that slides from one box to the other must not be pushed out through this area. Each
box therefore stores the rectangles of its faces that other boxes hide.

If the other box reaches or exceeds an edge of the face, the rectangle extends to infinity beyond
this edge.

The face plane is shifted by 0.1 % of the boxes' smaller width, out of the earlier box and into the
later one in the order of the parts. In a stack of identical compounds, samples lie exactly on the
plane where the two boxes meet. Without the shift, round-off could assign such a sample to both
boxes.
"""

import math
from collections.abc import Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from physics.scene.part import Part
from physics.scene.shapes import Box

# round-off of the rotation between two boxes with parallel axes
_ASKEW = 1e-6
# round-off of the separation of boxes that touch, as a fraction of the box's width
_SAME = 1e-6
# shift of the face plane, as a fraction of the smaller width of the two boxes
_ASIDE = 1e-3


class HiddenFace(NamedTuple):
    """A rectangle of a box's face that another box hides, in the frame of the box.

    Attributes:
        axis: 0 to 2, the axis normal to the face.
        sign: 1.0 or -1.0, direction of the outward normal along the axis.
        face: m, distance of the shifted face plane from the box's centre.
        low: m, lower bounds along the two other axes in cyclic order (for axis 1: z, x); -inf if
            the other box reaches the edge of the face.
        high: m, upper bounds, likewise; inf if the other box reaches the edge.
    """

    axis: int
    sign: float
    face: float
    low: tuple[float, float]
    high: tuple[float, float]


def hidden_faces(parts: Sequence[Part]) -> list[list[HiddenFace]]:
    """Hidden faces of each part, one list per part.

    Only boxes hide faces, and only those of boxes whose axes are parallel to their own.
    """
    found: list[list[HiddenFace]] = [[] for _ in parts]
    for i, j in permutations(range(len(parts)), 2):
        found[i] += faces_behind(parts[i], parts[j], plane_shift(parts[i], parts[j], j - i))
    return found


def plane_shift(part: Part, other: Part, order: int) -> float:
    """How far face planes of a part are shifted out, in m; `order` > 0: it is the earlier part."""
    return math.copysign(_ASIDE * min(part.shape.width, other.shape.width), order)


def faces_behind(part: Part, other: Part, shift: float, level: bool = False) -> list[HiddenFace]:
    """Faces of `part` that `other` hides; their planes are shifted outward by `shift` m.

    With `level`, only where the two have another face in one plane.
    """
    if not isinstance(part.shape, Box) or not isinstance(other.shape, Box):
        return []
    rotation = np.abs(part.rotation.T @ other.rotation)
    if np.abs(rotation - np.round(rotation)).max() > _ASKEW:
        return []
    # `extents` and `center` are those of the other box, in the frame of this box
    half, extents = np.array(part.shape.half_extents), rotation @ np.array(other.shape.half_extents)
    center, same = part.inward(np.array(other.position)), _SAME * part.shape.width
    above, below = center + extents - half, center - extents + half
    is_level = np.minimum(np.abs(above), np.abs(below)) <= same
    found = []
    for axis in range(3):
        across = [(axis + 1) % 3, (axis + 2) % 3]
        low, high = center[across] - extents[across], center[across] + extents[across]
        if np.any(high < same - half[across]) or np.any(low > half[across] - same):
            continue
        if level and not np.any(is_level[across]):
            continue
        low = np.where(low < same - half[across], -math.inf, low)
        high = np.where(high > half[across] - same, math.inf, high)
        for sign in (-1.0, 1.0):
            near, far = sign * center[axis] - extents[axis], sign * center[axis] + extents[axis]
            if near < half[axis] + same and far > half[axis] + same:
                ends = (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))
                found.append(HiddenFace(axis, sign, float(half[axis]) + shift, *ends))
    return found
