"""Part: a sphere, box or capsule with a pose in a compound."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from physics.rotation import rotation_matrix
from physics.scene.shapes import Box, Capsule, Sphere
from physics.scene.validation import unit_quaternion, vector

Array = np.ndarray
Simple = Sphere | Box | Capsule
Vector = tuple[float, ...]


@dataclass(frozen=True)
class Part:
    """A part of a Compound.

    Args:
        shape: Sphere, Box or Capsule.
        position: m, of the part's centre in the compound's frame.
        orientation: quaternion x, y, z, w, from the part's frame to the compound's; it is
            normalised, w >= 0.

    Raises:
        TypeError, ValueError: a field is of the wrong type; a position that is not three finite
            numbers; a quaternion that is not four finite numbers or has length zero.
    """

    shape: Simple
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Vector = (0.0, 0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        """Checks every field."""
        if not isinstance(self.shape, Sphere | Box | Capsule):
            raise TypeError(
                f"Part.shape must be Sphere or Box or Capsule, got {self.shape!r} "
                f"({type(self.shape).__name__}); other bodies of several parts: a Mesh"
            )
        object.__setattr__(self, "position", vector("Part.position", self.position))
        orientation = unit_quaternion("Part.orientation", self.orientation)
        object.__setattr__(self, "orientation", orientation)

    @property
    def still(self) -> bool:
        """Whether the part's frame coincides with the compound's."""
        return not any(self.position) and not any(self.orientation[:3])

    @cached_property
    def rotation(self) -> Array:
        """Rotation matrix [3, 3] from the part's frame to the compound's."""
        return rotation_matrix(np.array(self.orientation))

    @property
    def ends(self) -> tuple[Array, float]:
        """Corners [8, 3] m of the core in the compound's frame, and the radius m around them."""
        half, radius = core(self.shape)
        signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return self.outward(signs * half), radius

    @property
    def farthest(self) -> float:
        """Largest distance in m of a point of the part's surface from the compound's centre."""
        if self.still:
            return self.shape.reach
        points, radius = self.ends
        return float(np.sqrt(np.sum(points**2, axis=1)).max()) + radius

    def outward(self, points: Array) -> Array:
        """Transforms points [..., 3] m from the part's frame to the compound's."""
        return np.array(self.position) + np.einsum("ij,...j->...i", self.rotation, points)

    def inward(self, points: Array) -> Array:
        """Transforms points [..., 3] m from the compound's frame to the part's."""
        return np.einsum("ji,...j->...i", self.rotation, points - np.array(self.position))

    def distance(self, points: Array) -> Array:
        """Distance [...] m of points [..., 3] m from the part's surface, negative inside.

        The points are given in the compound's frame.
        """
        half, radius = core(self.shape)
        beyond = np.abs(self.inward(points)) - half
        outside = np.sqrt(np.sum(np.maximum(beyond, 0.0) ** 2, axis=-1))
        return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0.0) - radius)


def core(shape: Simple) -> tuple[Array, float]:
    """Half extents [3] m of a box that is the shape's core, and the radius m around it.

    A box is its own core, with radius 0. The core of a sphere is a point, that of a capsule a line
    segment along z.
    """
    if isinstance(shape, Box):
        return np.array(shape.half_extents), 0.0
    return np.array([0.0, 0.0, getattr(shape, "half_length", 0.0)]), shape.radius
