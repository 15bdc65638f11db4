"""Truths about bodies that stand: when they tip, and what a pull does that friction can hold.

Each function simulates a scene at a fidelity, and returns what its docstring says, with the value
of rigid bodies beside it. Contacts are soft, so loads that come at once make a body tip early and
slide on; `physics.analysis.standing` derives how much. With `slow` the load grows over a second or
more.
"""

import math
from typing import Any

import numpy as np

from physics.analysis.standing import Base, Pull, Tipping, base, pull, tipping
from physics.model.build import build
from physics.model.rocking import outward_sides
from physics.reference.truths import GRAVITY, MASS, Engine, Level, worlds_of
from physics.scene.material import Material
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Capsule
from physics.scene.solids import Body, Ground, Static
from physics.world import World

Array = np.ndarray

BOX = (0.02, 0.06)  # m, half width and half height of the box that tips
FRICTION = 0.5  # of what is pulled, and of the stick
STICK = (0.01, 0.3)  # m, radius and length of the core of the stick
_TILTED = math.cos(math.radians(25.0))  # of a body that has fallen
_STEPS = 100  # in which a load grows


def _standing(
    engine: Engine, half_extents: tuple[float, ...], material: Material, count: int
) -> Any:
    a, b, c = half_extents
    box = Body(Box((a, b, c)), mass=MASS, position=(0.0, 0.0, c), material=material)
    return worlds_of(engine, Scene([box], [Ground(material=material)]), count)


def _load(world: Any, force: Array, seconds: float, slow: bool) -> None:
    """Pulls at the centre by a force [worlds, 3] for a time, and as long before while it grows."""
    for n in range(_STEPS if slow else 0):
        world.apply_wrench(force=(n + 1) / _STEPS * force[:, None])
        world.advance(seconds / _STEPS)
    for _ in range(_STEPS):
        world.apply_wrench(force=force[:, None])
        world.advance(seconds / _STEPS)


def _fallen(world: Any) -> Array:
    x, y = world.orientation[:, 0, :2].T
    return np.asarray(1.0 - 2.0 * (x**2 + y**2) < _TILTED)


def tipping_slope(
    engine: Engine, slow: bool, size: float = 1.0, restitution: float = 0.0, count: int = 64
) -> float:
    """The least slope in rad on which a box `BOX` tips, times `size`, that is set down at rest.

    With `slow` it lies on level ground, and a pull at its centre grows; the result is the
    arctangent of the pull over m g. Right, for rigid bodies with sharp edges: atan(width / height).
    The least of `count` slopes from an eighth of it to an eighth beyond.
    """
    width, height = (size * x for x in BOX)
    world = _standing(engine, (width, width, height), Material(1.0, restitution), count)
    slopes = np.linspace(0.125, 1.125, count) * math.atan2(width, height)
    force, seconds = np.zeros((count, 3)), 2.0 * math.sqrt(size)
    if slow:
        force[:, 0] = MASS * GRAVITY * np.tan(slopes)
        world.advance(0.5 * seconds)
    else:
        force[:, 0] = MASS * GRAVITY * np.sin(slopes)
        force[:, 2] = MASS * GRAVITY * (1.0 - np.cos(slopes))
    _load(world, force, seconds, slow)
    return float(slopes[_fallen(world)].min(initial=math.inf))


def _base(world: World) -> tuple[Base, float, float]:
    """The base of the body of a world; its sink, and m g over the shear stiffness, in m."""
    scene, fidelity = world.scene, world.fidelity
    row, shape = build(scene, fidelity)[0].half_pair[0], scene.bodies[0].shape
    samples = shape.samples(fidelity.spacing * shape.width, 0.5 * fidelity.rounding * shape.width)
    stands = base(samples, outward_sides(shape), np.array([0.0, 0.0, -1.0]))
    assert stands is not None
    weight = GRAVITY * float(row["pair_mass"])
    return stands, weight / float(row["stiffness"]), weight / float(row["shear_stiffness"])


def predicted_tipping(level: Level, size: float = 1.0) -> Tipping:
    """What `analysis.standing` predicts of the same box."""
    width, height = (size * x for x in BOX)
    stands, sink, _ = _base(_standing(level, (width, width, height), Material(1.0), 1))
    return tipping(stands, sink)


def pulled(engine: Engine, part: float, slow: bool) -> tuple[float, float]:
    """Displacement in m and speed in m/s of a cube of 4 cm, 2 s after a pull of `part` mu m g.

    Right: 0 and 0 for a part below 1; above it, and for a load that comes at once, the speed is
    (part - 1) mu g t.
    """
    world = _standing(engine, (0.02, 0.02, 0.02), Material(FRICTION), 1)
    world.advance(1.0)
    start = float(world.position[0, 0, 0])
    _load(world, np.array([[part * FRICTION * MASS * GRAVITY, 0.0, 0.0]]), 2.0, slow)
    return float(world.position[0, 0, 0]) - start, float(world.linear_velocity[0, 0, 0])


def predicted_pull(level: Level, part: float) -> Pull:
    """What `analysis.standing` predicts of the same cube."""
    stands, sink, shear = _base(_standing(level, (0.02, 0.02, 0.02), Material(FRICTION), 1))
    return pull(stands, sink, shear, FRICTION, part, GRAVITY)


def leaning_angle() -> float:
    """The least angle in rad at which a stick `STICK` can lean on a wall, friction on both ends.

    At the limit friction is mu times the normal force at both ends. Moments about the lower end of
    the core, with radius r and length L, give

        cos a (1 - mu^2) / 2 = mu sin a + (r / L) mu (1 + mu).
    """
    rest = STICK[0] / STICK[1] * FRICTION * (1.0 + FRICTION)
    size, phase = math.hypot(0.5 * (1.0 - FRICTION**2), FRICTION), 0.5 * (1.0 - FRICTION**2)
    return math.acos(rest / size) - math.acos(phase / size)


def leaning(engine: Engine, slow: bool, count: int = 64) -> tuple[float, float]:
    """Angles in rad of the stick that leans least and stays: at which it was put, and stands.

    It is put there at rest; with `slow` its weight grows over a second. Right: both
    `leaning_angle`.
    """
    radius, length = STICK
    rough = Material(FRICTION)
    stick = Body(Capsule(radius, 0.5 * length), mass=MASS, material=rough)
    wall = Static(Box((0.05, 0.5, 0.5)), position=(0.05, 0.0, 0.5), material=rough)
    world = worlds_of(engine, Scene([stick], [Ground(material=rough), wall]), count)
    angles = np.linspace(0.93, 1.25, count) * leaning_angle()
    position, orientation = np.zeros((count, 1, 3)), np.zeros((count, 1, 4))
    position[:, 0, 0] = -radius - 0.5 * length * np.cos(angles)
    position[:, 0, 2] = radius + 0.5 * length * np.sin(angles)
    half = 0.5 * (0.5 * math.pi - angles)
    orientation[:, 0, 1], orientation[:, 0, 3] = np.sin(half), np.cos(half)
    world.set_state(position=position, orientation=orientation)
    lift = np.zeros((count, 1, 3))
    for n in range(_STEPS if slow else 0):
        lift[:, 0, 2] = MASS * GRAVITY * (1.0 - (n + 1) / _STEPS)
        world.apply_wrench(force=lift)
        world.advance(1.0 / _STEPS)
    world.advance(2.0)
    height = (world.position[:, 0, 2] - radius) / (0.5 * length)
    stays = height > 0.8 * np.sin(angles)
    first = int(np.argmax(stays))
    return float(angles[first]), float(np.arcsin(height[first]))
