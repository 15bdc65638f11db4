"""What a picture shows: solids, what marks a goal, and forces."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from physics.scene.validation import positive, unit_quaternion, vector

Array = np.ndarray
Color = tuple[int, int, int]

# of a scene's bodies in turn: for people, and paler ones in pixels that policies observe, since
# trained policies know these
BODY_COLORS = ((236, 106, 30), (36, 104, 216), (214, 50, 72), (124, 164, 36), (136, 78, 200))
OBSERVED_COLORS = ((222, 132, 68), (86, 128, 196), (206, 92, 104), (118, 160, 84), (150, 112, 178))
GOAL_COLOR = (24, 168, 84)


@dataclass(frozen=True, eq=False)
class Particles:
    """Balls that stand for a solid: `positions` [n, 3] m in its frame, `radius` m, or [n]."""

    positions: Array
    radius: float | Array


@dataclass(frozen=True, eq=False)
class Item:
    """A solid to draw, in one world or in many.

    Attributes:
        shape: of `physics`.
        position: (3,) m, or [worlds, 3].
        orientation: (4,) quaternion x, y, z, w, or [worlds, 4].
        color: red, green, blue in 0..255.
        particles: drawn in a faint shape if given.
        solid: its index in the scene, -1 if it is none of its solids.
        size: by which it is larger than its shape, or [worlds].
        opacity: 0 to 1; a solid that is not opaque casts no shadow.

    Raises:
        ValueError: a position that is not three finite numbers, or a quaternion of zero length.
    """

    shape: Any
    position: Array
    orientation: Array
    color: Color
    particles: Particles | None = None
    solid: int = -1
    size: float | Array = 1.0
    opacity: float = 1.0

    def __post_init__(self) -> None:
        """Checks the pose and makes quaternions of unit length; tables of many are taken as is."""
        if np.ndim(self.position) > 1:
            return
        turn = unit_quaternion("Item.orientation", self.orientation)
        object.__setattr__(self, "position", np.array(vector("Item.position", self.position)))
        object.__setattr__(self, "orientation", np.array(turn))


@dataclass(frozen=True, eq=False)
class Goal:
    """A target: a translucent disc on the ground, and a ball at `position` (3,) m.

    The ball is smaller than `radius` m where it would sink into the ground, and absent below it.
    """

    position: Array
    radius: float
    color: Color = GOAL_COLOR

    def __post_init__(self) -> None:
        """Checks position and radius."""
        object.__setattr__(self, "position", np.array(vector("Goal.position", self.position)))
        positive("Goal.radius", self.radius)


@dataclass(frozen=True, eq=False)
class Ghost:
    """A place for a solid: a translucent box of its size, whose edges show through all solids.

    Attributes:
        half_extents: (3,) m.
        position: (3,) m, of its centre.
        color: red, green, blue in 0..255.
        orientation: (4,) quaternion x, y, z, w.
    """

    half_extents: Array
    position: Array
    color: Color = GOAL_COLOR
    orientation: Array = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))

    def __post_init__(self) -> None:
        """Checks extents and pose."""
        turn = unit_quaternion("Ghost.orientation", self.orientation)
        object.__setattr__(self, "orientation", np.array(turn))
        extents = vector("Ghost.half_extents", self.half_extents)
        object.__setattr__(self, "half_extents", np.array(extents))
        object.__setattr__(self, "position", np.array(vector("Ghost.position", self.position)))


@dataclass(frozen=True, eq=False)
class Mark:
    """A cross on the ground, under `position` (3,) m; `radius` m is the length of its arms."""

    position: Array
    radius: float
    color: Color = (70, 76, 90)

    def __post_init__(self) -> None:
        """Checks position and radius."""
        object.__setattr__(self, "position", np.array(vector("Mark.position", self.position)))
        positive("Mark.radius", self.radius)


Marker = Goal | Ghost | Mark
"""What is drawn without being solid."""


@dataclass(frozen=True, eq=False)
class Arrow:
    """An arrow from `origin` (3,) m along `vector` (3,) m, such as a contact force to scale."""

    origin: Array
    vector: Array
    color: Color = (140, 40, 170)

    def __post_init__(self) -> None:
        """Checks both points."""
        object.__setattr__(self, "origin", np.array(vector("Arrow.origin", self.origin)))
        object.__setattr__(self, "vector", np.array(vector("Arrow.vector", self.vector)))
