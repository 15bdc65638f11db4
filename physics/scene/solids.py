"""Solids of a scene that nothing drives: free bodies, statics and the ground."""

from dataclasses import dataclass, field
from typing import Any

from physics.scene.material import Material
from physics.scene.parameter_ranges import RANGES
from physics.scene.shapes import Shape
from physics.scene.validation import (
    IDENTITY,
    ZERO,
    Vector,
    instance,
    integer,
    number,
    positive,
    text,
    unit_quaternion,
    vector,
)

EVERY_GROUP = 2**32 - 1  # a mask with all bits


@dataclass(frozen=True)
class Body:
    """A free rigid body.

    Args:
        shape: its shape; the body frame's axes are the shape's, its origin the centre of mass.
        mass: kg, above zero; or give the density.
        density: kg/m^3, above zero; 1000 if neither is given.
        position: of the centre of mass, m.
        orientation: quaternion x, y, z, w, body frame to world frame; it is normalised, w >= 0.
        linear_velocity: m/s, world frame.
        angular_velocity: rad/s, world frame.
        material: its surface.
        name: for `World.index`, error messages and contact reports; unique in a scene. None: "body"
            and its index.
        group: bits of the groups that it belongs to, see `touch_each_other`.
        mask: bits of the groups that it touches.

    Raises:
        TypeError, ValueError: a field is of the wrong type or out of range.
    """

    shape: Shape
    mass: float | None = None
    density: float | None = None
    position: Vector = ZERO
    orientation: Vector = IDENTITY
    linear_velocity: Vector = ZERO
    angular_velocity: Vector = ZERO
    material: Material = field(default_factory=Material)
    name: str | None = None
    group: int = 1
    mask: int = EVERY_GROUP

    def __post_init__(self) -> None:
        """Checks every field and computes the mass."""
        if self.mass is not None and self.density is not None:
            raise ValueError(
                f"Body takes mass or density, not both: got mass={self.mass!r}, "
                f"density={self.density!r}"
            )
        check_solid(self)
        if self.mass is None:
            density = positive("Body.density", 1000.0 if self.density is None else self.density)
            object.__setattr__(self, "mass", density * self.shape.volume)
        object.__setattr__(self, "mass", RANGES["mass"].number("Body.mass", self.mass))
        for name in ("linear_velocity", "angular_velocity"):
            object.__setattr__(self, name, vector(f"Body.{name}", getattr(self, name)))


@dataclass(frozen=True)
class Static:
    """A solid that never moves.

    Args:
        shape: its shape.
        position: of its centre, m.
        orientation: quaternion x, y, z, w; it is normalised, w >= 0.
        material: its surface.
        name: see `Body`; None: "static" and its index.
        group: bits of the groups that it belongs to, see `touch_each_other`.
        mask: bits of the groups that it touches.

    Raises:
        TypeError, ValueError: a field is of the wrong type or out of range.
    """

    shape: Shape
    position: Vector = ZERO
    orientation: Vector = IDENTITY
    material: Material = field(default_factory=Material)
    name: str | None = None
    group: int = 1
    mask: int = EVERY_GROUP

    def __post_init__(self) -> None:
        """Checks every field."""
        check_solid(self)


@dataclass(frozen=True)
class Ground:
    """The horizontal plane z = height; everything below it is solid.

    Args:
        material: its surface.
        height: m.
        name: see `Body`; None: "static" and its index.
        group: bits of the groups that it belongs to, see `touch_each_other`.
        mask: bits of the groups that it touches.

    Raises:
        TypeError, ValueError: a field is of the wrong type or not finite.
    """

    material: Material = field(default_factory=Material)
    height: float = 0.0
    name: str | None = None
    group: int = 1
    mask: int = EVERY_GROUP

    def __post_init__(self) -> None:
        """Checks every field."""
        instance("Ground.material", self.material, Material)
        object.__setattr__(self, "height", number("Ground.height", self.height))
        check_labels(self)


def check_solid(solid: Any) -> None:
    """Checks shape, pose, material and name of a frozen dataclass, and normalises its quaternion.

    Raises:
        TypeError, ValueError: a field is of the wrong type or out of range.
    """
    kind = type(solid).__name__
    instance(f"{kind}.shape", solid.shape, Shape)
    instance(f"{kind}.material", solid.material, Material)
    object.__setattr__(solid, "position", vector(f"{kind}.position", solid.position))
    orientation = unit_quaternion(f"{kind}.orientation", solid.orientation)
    object.__setattr__(solid, "orientation", orientation)
    check_labels(solid)


def touch_each_other(a: Any, b: Any) -> bool:
    """Whether the filters of two solids let them touch: each has a group in the other's mask."""
    return bool(a.group & b.mask and b.group & a.mask)


def check_labels(solid: Any) -> None:
    """Raises TypeError or ValueError unless a solid's name is None or a text, and its bits fit."""
    for name in ("group", "mask"):
        field = f"{type(solid).__name__}.{name}"
        bits = integer(field, getattr(solid, name), low=0)
        if bits > EVERY_GROUP:
            raise ValueError(f"{field} must be at most {EVERY_GROUP}, 32 bits, got {bits}")
    if solid.name is not None:
        text(f"{type(solid).__name__}.name", solid.name)
