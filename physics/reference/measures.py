"""Errors compared with closed forms, for any engine that implements `Simulated`, as a World does.

Each measure builds its own scene, with bodies of 1 kg unless its docstring gives another mass. Most
measures return an error that is zero for a perfect engine: a relative error, or one in the unit
that the docstring gives. `make` builds a simulation of one world from a scene.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from physics.reference import closed_forms
from physics.reference.scenes import (
    CUBE,
    GRAVITY,
    block_on_ground,
    dominoes,
    sphere_on_ground,
    tower,
)
from physics.scene.fidelity import Fidelity
from physics.scene.material import Material
from physics.scene.scene import Scene
from physics.scene.shapes import Shape
from physics.scene.solids import Body, Ground
from physics.world import World

Array = np.ndarray

FRICTION = 0.5
BLOCK = (0.05, 0.05, 0.05)  # m, half extents
PHASES = 100  # times of first contact within a substep, see `rebounds`
IMPACT = 1.0  # m/s, normal speed


class Simulated(Protocol):
    """The interface of an engine that the measures use."""

    @property
    def position(self) -> Array:
        """[1, bodies, 3] m."""

    @property
    def linear_velocity(self) -> Array:
        """[1, bodies, 3] m/s."""

    def advance(self, time: float) -> None:
        """Advances by `time` s."""

    def set_state(self, *, linear_velocity: Any) -> None:
        """Sets the linear velocities in m/s."""


Make = Callable[[Scene], Simulated]


def slide(half_extents: tuple[float, float, float], speed: float, make: Make) -> float:
    """Relative error of the distance that a block slides until it stops, from `speed` m/s."""
    world = make(block_on_ground(half_extents, FRICTION, mass=1.0))
    world.advance(1.0)
    start = float(world.position[0, 0, 0])
    world.set_state(linear_velocity=(speed, 0.0, 0.0))
    world.advance(1.2 * speed / (FRICTION * GRAVITY) + 0.2)
    distance = float(world.position[0, 0, 0]) - start
    return abs(distance / closed_forms.slide_distance(speed, FRICTION, GRAVITY) - 1.0)


def creep(half_extents: tuple[float, float, float], make: Make) -> float:
    """Mean speed in m/s at which a block creeps down a slope of 20 degrees, from 1 s to 60 s."""
    world = make(block_on_ground(half_extents, FRICTION, angle=math.radians(20.0), mass=1.0))
    world.advance(1.0)
    start = world.position[0, 0].copy()
    world.advance(59.0)
    return math.dist(world.position[0, 0], start) / 59.0


def acceleration(degrees: float, second: int, make: Make) -> float:
    """Relative error of the speed that a cube gains on a slope during one second.

    Args:
        degrees: slope.
        second: 1, from 0 s to 1 s, when the contact force first takes a few milliseconds to build
            up; or 2, from 1 s to 2 s.
        make: see the module.
    """
    angle = math.radians(degrees)
    world = make(block_on_ground(BLOCK, FRICTION, angle=angle, mass=1.0))
    speed = [0.0]
    for _ in range(2):
        world.advance(1.0)
        speed.append(float(world.linear_velocity[0, 0, 0]))
    gained = speed[second] - speed[second - 1]
    return abs(gained / closed_forms.incline_acceleration(angle, FRICTION, GRAVITY) - 1.0)


def roll(make: Make) -> float:
    """Relative error of the rolling speed of a ball that starts to slide at 1 m/s without spin."""
    world = make(sphere_on_ground(0.05, FRICTION, mass=1.0))
    world.advance(1.0)
    world.set_state(linear_velocity=(1.0, 0.0, 0.0))
    world.advance(1.5 * closed_forms.rolling_time(1.0, FRICTION, GRAVITY) + 0.1)
    return abs(float(world.linear_velocity[0, 0, 0]) / closed_forms.rolling_speed(1.0) - 1.0)


def rebounds(restitution: float, fidelity: Fidelity) -> Array:
    """Ratios [PHASES] of the speeds after and before an impact of a ball of 0.1 kg.

    The times of first contact are spread evenly over one substep.
    """
    scene = sphere_on_ground(0.05, friction=0.0, restitution=restitution, gravity=0.0)
    world = World(scene, fidelity, count=PHASES, threads=1)
    height = 0.055 + IMPACT * fidelity.substep * np.arange(PHASES) / PHASES
    position = np.stack([0.0 * height, 0.0 * height, height], axis=-1)[:, None]
    world.set_state(position=position, linear_velocity=(0.0, 0.0, -IMPACT))
    world.advance(1.0)
    return world.linear_velocity[:, 0, 2] / IMPACT


def oblique(friction: float, along: float, make: Make) -> float:
    """Relative error of the speed along the ground of a ball after an oblique impact.

    The ball hits the ground at 1 m/s, plus `along` m/s along the ground, with e = 0.5 and without
    gravity.
    """
    scene = sphere_on_ground(
        0.1, friction, 0.5, gravity=0.0, position=(0.0, 0.0, 0.11),
        linear_velocity=(along, 0.0, -IMPACT), mass=1.0,
    )  # fmt: skip
    world = make(scene)
    world.advance(0.2)
    expected = closed_forms.oblique_impact(along, IMPACT, friction, 0.5, 0.1)[0]
    return abs(float(world.linear_velocity[0, 0, 0]) / expected - 1.0)


def grazing(
    shapes: Sequence[Shape],
    restitution: float,
    friction: float,
    fidelity: str | Fidelity,
    count: int = 1000,
) -> World:
    """Worlds without gravity in which bodies collide on random, often grazing paths.

    One body moves towards the ground, or the first of two bodies moves past or into the second.
    Masses are 0.1 kg and 0.2 kg, spins are random. All collisions happen within 0.3 s.

    Args:
        shapes: one or two, of at most 4 cm.
        restitution: of all solids.
        friction: of all solids.
        fidelity: of the worlds.
        count: number of worlds.
    """
    rng = np.random.default_rng(0)
    material = Material(friction, restitution)
    bodies = [
        Body(shape, mass=0.1 * (i + 1), position=(0.2 * i, 0, 0.1), material=material)
        for i, shape in enumerate(shapes)
    ]
    # two bodies never reach the ground; with it their scene uses kernels that others use, too
    ground = Ground(material, 0.0 if len(shapes) == 1 else -10.0)
    world = World(Scene(bodies, [ground], gravity=(0, 0, 0)), fidelity, count, threads=1)
    velocity, position = np.zeros((2, count, len(shapes), 3))
    if len(shapes) == 1:
        heading = rng.uniform(0, 2 * np.pi, count)
        down = rng.uniform(0, 1, count) ** 2
        velocity[:, 0] = np.stack([np.cos(heading), np.sin(heading), -down], axis=-1)
        position[:, 0, 2] = 0.05
    else:
        to = rng.normal(size=(count, 3))
        to /= np.linalg.norm(to, axis=-1, keepdims=True)
        offset = np.cross(to, rng.normal(size=(count, 3)))
        offset *= rng.uniform(0, 0.06, (count, 1)) / np.linalg.norm(offset, axis=-1, keepdims=True)
        velocity[:, 0], position[:, 0] = to, -0.09 * to + offset
    world.set_state(
        position=position, linear_velocity=velocity,
        angular_velocity=rng.uniform(-20, 20, velocity.shape),
        orientation=rng.normal(size=(count, len(shapes), 4)),
    )  # fmt: skip
    return world


def energy_gain(world: World, time: float = 0.3) -> float:
    """Largest relative increase of a world's kinetic energy over its initial value.

    The energy is read 15 times in `time` s.
    """
    before = world.kinetic_energy()
    gain = -math.inf
    for _ in range(15):
        world.advance(time / 15)
        gain = max(gain, float((world.kinetic_energy() / before).max()) - 1.0)
    return gain


class Standing(NamedTuple):
    """How a tower of 4 cm cubes stands.

    Attributes:
        drift: m, largest displacement of a cube along an axis.
        lean: m, largest distance of a cube along x or y from the tower's axis.
        sink: m by which the top cube is lower than in a tower without penetration.
    """

    drift: float
    lean: float
    sink: float


def stand(cubes: int, time: float, make: Make) -> Standing:
    """How a tower of 64 g cubes stands: drift from 1 s to 1 s + `time`, and lean and sink then."""
    world = make(tower(cubes))
    world.advance(1.0)
    start = world.position[0].copy()
    world.advance(time)
    half = CUBE.half_extents[2]
    return Standing(
        drift=float(np.abs(world.position[0] - start).max()),
        lean=float(np.abs(world.position[0, :, :2]).max()),
        sink=(2 * cubes - 1) * half - float(world.position[0, -1, 2]),
    )


def wave_speed(fidelity: str | Fidelity, stones: int = 12, gap: float = 0.03) -> float:
    """Speed in m/s of the wave of falling dominoes, over the second half of the row.

    The centres of the `stones` dominoes of 20 g are `gap` m apart.
    """
    world = World(dominoes(stones, gap), fidelity, threads=1)
    world.advance(1.5)
    touched = [float(world.first_touch(i, i + 1)[0]) for i in range(stones - 1)]
    half = stones // 2
    return gap * (stones - 2 - half) / (touched[-1] - touched[half])
