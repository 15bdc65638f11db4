"""Draws the values of a scene: sizes, masses, poses, speeds, materials, gravity, fidelity.

What spans decades is uniform in its logarithm. A scene has one scale of length, of which its solids
are a part or a multiple: a large ratio of sizes asks for more samples than fit into memory. The
step is drawn about the time in which a body falls by its own size, so that part of the scenes run.
"""

from typing import Any, NamedTuple

import numpy as np

from benchmarks.fuzz.families import Family
from physics import (
    Attractor,
    BallJoint,
    Body,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Drag,
    Drive,
    Fidelity,
    Gripper,
    Ground,
    Hinge,
    Material,
    PointSpring,
    Scene,
    Sphere,
    Static,
    Torus,
)

Vector = tuple[float, float, float]

SIZES, MASSES, SPEEDS, GRAVITY = (1e-4, 1e2), (1e-6, 1e6), (1e-3, 1e4), (1e-3, 1e3)
OWN_SCALE = 0.15  # probability that solids differ up to OTHERS times in size, not LIKE times
# A box has samples as close as the smallest solid is wide: with 100 times its size, 10^6 of them
LIKE, OTHERS = 3.0, 8.0
MOVES, SPINS, OVERLAPS, OWN_MASS = 0.6, 0.5, 0.3, 0.5  # probabilities


class Draw:
    """Random numbers of one scene."""

    def __init__(self, number: int) -> None:
        """`number`: of the scene; it decides everything."""
        self.random = np.random.default_rng(number)

    def power(self, low: float, high: float) -> float:
        """A number whose logarithm is uniform."""
        return float(10.0 ** self.random.uniform(np.log10(low), np.log10(high)))

    def between(self, low: float, high: float) -> float:
        """A uniform number."""
        return float(self.random.uniform(low, high))

    def chance(self, probability: float) -> bool:
        """Whether something with a probability happens."""
        return bool(self.random.random() < probability)

    def vector(self, length: float) -> Vector:
        """A vector of a length in any direction."""
        x, y, z = self.random.normal(size=3)
        scale = length / float(np.sqrt(x * x + y * y + z * z))
        return (float(scale * x), float(scale * y), float(scale * z))

    def turn(self) -> tuple[float, float, float, float]:
        """A quaternion of any rotation."""
        x, y, z, w = self.random.normal(size=4).tolist()
        return (x, y, z, w)


class Drawn(NamedTuple):
    """A scene that has been drawn, and how to run it."""

    scene: Scene
    fidelity: Fidelity


def draw_scene(family: Family, number: int) -> Drawn:
    """Scene `number` of a family.

    Raises:
        TypeError, ValueError: the values that were drawn are refused.
    """
    draw = Draw(number)
    scale, ratio = draw.power(*SIZES), OTHERS if draw.chance(OWN_SCALE) else LIKE
    gravity = draw.power(*GRAVITY)
    mass, speed = draw.power(*MASSES), draw.power(*SPEEDS)
    sizes = [scale * draw.power(1.0 / ratio, ratio) for _ in family.shapes]
    bodies, height = [], 0.0
    overlaps = draw.chance(OVERLAPS)
    for shape, size in zip(family.shapes, sizes, strict=True):
        height += 0.0 if overlaps else 2.5 * size
        middle = draw.vector(draw.between(0.0, 2.0) * size) if overlaps else draw.vector(size)
        bodies.append(
            Body(
                _shape(draw, shape, size),
                mass=draw.power(*MASSES) if draw.chance(OWN_MASS) else mass,
                position=(middle[0], middle[1], abs(middle[2]) + height),
                orientation=draw.turn(),
                linear_velocity=draw.vector(speed if draw.chance(MOVES) else 0.0),
                angular_velocity=draw.vector(draw.power(*SPEEDS) if draw.chance(SPINS) else 0.0),
                material=_material(draw, family),
            )
        )
    statics: list[Ground | Static] = []
    for static in family.statics:
        if static == "ground":
            statics.append(Ground(_material(draw, family)))
        else:
            solid = _shape(draw, static, 3.0 * scale)
            statics.append(Static(solid, (0.0, 0.0, -scale), material=_material(draw, family)))
    scene = Scene(
        bodies, statics, [_drive(draw, drive, scale, family) for drive in family.drives],
        draw.vector(gravity) if family.tilted else (0.0, 0.0, -gravity),
        [_field(draw, field, scale) for field in family.fields], _joints(draw, family, bodies),
    )  # fmt: skip
    return Drawn(scene, _fidelity(draw, family, min(sizes), gravity))


