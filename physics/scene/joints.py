"""Joints: what holds two bodies together, or a body to a drive or to the world.

Anchors and axes are given in the world frame, at the poses that the bodies have in the scene. `b`
is a body, a drive, or None for the world. Drives come after the bodies in the order of indices; the
fingers of a Gripper can't have joints. Two solids with a joint don't touch each other unless
`collide` is set.
"""

import math
from dataclasses import dataclass
from typing import Any

from physics.scene.fields import BodyName, check_body
from physics.scene.validation import Vector, instance, number, positive, vector

# rad, of a hinge's limits: a body that passes one by less than half of what is left of a full turn
# is pushed back
_WIDEST_RANGE = 2.0 * math.pi - 0.5


@dataclass(frozen=True)
class Motor:
    """Drives a hinge or slider with a limited force, to a velocity or as a servo to a position.

    Args:
        force_limit: N m of a hinge, N of a slider, above zero.
        velocity: rad/s of a hinge, m/s of a slider: of `a` relative to `b`, along the axis. With
            zero the motor is a brake. `World.command_motors` changes it.
        position: rad or m, set point of a servo; None: none, the velocity counts. A servo drives
            with `frequency` times the distance to its set point. `World.move_motors` changes it.
        frequency: 1/s, above zero; beyond half of 1/substep it counts as that. A servo whose force
            is too small to stop in 1/frequency s overshoots.

    Raises:
        TypeError, ValueError: a field is of the wrong type, not finite or not above zero; both a
            velocity and a position.
    """

    force_limit: float
    velocity: float = 0.0
    position: float | None = None
    frequency: float = 30.0

    def __post_init__(self) -> None:
        """Checks every field."""
        for name in ("force_limit", "frequency"):
            object.__setattr__(self, name, positive(f"Motor.{name}", getattr(self, name)))
        object.__setattr__(self, "velocity", number("Motor.velocity", self.velocity))
        if self.position is not None:
            object.__setattr__(self, "position", number("Motor.position", self.position))
            if self.velocity != 0.0:
                raise ValueError(
                    f"Motor takes velocity or position, not both: got velocity={self.velocity}, "
                    f"position={self.position}"
                )


@dataclass(frozen=True)
class BallJoint:
    """A point of one body stays at a point of another; they rotate freely about it.

    Args:
        a: body, by index or name.
        b: another body or a drive, by index or name; None: the world.
        anchor: the common point, world frame, m.
        collide: whether the two solids can touch each other.
        name: for error messages; None: "joint" and its index.

    Raises:
        TypeError, ValueError: a field is of the wrong type or not finite.
    """

    a: BodyName
    b: BodyName | None
    anchor: Vector
    collide: bool = False
    name: str | None = None

    def __post_init__(self) -> None:
        """Checks every field."""
        _check(self)


@dataclass(frozen=True)
class Hinge:
    """Two bodies rotate relative to each other about one axis.

    Args:
        a: body, by index or name.
        b: another body or a drive, by index or name; None: the world.
        anchor: a point of the axis, world frame, m.
        axis: its direction, world frame; any length above zero.
        limits: (low, high) of the angle of `a` relative to `b`, rad, within -pi to pi and at most
            2 pi - 0.5 apart; zero, the angle in the scene, lies between them. None: no limits.
        motor: drives the angle.
        collide: whether the two solids can touch each other.
        name: for error messages; None: "joint" and its index.

    Raises:
        TypeError, ValueError: a field is of the wrong type, not finite or out of range.
    """

    a: BodyName
    b: BodyName | None
    anchor: Vector
    axis: Vector = (0.0, 0.0, 1.0)
    limits: Vector | None = None
    motor: Motor | None = None
    collide: bool = False
    name: str | None = None

    def __post_init__(self) -> None:
        """Checks every field."""
        _check(self, most=math.pi)


