"""Truths of theory that closed forms of single bodies on a plane don't show: those of balls.

Contact forces on curved surfaces, several impacts at once, impacts without weight, plastic impacts
of what slides, and states that are set. Each function simulates a scene at a fidelity, and
returns what its docstring says; the right value stands beside it. Bodies have 0.1 kg.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from physics.scene.fidelity import Fidelity, resolve
from physics.scene.material import Material
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Shape, Sphere
from physics.scene.solids import Body, Ground, Static
from physics.scene.torus import Torus
from physics.world import World

Array = np.ndarray
Level = str | Fidelity
# how a scene is simulated: at a fidelity, or in what builds a number of worlds of it
Engine = Level | Callable[[Scene, int], Any]

GRAVITY = 9.81
MASS = 0.1
RADIUS = 0.02  # m
BALL: Shape = Sphere(RADIUS)
RING = (0.3, 0.05)  # m, radii of the ring in which a ball swings
PATH = RING[0] - RING[1] - RADIUS  # m, radius of its path
DOME = 0.5  # m


def worlds_of(engine: Engine, scene: Scene, count: int = 1) -> Any:
    """`count` worlds of a scene, or what an engine of another kind builds of it."""
    return engine(scene, count) if callable(engine) else World(scene, engine, count)


def step_near(level: Level, longest: float) -> float:
    """Multiple of the substep that is near `longest` s."""
    h = resolve(level).substep
    return h * max(1, round(longest / h))


def ring(velocity: float, gravity: float, ball: Shape = BALL) -> Scene:
    """A smooth ball in an upright ring, level with its axis, that moves down at `velocity` m/s."""
    smooth = Material(friction=0.0)
    upright = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    body = Body(ball, mass=MASS, position=(PATH, 0.0, 0.0), material=smooth,
                linear_velocity=(0.0, 0.0, -velocity))  # fmt: skip
    ring = Static(Torus(*RING), orientation=upright, material=smooth)
    return Scene([body], [ring], gravity=(0.0, 0.0, -gravity))


def swinging_force(level: Level, ball: Shape = BALL) -> float:
    """Normal force at the bottom over m g, of a ball that swings in a ring.

    It starts at the height of the ring's axis. Right: 3. v^2 = 2 g R, so m g + m v^2/R = 3 m g.
    """
    world, h = World(ring(0.0, GRAVITY, ball), level), step_near(level, 2e-3)
    force, height = 0.0, 0.0
    for _ in range(int(0.4 / h)):
        world.advance(h)
        if world.position[0, 0, 2] < height:
            height = world.position[0, 0, 2]
            force = world.normal_force(0, 1)[0]
    return float(force / (MASS * GRAVITY))


def circling_forces(level: Level, ball: Shape = BALL) -> tuple[float, float, float]:
    """Forces over m v^2/R on a ball that circles in a ring without gravity at 1.7 m/s.

    Right: 1, each: of `World.normal_force`, of `World.force` and of the sum of `World.contacts`.
    """
    world = World(ring(1.7, 0.0, ball), level)
    world.advance(0.4)
    contact = np.linalg.norm(world.contacts().force.sum(axis=0))
    net, unit = np.linalg.norm(world.force()[0, 0]), MASS * 1.7**2 / PATH
    return (
        float(world.normal_force(0, 1)[0] / unit),
        float(net / unit),
        float(contact / unit),
    )


def leaving_cosine(level: Level, ball: Shape = BALL) -> float:
    """Cosine of the angle at which a smooth ball leaves a dome, over that of theory.

    Right: 1. From rest at the angle a it leaves where cos = 2/3 cos a.
    """
    start, distance = 0.05, DOME + RADIUS
    smooth = Material(friction=0.0)
    place = (distance * math.sin(start), 0.0, distance * math.cos(start))
    body = Body(ball, mass=MASS, position=place, material=smooth)
    world = World(Scene([body], [Static(Sphere(DOME), material=smooth)]), level)
    h, cosine = step_near(level, 2e-3), 1.0
    for _ in range(int(1.0 / h)):
        world.advance(h)
        if world.normal_force(0, 1)[0] > 0.0:
            cosine = world.position[0, 0, 2] / np.linalg.norm(world.position[0, 0])
    return float(cosine / (2.0 / 3.0 * math.cos(start)))


def _others(count: int) -> list[Body]:
    """Balls far away: with more than 32 of them a world is one of many bodies."""
    return [Body(Sphere(RADIUS), mass=MASS, position=(0.1 * n, 50.0, 0.0)) for n in range(count)]


def cradle_energy(
    level: Level, restitution: float = 1.0, others: int = 0, ball: Shape = BALL
) -> float:
    """Energy after an impact over that before: a ball hits four that touch, mu = 0, at 1 m/s.

    Right: 1 for e = 1. `others`: balls far away.
    """
    hard = Material(friction=0.0, restitution=restitution)
    places = [-2.0 * RADIUS - 1e-3, *(2.0 * RADIUS * n for n in range(4))]
    balls = [
        Body(ball, mass=MASS, position=(x, 0.0, 0.0), material=hard,
             linear_velocity=(float(n == 0), 0.0, 0.0))
        for n, x in enumerate(places)
    ]  # fmt: skip
    world = World(Scene([*balls, *_others(others)], gravity=(0.0, 0.0, 0.0)), level)
    before = world.kinetic_energy()[0]
    world.advance(0.2)
    return float(world.kinetic_energy()[0] / before)


def falling_restitution(
    level: Level,
    restitution: float,
    speed: float,
    wall: bool = False,
    others: int = 0,
    ball: Shape = BALL,
) -> float:
    """Restitution of two balls that fall freely together and close at `speed` m/s.

    With `wall` that of one on a vertical wall. Right: `restitution`; neither has a load. `others`:
    balls far away.
    """
    hard = Material(friction=0.0, restitution=restitution)
    body = Body(ball, mass=MASS, position=(-2.0 * RADIUS - 5e-4, 0.0, 0.0), material=hard,
                linear_velocity=(speed, 0.0, 0.0))  # fmt: skip
    if wall:
        static = Static(Box((RADIUS, 1.0, 5.0)), material=hard)
        world = World(Scene([body], [static]), level)
    else:
        other = Body(ball, mass=MASS, position=(0.0, 0.0, 0.0), material=hard)
        world = World(Scene([body, other, *_others(others)]), level)
    world.advance(0.2)
    velocity = world.linear_velocity[0, :, 0]
    away = -velocity[0] if wall else velocity[1] - velocity[0]
    return float(away / speed)


def _landings(level: Level, shape: Shape, material: Material, gravity: float, count: int) -> World:
    body = Body(shape, mass=MASS, position=(0.0, 0.0, 1.0), material=material)
    ground = Ground(material=material)
    return World(Scene([body], [ground], gravity=(0.0, 0.0, -gravity)), level, count)


def plastic_friction(
    level: Level, friction: float = 0.3, spin: float = 0.0, count: int = 32, ball: Shape = BALL
) -> Array:
    """[count] tangential impulse over mu times the normal one, of a ball that lands with e = 0.

    It falls at 1 m/s and slides at 2 m/s, with `spin` rad/s about the vertical; the worlds differ
    in the time of the first touch within a step. Right: 1, because it still slides after the impact
    (Walton 1993: the change of spin then follows from the normal impulse alone).
    """
    world = _landings(level, ball, Material(friction), GRAVITY, count)
    h = world.fidelity.substep
    position, velocity, turning = (np.zeros((count, 1, 3)) for _ in range(3))
    position[:, 0, 2] = RADIUS + 1e-4 + h * np.arange(count) / count
    velocity[:, 0] = 2.0, 0.0, -1.0
    turning[:, 0, 2] = spin
    world.set_state(position=position, linear_velocity=velocity, angular_velocity=turning)
    world.advance(0.05)
    after = world.linear_velocity[:, 0]
    normal = 1.0 + GRAVITY * 0.05 + after[:, 2]
    return np.asarray(np.hypot(2.0 - after[:, 0], after[:, 1]) / (friction * normal))


def early_restitution(level: Level, shape: Shape, restitution: float, count: int = 32) -> Array:
    """[count] restitution over e of impacts that begin within the first step after `set_state`.

    Right: 1.
    """
    world = _landings(level, shape, Material(0.0, restitution), 0.0, count)
    gap = world.fidelity.substep * np.maximum(np.linspace(-0.5, 1.5, count), 0.0)
    position, velocity = np.zeros((count, 1, 3)), np.zeros((count, 1, 3))
    position[:, 0, 2], velocity[:, 0, 2] = RADIUS + gap, -1.0
    world.set_state(position=position, linear_velocity=velocity)
    world.advance(0.05)
    return np.asarray(world.linear_velocity[:, 0, 2] / restitution)


def bounced_energy(level: Level, ball: Shape = BALL, count: int = 32) -> Array:
    """[count] energy over that before, of a ball with e = 1 from 10 m that bounced ten times.

    In a step of `fast` it moves by 4 cm; the worlds differ in the time of the first touch within a
    step. Right: 1.
    """
    world = _landings(level, ball, Material(0.0, 1.0), GRAVITY, count)
    speed, position = math.sqrt(2.0 * GRAVITY * 10.0), np.zeros((count, 1, 3))
    fall = speed * world.fidelity.substep
    position[:, 0, 2] = RADIUS + 10.0 + fall * np.arange(count) / count
    world.set_state(position=position)
    before = world.potential_energy() + world.kinetic_energy()
    world.advance(20.0 * speed / GRAVITY)
    return np.asarray((world.potential_energy() + world.kinetic_energy()) / before)


# what a table shows: name, right value, and the one measured at a fidelity, of any shape of a ball
BALLS: tuple[tuple[str, float, Callable[[Level, Shape], float]], ...] = (
    ("force at the bottom of a swing in a ring, over m g", 3.0, swinging_force),
    (
        "force on a ball that circles in a ring, over m v²/R",
        1.0,
        lambda f, b: circling_forces(f, b)[0],
    ),
    ("the same, net force", 1.0, lambda f, b: circling_forces(f, b)[1]),
    ("the same, sum of contacts", 1.0, lambda f, b: circling_forces(f, b)[2]),
    ("cosine where a ball leaves a dome, over 2/3 cos a", 1.0, leaving_cosine),
    ("five balls, e = 1: energy after over before", 1.0, lambda f, b: cradle_energy(f, ball=b)),
    (
        "two balls in free fall, e = 1 at 0.05 m/s",
        1.0,
        lambda f, b: falling_restitution(f, 1.0, 0.05, ball=b),
    ),
    (
        "the same, e = 0.1 at 0.1 m/s",
        0.1,
        lambda f, b: falling_restitution(f, 0.1, 0.1, ball=b),
    ),
    (
        "ball on a wall, e = 0.1 at 0.1 m/s",
        0.1,
        lambda f, b: falling_restitution(f, 0.1, 0.1, True, ball=b),
    ),
    (
        "plastic landing, friction over mu N, worst",
        1.0,
        lambda f, b: plastic_friction(f, ball=b).min(),
    ),
    (
        "impact in the first step, e = 1, largest",
        1.0,
        lambda f, b: early_restitution(f, b, 1.0).max(),
    ),
    (
        "ball from 10 m, e = 1, energy after ten bounces, least",
        1.0,
        lambda f, b: bounced_energy(f, b).min(),
    ),
)
