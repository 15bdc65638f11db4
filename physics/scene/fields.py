"""Forces on bodies other than contacts and gravity: springs to points, attractors, drag.

A body is named by its index or its name. `World.apply_wrench` gives any other force.
"""

from dataclasses import dataclass

from physics.scene.validation import ZERO, Vector, integer, number, vector

BodyName = int | str


def check_body(field: str, body: object) -> None:
    """Raises TypeError unless a body is given by index or name; `Scene` checks that it exists."""
    if isinstance(body, bool) or not isinstance(body, int | str):
        raise TypeError(f"{field} must be the index or the name of a body, got {body!r}")


@dataclass(frozen=True)
class PointSpring:
    """A spring and damper between a point of a body and a fixed point or a point of another body.

    With the distance d of the points the force along the line between them is
    stiffness (d - rest_length) + damping d'. A spring without rest length has no direction of its
    own at d = 0; one with a rest length exerts no force there.

    Args:
        body: that it pulls, by index or name.
        stiffness: N/m.
        damping: N s/m, along the line.
        rest_length: m.
        point: where it is attached, in the body frame, m.
        to: the fixed point in the world frame, m; or another body, by index or name.
        to_point: where it is attached to the other body, in that body's frame, m.

    Raises:
        TypeError, ValueError: a field is of the wrong type, negative or not finite; a `to_point`
            although `to` is a fixed point.
    """

    body: BodyName
    stiffness: float
    damping: float = 0.0
    rest_length: float = 0.0
    point: Vector = ZERO
    to: Vector | BodyName = ZERO
    to_point: Vector = ZERO

    def __post_init__(self) -> None:
        """Checks every field."""
        check_body("PointSpring.body", self.body)
        for name in ("stiffness", "damping", "rest_length"):
            value = number(f"PointSpring.{name}", getattr(self, name), low=0.0)
            object.__setattr__(self, name, value)
        for name in ("point", "to_point"):
            object.__setattr__(self, name, vector(f"PointSpring.{name}", getattr(self, name)))
        if isinstance(self.to, int | str):
            check_body("PointSpring.to", self.to)
            return
        object.__setattr__(self, "to", vector("PointSpring.to", self.to))
        if any(self.to_point):
            raise ValueError(
                f"PointSpring.to_point {self.to_point} needs another body: `to` is the fixed point "
                f"{self.to}; give the body by index or name"
            )


@dataclass(frozen=True)
class Attractor:
    """Accelerates all bodies towards a point by strength / r^exponent, r away from it.

    An exponent of 2 is the gravity of a mass: strength is then G M. It is singular at the point.

    Args:
        position: of the point, world frame, m.
        strength: m^(1 + exponent)/s^2; negative repels.
        exponent: of the distance.
        per_particle: act on six points that have the body's mass and inertia, not only on its
            centre of mass. The nearer points are then pulled more, which also turns the body
            (tides); exact to second order in size over distance.

    Raises:
        TypeError, ValueError: a field is of the wrong type or not finite.
    """

    position: Vector
    strength: float
    exponent: float = 2.0
    per_particle: bool = False

    def __post_init__(self) -> None:
        """Checks every field."""
        object.__setattr__(self, "position", vector("Attractor.position", self.position))
        object.__setattr__(self, "strength", number("Attractor.strength", self.strength))
        exponent = number("Attractor.exponent", self.exponent, low=-8.0, high=8.0)
        object.__setattr__(self, "exponent", exponent)
        if not isinstance(self.per_particle, bool):
            raise TypeError(f"Attractor.per_particle must be a bool, got {self.per_particle!r}")


@dataclass(frozen=True)
class Drag:
    """Friction in a resting fluid: -(linear + quadratic * speed) * velocity, at the centre of mass.

    Args:
        linear: N s/m.
        quadratic: N s^2/m^2, for example density * drag coefficient * area / 2.
        body: on which it acts, by index or name; None: each of them.

    Raises:
        TypeError, ValueError: a field is of the wrong type, negative or not finite.
    """

    linear: float = 0.0
    quadratic: float = 0.0
    body: BodyName | None = None

    def __post_init__(self) -> None:
        """Checks every field."""
        for name in ("linear", "quadratic"):
            value = number(f"Drag.{name}", getattr(self, name), low=0.0)
            object.__setattr__(self, name, value)
        if self.body is not None:
            check_body("Drag.body", self.body)


@dataclass(frozen=True)
class SurfaceDrag:
    """Pressure and friction of a fluid, integrated over the surface points that face the flow.

    A patch of area A with the outward normal n moves at u relative to the fluid. Only where
    s = n . u is positive, the fluid that it meets, density * A * s in kg/s, loses a part of its
    momentum:

        force = -density/2 * A * s * (coefficient * s * n + friction * (u - s n))

    A box that moves along a normal has the drag density/2 * coefficient * area * speed^2, a ball
    half of that on its cross section. Parts of a body do not shade each other, and there is no lift
    or suction from behind.

    Args:
        density: of the fluid, kg/m^3.
        coefficient: of the pressure; 2 if the fluid loses all its momentum along the normal.
        friction: of the tangential part; 2 if it loses all its momentum along the surface.
        flow: velocity of the fluid, m/s: wind.
        body: on which it acts, by index or name; None: each of them.
        points: on the surface of a body, about. The force on a body that does not rotate is exact
            for a box, and with 200 points within 0.2 % for the other shapes.

    Raises:
        TypeError, ValueError: a field is of the wrong type, negative or not finite.
    """

    density: float
    coefficient: float
    friction: float = 0.0
    flow: Vector = ZERO
    body: BodyName | None = None
    points: int = 200

    def __post_init__(self) -> None:
        """Checks every field."""
        for name in ("density", "coefficient", "friction"):
            value = number(f"SurfaceDrag.{name}", getattr(self, name), low=0.0)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "flow", vector("SurfaceDrag.flow", self.flow))
        integer("SurfaceDrag.points", self.points, low=1)
        if self.body is not None:
            check_body("SurfaceDrag.body", self.body)


Field = PointSpring | Attractor | Drag | SurfaceDrag
