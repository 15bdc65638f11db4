"""Truths of theory that closed forms of single bodies on a plane don't show.

Contact forces on curved surfaces, several impacts at once, impacts without weight, plastic impacts
of what slides, rocking, and states that are set. Each function simulates a scene at a fidelity, and
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
RADIUS = 0.02  # m, of balls; half the width of cubes
BALL: Shape = Sphere(RADIUS)
RING = (0.3, 0.05)  # m, radii of the ring in which a ball swings
PATH = RING[0] - RING[1] - RADIUS  # m, radius of its path
DOME = 0.5  # m
BLOCK = (0.015, 0.06)  # m, half width and half height of the block that rocks
# Housner (1963): angular velocity after and before the impact of a slim block on its other edge
ROCKING = 1.0 - 1.5 * BLOCK[0] ** 2 / (BLOCK[0] ** 2 + BLOCK[1] ** 2)


def worlds_of(engine: Engine, scene: Scene, count: int = 1) -> Any:
    """`count` worlds of a scene, or what an engine of another kind builds of it."""
    return engine(scene, count) if callable(engine) else World(scene, engine, count)


def _step(level: Level, longest: float) -> float:
    """Multiple of the substep that is near `longest` s."""
    h = resolve(level).substep
    return h * max(1, round(longest / h))


def _ring(velocity: float, gravity: float, ball: Shape) -> Scene:
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
    world, h = World(_ring(0.0, GRAVITY, ball), level), _step(level, 2e-3)
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
    world = World(_ring(1.7, 0.0, ball), level)
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
    h, cosine = _step(level, 2e-3), 1.0
    for _ in range(int(1.0 / h)):
        world.advance(h)
        if world.normal_force(0, 1)[0] > 0.0:
            cosine = world.position[0, 0, 2] / np.linalg.norm(world.position[0, 0])
    return float(cosine / (2.0 / 3.0 * math.cos(start)))


def dome_slide(level: Level) -> tuple[float, float]:
    """Speed and normal force of a cube that slides down a dome of 1 m, over those of theory.

    It starts at 0.3 rad with 0.8 m/s, mu = 0.2, and is compared at 0.6 rad. Right: 1 and 1.
    """
    rough, angle, core = Material(friction=0.2), 0.3, 1.0 + RADIUS
    # friction turns the cube about its contact until that lies mu times its height downhill
    behind = math.atan(0.2 * RADIUS / core)
    distance, speed = core / math.cos(behind), 0.8
    x, z = distance * math.sin(angle), distance * math.cos(angle)
    half = 0.5 * (angle + behind)
    cube = Body(
        Box((RADIUS, RADIUS, RADIUS)), mass=MASS, position=(x, 0.0, z), material=rough,
        orientation=(0.0, math.sin(half), 0.0, math.cos(half)),
        linear_velocity=(speed * z / distance, 0.0, -speed * x / distance),
        angular_velocity=(0.0, speed / distance, 0.0),
    )  # fmt: skip
    world = World(Scene([cube], [Static(Sphere(1.0), material=rough)]), level)
    h, seen = _step(level, 2e-3), [(angle, speed, math.nan)]
    while seen[-1][0] < 0.61 and len(seen) < 1000:
        world.advance(h)
        x, _, z = world.position[0, 0]
        force = world.normal_force(0, 1)[0]
        seen.append((math.atan2(x, z), float(np.linalg.norm(world.linear_velocity[0, 0])), force))
    angles, speeds, forces = np.array(seen[1:]).T
    exact, press = _slid(distance, behind, 0.2, angle, 0.6, speed)
    near = np.abs(angles - 0.6) < 0.05  # the cube sways a little
    force = np.polyval(np.polyfit(angles[near], forces[near], 1), 0.6)
    return float(np.interp(0.6, angles, speeds) / exact), float(force / (MASS * press))


def _slid(
    radius: float, behind: float, friction: float, start: float, end: float, speed: float
) -> tuple[float, float]:
    """Speed in m/s and N/m in m/s^2 at the angle `end` rad of a body that slides on a circle.

    Its contact is `behind` rad further on than its centre, so

        N/m (cos b + mu sin b) = g cos a - v^2/R,    v dv/da = R (g sin a + N/m (sin b - mu cos b)).
    """
    radial = math.cos(behind) + friction * math.sin(behind)
    along = math.sin(behind) - friction * math.cos(behind)

    def press(angle: float, square: float) -> float:
        return (GRAVITY * math.cos(angle) - square / radius) / radial

    def rate(angle: float, square: float) -> float:
        return 2.0 * radius * (GRAVITY * math.sin(angle) + press(angle, square) * along)

    square, step = speed**2, (end - start) / 1000
    for n in range(1000):
        angle = start + n * step
        middle = square + 0.5 * step * rate(angle, square)
        square += step * rate(angle + 0.5 * step, middle)
    return math.sqrt(square), press(end, square)


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


def rocking(level: Level, count: int = 24) -> Array:
    """[count] angular velocity after over before the impact of a block that rocks, e = 0, mu = 1.

    It is let go at half to 0.6 of the angle at which it would tip. Right: `ROCKING`, by the angular
    momentum about the edge that is hit (Housner 1963). The speeds follow from the largest angles.
    """
    rounding = resolve(level).rounding * BLOCK[0]
    wide, high = BLOCK[0] - rounding, BLOCK[1] - rounding  # of the core
    tip = math.atan2(wide, high)
    start = np.linspace(0.5, 0.6, count) * tip
    block = Body(Box((BLOCK[0], *BLOCK)), mass=MASS, material=Material(1.0))
    world = World(Scene([block], [Ground(material=Material(1.0))]), level, count)
    position, orientation = np.zeros((count, 1, 3)), np.zeros((count, 1, 4))
    position[:, 0, 0] = high * np.sin(start) - wide * np.cos(start)
    position[:, 0, 2] = rounding + wide * np.sin(start) + high * np.cos(start)
    orientation[:, 0, 1], orientation[:, 0, 3] = np.sin(0.5 * start), np.cos(0.5 * start)
    world.set_state(position=position, orientation=orientation)
    h, angles = _step(level, 1e-3), []
    for _ in range(int(0.6 / h)):
        world.advance(h)
        angles.append(2.0 * np.arctan2(world.orientation[:, 0, 1], world.orientation[:, 0, 3]))
    ratios = []
    for begins, angle in zip(start, np.array(angles).T, strict=True):
        over = int(np.argmax(angle < 0.0))
        far = -angle[over : over + int(0.3 / h)].min()
        rises, falls = (math.cos(tip - a) - math.cos(tip) for a in (far, begins))
        ratios.append(math.sqrt(max(rises, 0.0) / falls))
    return np.array(ratios)


# what a table of all truths shows: name, right value, and the measured value at a fidelity; first
# those of balls, whose shape can be another one that is a ball
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
OTHERS: tuple[tuple[str, float, Callable[[Level], float]], ...] = (
    ("speed of a cube that slides down a dome, over theory", 1.0, lambda f: dome_slide(f)[0]),
    ("its normal force, over theory", 1.0, lambda f: dome_slide(f)[1]),
    ("rocking block, speed after over before, mean", ROCKING, lambda f: rocking(f).mean()),
)