@dataclass(frozen=True)
class Slider:
    """A body moves relative to another along one axis and doesn't rotate relative to it.

    Args:
        a: body, by index or name.
        b: another body or a drive, by index or name; None: the world.
        axis: world frame; any length above zero. It is fixed to `b`.
        anchor: a point of `a` that moves along the axis, world frame, m; None: its centre.
        limits: (low, high) of the displacement of `a` relative to `b`, m; zero, the displacement in
            the scene, lies between them. None: no limits.
        motor: drives the displacement.
        collide: whether the two solids can touch each other.
        name: for error messages; None: "joint" and its index.

    Raises:
        TypeError, ValueError: a field is of the wrong type, not finite or out of range.
    """

    a: BodyName
    b: BodyName | None
    axis: Vector = (0.0, 0.0, 1.0)
    anchor: Vector | None = None
    limits: Vector | None = None
    motor: Motor | None = None
    collide: bool = False
    name: str | None = None

    def __post_init__(self) -> None:
        """Checks every field."""
        _check(self)


@dataclass(frozen=True)
class Weld:
    """Two bodies keep the pose that they have relative to each other in the scene.

    One Body with a Compound as its shape is faster and exact.

    Args:
        a: body, by index or name.
        b: another body or a drive, by index or name; None: the world.
        anchor: point at which their positions are compared, world frame, m; None: the centre of
            `a`.
        collide: whether the two solids can touch each other.
        name: for error messages; None: "joint" and its index.

    Raises:
        TypeError, ValueError: a field is of the wrong type or not finite.
    """

    a: BodyName
    b: BodyName | None
    anchor: Vector | None = None
    collide: bool = False
    name: str | None = None

    def __post_init__(self) -> None:
        """Checks every field."""
        _check(self)


@dataclass(frozen=True)
class Distance:
    """A point of one body keeps its distance from a point of another, as if by a massless rod.

    Args:
        a: body, by index or name.
        b: another body or a drive, by index or name; None: the world.
        length: m, above zero; None: the distance in the scene, which a given length must equal.
        anchor: the point of `a`, world frame, m; None: its centre.
        to_anchor: the point of `b`, world frame, m; None: its centre. Needed if `b` is the world.
        collide: whether the two solids can touch each other.
        name: for error messages; None: "joint" and its index.

    Raises:
        TypeError, ValueError: a field is of the wrong type, not finite or out of range.
    """

    a: BodyName
    b: BodyName | None
    length: float | None = None
    anchor: Vector | None = None
    to_anchor: Vector | None = None
    collide: bool = False
    name: str | None = None

    def __post_init__(self) -> None:
        """Checks every field."""
        _check(self)
        if self.length is not None:
            object.__setattr__(self, "length", positive("Distance.length", self.length))
        if self.b is None and self.to_anchor is None:
            raise ValueError(
                "Distance.to_anchor must be a point (x, y, z) of the world if b is None, got None"
            )


Joint = BallJoint | Hinge | Slider | Weld | Distance


def _check(joint: Any, most: float = math.inf) -> None:
    """Checks the fields that several joints have; `most`: bound of the limits."""
    kind = type(joint).__name__
    check_body(f"{kind}.a", joint.a)
    if joint.b is not None:
        check_body(f"{kind}.b", joint.b)
    instance(f"{kind}.collide", joint.collide, bool)
    if joint.name is not None:
        instance(f"{kind}.name", joint.name, str)
    for name in ("anchor", "to_anchor", "axis"):
        value = getattr(joint, name, None)
        needed = name == "axis" or (name == "anchor" and isinstance(joint, BallJoint | Hinge))
        if value is not None or (needed and hasattr(joint, name)):
            object.__setattr__(joint, name, vector(f"{kind}.{name}", value))
    if hasattr(joint, "axis") and not any(joint.axis):
        raise ValueError(f"{kind}.axis must have a length above zero, got {joint.axis}")
    limits = getattr(joint, "limits", None)
    if limits is not None:
        low, high = vector(f"{kind}.limits", limits, 2)
        if not -most <= low <= 0.0 <= high <= most or low == high:
            bounds = f" within -{most:.6g} to {most:.6g}" if most < math.inf else ""
            raise ValueError(
                f"{kind}.limits must be (low, high){bounds} with low <= 0 <= high and low < high: "
                f"the scene's pose is at 0; got {limits!r}"
            )
        if most < math.inf and high - low > _WIDEST_RANGE:
            raise ValueError(
                f"{kind}.limits must span at most {_WIDEST_RANGE:.6g} rad, got {limits!r}: nearer "
                "to a full turn a body could jump from one limit to the other; None: no limits"
            )
        object.__setattr__(joint, "limits", (low, high))
    if getattr(joint, "motor", None) is not None:
        instance(f"{kind}.motor", joint.motor, Motor)
