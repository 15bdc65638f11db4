"""Driven solids: what a servo moves."""

from dataclasses import dataclass, field
from typing import Any

from physics.scene.material import Material
from physics.scene.shapes import Shape
from physics.scene.solids import EVERY_GROUP, check_solid
from physics.scene.validation import IDENTITY, ZERO, Vector, number, positive


@dataclass(frozen=True)
class Drive:
    """A solid that a servo moves along x, y and z and that never rotates.

    The servo is a spring and damper between the drive and a set point, and its force is limited
    along each axis: a drive that is pressed against something stops, and pushes no matter through
    the ground. Its carriage holds the drive's weight, so gravity doesn't act on it.

    Args:
        shape: its shape.
        mass: kg that the servo moves, above zero.
        force_limit: N along each axis, above zero.
        position: of the shape's centre at the start, m.
        orientation: quaternion x, y, z, w, constant; it is normalised, w >= 0.
        frequency: rad/s, natural frequency of the servo.
        damping_ratio: of the servo; 1 is critical.
        material: its surface.
        name: see `Body`; None: "drive" and its index.
        group: see `Body`.
        mask: see `Body`.

    Raises:
        TypeError, ValueError: a field is of the wrong type or out of range.
    """

    shape: Shape
    mass: float
    force_limit: float
    position: Vector = ZERO
    orientation: Vector = IDENTITY
    frequency: float = 60.0
    damping_ratio: float = 1.0
    material: Material = field(default_factory=Material)
    name: str | None = None
    group: int = 1
    mask: int = EVERY_GROUP

    def __post_init__(self) -> None:
        """Checks every field."""
        _check_servo(self, "mass", "force_limit", "frequency")


@dataclass(frozen=True)
class Gripper:
    """A parallel gripper: two equal fingers on one carriage, closing along y, that never rotate.

    One mechanism with four degrees of freedom: its carriage moves along x, y and z, and the
    distance of the fingers changes. Carriage and grip have servos with separate limits, so a full
    grip leaves the carriage all of its force. (Two fingers with independent limits have no
    restoring force once both are saturated, and could press an object away sideways.) Along x and
    z the fingers move as one solid.

    In a World it counts as two drives, its fingers, the one at smaller y first. They don't touch
    each other: the grip servo keeps them apart.

    Args:
        shape: of a finger.
        mass: kg of a finger with its half of the carriage, above zero.
        force_limit: N of the carriage along each axis, above zero.
        grip_limit: N with which each finger presses at most, above zero.
        position: midpoint of the fingers' centres at the start, m.
        distance: of the fingers' centres at the start, m, above zero.
        orientation: of both fingers, quaternion x, y, z, w, constant; it is normalised, w >= 0.
        frequency: rad/s, natural frequency of both servos.
        damping_ratio: of both servos; 1 is critical.
        material: the fingers' surface.
        name: see `Body`; the fingers are then "name[0]" and "name[1]". None: "drive" and the
            index of each finger.
        group: see `Body`.
        mask: see `Body`.

    Raises:
        TypeError, ValueError: a field is of the wrong type or out of range.
    """

    shape: Shape
    mass: float
    force_limit: float
    grip_limit: float
    position: Vector = ZERO
    distance: float = 0.1
    orientation: Vector = IDENTITY
    frequency: float = 60.0
    damping_ratio: float = 1.0
    material: Material = field(default_factory=Material)
    name: str | None = None
    group: int = 1
    mask: int = EVERY_GROUP

    def __post_init__(self) -> None:
        """Checks every field."""
        _check_servo(self, "mass", "force_limit", "grip_limit", "distance", "frequency")

    @property
    def fingers(self) -> tuple[Drive, Drive]:
        """Both fingers; each has half of the carriage's force."""
        x, y, z = self.position
        first, second = (
            Drive(
                self.shape,
                self.mass,
                0.5 * self.force_limit,
                (x, y + side * 0.5 * self.distance, z),
                self.orientation,
                self.frequency,
                self.damping_ratio,
                self.material,
                None if self.name is None else f"{self.name}[{finger}]",
                self.group,
                self.mask,
            )
            for finger, side in enumerate((-1.0, 1.0))
        )
        return first, second


def _check_servo(drive: Any, *names: str) -> None:
    """Checks a drive or gripper; the fields of these names must be above zero."""
    kind = type(drive).__name__
    check_solid(drive)
    for name in names:
        object.__setattr__(drive, name, positive(f"{kind}.{name}", getattr(drive, name)))
    ratio = number(f"{kind}.damping_ratio", drive.damping_ratio, low=0.0)
    object.__setattr__(drive, "damping_ratio", ratio)
