"""Part: a sphere, box or capsule as it lies in a compound."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from physics.rotation import rotation_matrix
from physics.scene.shapes import Box, Capsule, Sphere
from physics.scene.validation import instance, unit_quaternion, vector

Array = np.ndarray
Simple = Sphere | Box | Capsule
Vector = tuple[float, ...]


@dataclass(frozen=True)
class Part:
    """A part of a Compound.

    Args:
        shape: Sphere, Box or Capsule.
        position: of its centre in the compound's frame, m.
        orientation: quaternion x, y, z, w, from its own frame to the compound's; it is normalised.
    """

    shape: Simple
    position: Vector = (0.0, 0.0, 0.0)
    orientation: Vector = (0.0, 0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        """Checks every field."""
        instance("Part.shape", self.shape, Sphere, Box, Capsule)
        object.__setattr__(self, "position", vector("Part.position", self.position))
        turn = unit_quaternion("Part.orientation", self.orientation)
        object.__setattr__(self, "orientation", turn)

    @property
    def still(self) -> bool:
        """Whether its frame is that of the compound."""
        return not any(self.position) and not any(self.orientation[:3])

    @cached_property
    def rotation(self) -> Array:
        """[3, 3], from its own frame to the compound's."""
        return rotation_matrix(np.array(self.orientation))

    @property
    def ends(self) -> tuple[Array, float]:
        """Corners [n, 3] m of its core in the compound's frame, and the radius m around them."""
        half, radius = core(self.shape)
        signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return self.outward(signs * half), radius

    @property
    def farthest(self) -> float:
        """Largest distance in m of a point of its surface from the compound's centre."""
        if self.still:
            return self.shape.reach
        points, radius = self.ends
        return float(np.sqrt(np.sum(points**2, axis=1)).max()) + radius

    def outward(self, points: Array) -> Array:
        """Points [..., 3] of its own frame in the compound's."""
        return np.array(self.position) + np.einsum("ij,...j->...i", self.rotation, points)

    def inward(self, points: Array) -> Array:
        """Points [..., 3] of the compound's frame in its own."""
        return np.einsum("ji,...j->...i", self.rotation, points - np.array(self.position))

    def distance(self, points: Array) -> Array:
        """Distance [...] m of points [..., 3] from its surface, negative inside."""
        half, radius = core(self.shape)
        beyond = np.abs(self.inward(points)) - half
        outside = np.sqrt(np.sum(np.maximum(beyond, 0.0) ** 2, axis=-1))
        return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0.0) - radius)


def core(shape: Simple) -> tuple[Array, float]:
    """Half extents [3] m of a shape's core as a box, and the radius m around it."""
    if isinstance(shape, Box):
        return np.array(shape.half_extents), 0.0
    return np.array([0.0, 0.0, getattr(shape, "half_length", 0.0)]), shape.radius