def _shape(draw: Draw, name: str, size: float) -> Any:
    """A shape of about a half width in m; sides differ, so that no body is isotropic."""
    long = size * draw.between(1.1, 3.0)
    match name:
        case "ball":
            return Sphere(size)
        case "box":
            return Box((long, size, size * draw.between(0.3, 0.95)))
        case "capsule":
            return Capsule(size, long)
        case "cylinder":
            return Cylinder(size, long)
        case "torus":
            return Torus(1.5 * long, size)
        case "compound":
            return Compound([(Box((long, size, size)), (0, 0, 0)), (Sphere(size), (0, 0, 2 * size)),
                             (Sphere(size), (0, 0, -2 * size))])  # fmt: skip
    raise ValueError(f"no shape {name!r}")


def _material(draw: Draw, family: Family) -> Material:
    resistance = [draw.power(1e-6, 1e-1) if family.resists else 0.0 for _ in range(2)]
    return Material(
        friction=0.0 if family.smooth else draw.power(1e-3, 10.0),
        restitution=float(draw.random.choice([0.0, 1.0, draw.between(0.0, 1.0)])),
        stiffness=draw.power(1e-3, 1e12) if draw.chance(0.1) else None,
        rolling_resistance=resistance[0],
        spinning_resistance=resistance[1],
    )


def _drive(draw: Draw, name: str, scale: float, family: Family) -> Drive | Gripper:
    place, material = (0.0, 0.0, 3.0 * scale), _material(draw, family)
    mass, force, frequency = draw.power(*MASSES), draw.power(1e-6, 1e6), draw.power(1.0, 1e3)
    if name == "gripper":
        return Gripper(
            Box((scale, 0.3 * scale, scale)), mass=mass, force_limit=force,
            grip_limit=draw.power(1e-6, 1e6), position=place,
            distance=scale * draw.between(0.5, 6.0), frequency=frequency, material=material,
        )  # fmt: skip
    return Drive(
        _shape(draw, name, scale), mass=mass, force_limit=force, position=place,
        frequency=frequency, damping_ratio=draw.between(0.0, 3.0), material=material,
    )  # fmt: skip


def _field(draw: Draw, name: str, scale: float) -> Any:
    if name == "spring":
        to = draw.vector(draw.power(0.1, 10.0) * scale)
        return PointSpring(0, draw.power(1e-6, 1e6), damping=draw.power(1e-6, 1e3), to=to)
    if name == "attractor":
        place = draw.vector(draw.power(1.0, 10.0) * scale)
        return Attractor(place, draw.power(1e-6, 1e3), exponent=draw.between(0.0, 3.0))
    return Drag(linear=draw.power(1e-6, 1e3), quadratic=draw.power(1e-6, 1e3))


def _joints(draw: Draw, family: Family, bodies: list[Body]) -> list[Any]:
    if not family.joint:
        return []
    anchor = bodies[0].position
    if family.joint == "Hinge":
        return [Hinge(0, 1, anchor, draw.vector(1.0))]
    return [BallJoint(0, 1, anchor)]


def _fidelity(draw: Draw, family: Family, size: float, gravity: float) -> Fidelity:
    impulse = family.fidelity.get("law") == "impulse"
    falls = float(np.sqrt(size / gravity))
    return Fidelity(
        substep=min(falls * draw.power(1e-3, 1.0), 10.0),
        collision_substeps=int(draw.random.integers(1, 20)),
        contact_resolution=draw.power(1e-2, 2.0 if impulse else 0.7),
        spacing=draw.between(0.3, 1.0), rounding=draw.power(1e-3, 0.5),
        skin=draw.power(0.01, 1.0), courant=draw.power(0.01, 1.0),
        impact_tolerance=1e-6 if draw.chance(0.5) else max(1e-9, 1e-3 * size),
        **family.fidelity,
    )  # fmt: skip
