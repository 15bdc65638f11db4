"""What a user writes: a scene of bodies, static solids and driven tools, in SI units.

All of it is frozen and validated as it is built: an error names the field, its value and what would
be right, and nothing half-built remains.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from physics.scene.shapes import Shape
from physics.scene.validation import instance, number, positive, unit_quaternion, vector

Vector = tuple[float, ...]

ZERO: Vector = (0.0, 0.0, 0.0)
NO_TURN: Vector = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Material:
    """How a surface touches.

    Args:
        friction: Coulomb's coefficient, static and kinetic, at least 0. A pair has the geometric
            mean of its two, so a frictionless surface stays so against everything.
        restitution: ratio of the normal speeds after and before an impact, 0 to 1. A pair has the
            larger of its two.
        stiffness: N/m of one face in contact, or None: then it follows from the fidelity's step and
            contact resolution and from the masses of the pair.
        rolling_resistance: m; a contact resists rolling by at most this times its normal force, as
            if that acted so far ahead. A pair has the larger of its two.
        spinning_resistance: m; likewise against spinning about the normal.
    """

    friction: float = 0.5
    restitution: float = 0.1
    stiffness: float | None = None
    rolling_resistance: float = 0.0
    spinning_resistance: float = 0.0

    def __post_init__(self) -> None:
        """Checks the numbers."""
        object.__setattr__(self, "friction", number("Material.friction", self.friction, low=0.0))
        object.__setattr__(
            self, "restitution", number("Material.restitution", self.restitution, low=0.0, high=1.0)
        )
        for name in ("rolling_resistance", "spinning_resistance"):
            object.__setattr__(self, name, number(f"Material.{name}", getattr(self, name), low=0.0))
        if self.stiffness is not None:
            object.__setattr__(self, "stiffness", positive("Material.stiffness", self.stiffness))


@dataclass(frozen=True)
class Body:
    """A free rigid body.

    Args:
        shape: its shape; the body frame's axes are the shape's, its origin the centre of mass.
        mass: kg, above zero; or give the density.
        density: kg/m^3, above zero; 1000 if neither is given.
        position: of the centre of mass, m.
        orientation: quaternion x, y, z, w, body frame to world frame; it is normalised.
        linear_velocity: m/s, world frame.
        angular_velocity: rad/s, world frame.
        material: its surface.
    """

    shape: Shape
    mass: float | None = None
    density: float | None = None
    position: Vector = ZERO
    orientation: Vector = NO_TURN
    linear_velocity: Vector = ZERO
    angular_velocity: Vector = ZERO
    material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        """Checks every field and works out the mass."""
        instance("Body.shape", self.shape, Shape)
        instance("Body.material", self.material, Material)
        if self.mass is not None and self.density is not None:
            raise ValueError(
                f"Body takes mass or density, not both: got mass={self.mass!r}, "
                f"density={self.density!r}"
            )
        if self.mass is None:
            density = positive("Body.density", 1000.0 if self.density is None else self.density)
            object.__setattr__(self, "mass", density * self.shape.volume)
        object.__setattr__(self, "mass", positive("Body.mass", self.mass))
        for name in ("position", "linear_velocity", "angular_velocity"):
            object.__setattr__(self, name, vector(f"Body.{name}", getattr(self, name)))
        object.__setattr__(
            self, "orientation", unit_quaternion("Body.orientation", self.orientation)
        )


@dataclass(frozen=True)
class Static:
    """A solid that never moves.

    Args:
        shape: any shape with an exact surface.
        position: of its centre, m.
        orientation: quaternion x, y, z, w; it is normalised.
        material: its surface.
    """

    shape: Shape
    position: Vector = ZERO
    orientation: Vector = NO_TURN
    material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        """Checks every field."""
        instance("Static.shape", self.shape, Shape)
        instance("Static.material", self.material, Material)
        object.__setattr__(self, "position", vector("Static.position", self.position))
        object.__setattr__(
            self, "orientation", unit_quaternion("Static.orientation", self.orientation)
        )


@dataclass(frozen=True)
class Ground:
    """The horizontal plane z = height; everything below it is solid.

    Args:
        material: its surface.
        height: m.
    """

    material: Material = field(default_factory=Material)
    height: float = 0.0

    def __post_init__(self) -> None:
        """Checks both fields."""
        instance("Ground.material", self.material, Material)
        object.__setattr__(self, "height", number("Ground.height", self.height))


@dataclass(frozen=True)
class Drive:
    """A tool on a carriage: a solid that a servo moves along x, y and z and that never turns.

    The servo is a spring and damper between the tool and a reference point, and its force is
    limited along each axis: a tool that is pressed against something stops, and pushes no matter
    through the ground. The carriage carries the tool's weight, so gravity doesn't act on it.

    Args:
        shape: any shape with an exact surface.
        mass: kg that the servo moves, above zero.
        force_limit: N along each axis, above zero.
        position: of the shape's centre at the start, m.
        orientation: quaternion x, y, z, w, fixed for good; it is normalised.
        frequency: rad/s, natural frequency of the servo.
        damping_ratio: of the servo; 1 is critical.
        material: its surface.
    """

    shape: Shape
    mass: float
    force_limit: float
    position: Vector = ZERO
    orientation: Vector = NO_TURN
    frequency: float = 60.0
    damping_ratio: float = 1.0
    material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        """Checks every field."""
        instance("Drive.shape", self.shape, Shape)
        instance("Drive.material", self.material, Material)
        for name in ("mass", "force_limit", "frequency"):
            object.__setattr__(self, name, positive(f"Drive.{name}", getattr(self, name)))
        object.__setattr__(
            self, "damping_ratio", number("Drive.damping_ratio", self.damping_ratio, low=0.0)
        )
        object.__setattr__(self, "position", vector("Drive.position", self.position))
        object.__setattr__(
            self, "orientation", unit_quaternion("Drive.orientation", self.orientation)
        )


@dataclass(frozen=True)
class Gripper:
    """A parallel gripper: two equal fingers on one carriage, closing along y, that never turn.

    One mechanism that moves in four ways: its carriage along x, y and z, and the distance of the
    fingers. Carriage and grip have servos with limits of their own, so that a full grip leaves the
    carriage all of its force. Two fingers with a limit each could press an object away sideways,
    once both are at it. Along x and z the fingers are one solid.

    In a World it counts as two tools, its fingers, the one at smaller y first. They don't touch
    each other: what moves them keeps them apart.

    Args:
        shape: of a finger, any shape with an exact surface.
        mass: kg of a finger with its half of the carriage, above zero.
        force_limit: N of the carriage along each axis, above zero.
        grip_limit: N with which each finger presses at most, above zero.
        position: in the middle of the fingers' centres at the start, m.
        distance: of the fingers' centres at the start, m, above zero.
        orientation: of both fingers, quaternion x, y, z, w, fixed for good; it is normalised.
        frequency: rad/s, natural frequency of both servos.
        damping_ratio: of both servos; 1 is critical.
        material: the fingers' surface.
    """

    shape: Shape
    mass: float
    force_limit: float
    grip_limit: float
    position: Vector = ZERO
    distance: float = 0.1
    orientation: Vector = NO_TURN
    frequency: float = 60.0
    damping_ratio: float = 1.0
    material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        """Checks every field."""
        instance("Gripper.shape", self.shape, Shape)
        instance("Gripper.material", self.material, Material)
        for name in ("mass", "force_limit", "grip_limit", "distance", "frequency"):
            object.__setattr__(self, name, positive(f"Gripper.{name}", getattr(self, name)))
        ratio = number("Gripper.damping_ratio", self.damping_ratio, low=0.0)
        object.__setattr__(self, "damping_ratio", ratio)
        object.__setattr__(self, "position", vector("Gripper.position", self.position))
        turn = unit_quaternion("Gripper.orientation", self.orientation)
        object.__setattr__(self, "orientation", turn)

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
            )
            for side in (-1.0, 1.0)
        )
        return first, second


@dataclass(frozen=True)
class Scene:
    """Bodies, static solids and driven tools under gravity.

    Args:
        bodies: free bodies; at least one body or drive is needed.
        statics: Ground or Static.
        drives: driven tools: Drive or Gripper.
        gravity: m/s^2.
    """

    bodies: Sequence[Body] = ()
    statics: Sequence[Ground | Static] = ()
    drives: Sequence[Drive | Gripper] = ()
    gravity: Vector = (0.0, 0.0, -9.81)

    def __post_init__(self) -> None:
        """Checks every field and turns the sequences into tuples."""
        kinds: dict[str, tuple[type, ...]] = {
            "bodies": (Body,),
            "statics": (Ground, Static),
            "drives": (Drive, Gripper),
        }
        for name, types in kinds.items():
            value = getattr(self, name)
            if isinstance(value, str) or not isinstance(value, Sequence):
                raise TypeError(f"Scene.{name} must be a sequence, got {value!r}")
            for i, item in enumerate(value):
                instance(f"Scene.{name}[{i}]", item, *types)
            object.__setattr__(self, name, tuple(value))
        if not self.bodies and not self.drives:
            raise ValueError("Scene.bodies must hold at least one Body (or Scene.drives a Drive)")
        object.__setattr__(self, "gravity", vector("Scene.gravity", self.gravity))

    @cached_property
    def tools(self) -> tuple[Drive, ...]:
        """All driven solids in the order of a World: of a Gripper, both fingers."""
        tools: list[Drive] = []
        for drive in self.drives:
            tools += drive.fingers if isinstance(drive, Gripper) else [drive]
        return tuple(tools)

    @cached_property
    def grippers(self) -> tuple[tuple[int, Gripper], ...]:
        """Every Gripper, and the index of its first finger among the tools."""
        found, first = [], 0
        for drive in self.drives:
            if isinstance(drive, Gripper):
                found.append((first, drive))
            first += 2 if isinstance(drive, Gripper) else 1
        return tuple(found)
