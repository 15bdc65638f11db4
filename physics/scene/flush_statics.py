"""Static boxes that lie flush beside each other act as one surface.

A cube that slides over the seam of two tiles is pressed into them by its weight. So its samples
come to the next tile below that tile's upper edge, where the tile's side would stop them, and the
tile's edge would stop the cube's side. Nothing can reach these sides. So boxes with a level face in
common hide from each other what they cover, and leave out the samples that lie there, as the boxes
of a compound do, see `internal_faces`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from physics.rotation import multiply, rotate_back
from physics.scene.compound import uncovered
from physics.scene.internal_faces import HiddenFace, faces_behind, plane_shift
from physics.scene.part import Part
from physics.scene.shapes import Box, Samples
from physics.scene.solids import Ground, Static

Array = np.ndarray

# decimals to which relative poses are rounded, so that equal neighbourhoods compare as equal
_DECIMALS = 12


@dataclass(frozen=True)
class FlushBox(Box):
    """A static box that has flush neighbours.

    Args:
        half_extents: (x, y, z) in m.
        hidden: what its neighbours hide of its faces.
        neighbours: boxes around it, in its frame.
    """

    hidden: tuple[HiddenFace, ...] = ()
    neighbours: tuple[Part, ...] = ()

    def samples(self, spacing: float, rounding: float) -> Samples:
        """The samples of the box that its neighbours leave free."""
        inset, outer = (super(FlushBox, self).samples(spacing, r) for r in (rounding, 0.0))
        parts = (Part(Box(self.half_extents)), *self.neighbours)
        free = uncovered(parts, 0, outer.positions, self.width)
        return inset._replace(positions=inset.positions[free], weights=inset.weights[free])


def join_flush(statics: Sequence[Ground | Static]) -> tuple[Ground | Static, ...]:
    """The statics, with the shape `FlushBox` where a box has flush neighbours.

    Neighbours have parallel axes, a level face in common, and the same group and mask.
    """
    boxes = [
        (n, static, static.shape)
        for n, static in enumerate(statics)
        if isinstance(static, Static) and type(static.shape) is Box
    ]
    places = np.array([static.position for _, static, _ in boxes]).reshape(-1, 3)
    reach = np.array([shape.reach for _, _, shape in boxes])
    found = list(statics)
    for (n, static, shape), place, far in zip(boxes, places, reach, strict=True):
        near = np.flatnonzero(np.sum((places - place) ** 2, axis=1) < (reach + far) ** 2)
        own = Part(shape)
        hidden: list[HiddenFace] = []
        neighbours: list[Part] = []
        for m, other, hides in (boxes[k] for k in near):
            if m == n or (static.group, static.mask) != (other.group, other.mask):
                continue
            neighbour = _seen_from(static, other, hides)
            hidden += faces_behind(own, neighbour, plane_shift(own, neighbour, m - n), level=True)
            neighbours.append(neighbour)
        if hidden:
            flush = FlushBox(shape.half_extents, tuple(hidden), tuple(neighbours))
            found[n] = replace(static, shape=flush)
    return tuple(found)


def _seen_from(static: Static, other: Static, shape: Box) -> Part:
    """Another static, a box, in the frame of one."""
    turn, place = np.array(static.orientation), np.subtract(other.position, static.position)
    inverse = turn * (-1.0, -1.0, -1.0, 1.0)
    position = np.round(rotate_back(turn, place), _DECIMALS)
    orientation = np.round(multiply(inverse, np.array(other.orientation)), _DECIMALS)
    return Part(shape, tuple(position), tuple(orientation))
