"""What a tuned number of the engine decides, measured for one set of values.

Prints the columns of `python -m benchmarks.sweep`, one JSON object. Run it with the packages of the
source tree that is to be measured.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from physics import PRESETS, Body, Box, Ground, Material, Scene, Sphere, World
from physics.reference.measures import energy_gain, grazing, rebounds, slide, stand
from physics.reference.scenes import GRAVITY, landing_cube, tower

SPEEDS = np.repeat([0.3, 1.0, 1.5, 3.0], 8)  # m/s
ROD, PLATE = Box((0.002, 0.002, 0.02)), Box((0.02, 0.02, 0.002))


def landing(on: str, preset: str) -> float:
    """Largest error of restitution of a cube that lands on a face, an edge or a corner."""
    phase = np.tile(np.arange(8) / 8.0, 4)
    worst = 0.0
    for spacing in (0.5, 0.25):
        fidelity = replace(PRESETS[preset], spacing=spacing)
        for restitution in (0.5, 0.75):
            world = World(landing_cube(on, restitution, 0.1), fidelity, len(SPEEDS))
            position = world.position.copy()
            position[:, 0, 2] += SPEEDS * fidelity.substep * phase
            down = -SPEEDS[:, None, None] * np.array([0.0, 0.0, 1.0])
            world.set_state(position=position, linear_velocity=down)
            world.advance(0.3)
            errors = world.linear_velocity[:, 0, 2] / SPEEDS - restitution
            worst = max(worst, float(np.abs(errors).max()))
    return worst


def drift(cubes: int, preset: str) -> float:
    """m by which a tower drifts in 20 s; a fallen one by more than a cube's width."""
    return stand(cubes, 20.0, partial(World, fidelity=preset)).drift


def gain(shape: Box, preset: str) -> float:
    """Largest relative gain of energy in 500 grazing impacts without restitution."""
    return max(energy_gain(grazing((shape,), 0.0, mu, preset, 500)) for mu in (0.01, 0.5, 2.0))


def turn(preset: str) -> float:
    """Error in m/s of a cube that slides across a slope of 30 degrees at 1 m/s, after 0.5 s.

    Friction opposes its velocity, which turns: it is compared with integrated Coulomb friction.
    """
    angle, friction, h = np.pi / 6.0, 0.5, 1e-4
    material = Material(friction, 0.0)
    body = Body(
        Box((0.02, 0.02, 0.02)), mass=0.1, position=(0, 0, 0.02), material=material,
        linear_velocity=(0, 1, 0),
    )  # fmt: skip
    gravity = (GRAVITY * np.sin(angle), 0.0, -GRAVITY * np.cos(angle))
    world = World(Scene([body], [Ground(material)], gravity=gravity), preset)
    world.advance(0.5)
    u, pull = np.array([0.0, 1.0]), np.array([gravity[0], 0.0])
    for _ in range(round(0.5 / h)):
        middle = u + 0.5 * h * (pull + friction * gravity[2] * u / np.linalg.norm(u))
        u = u + h * (pull + friction * gravity[2] * middle / np.linalg.norm(middle))
    return float(np.abs(world.linear_velocity[0, 0, :2] - u).max())


def slip(preset: str) -> float:
    """Distance in m that a flat box with e = 0.9 slips in a second on a slope of 10 degrees."""
    angle, material = np.radians(10.0), Material(0.5, 0.9)
    body = Body(Box((0.03, 0.03, 0.01)), mass=0.1, position=(0, 0, 0.01), material=material)
    gravity = (GRAVITY * np.sin(angle), 0.0, -GRAVITY * np.cos(angle))
    world = World(Scene([body], [Ground(material)], gravity=gravity), preset)
    world.advance(1.0)
    return float(world.position[0, 0, 0])


def ball(height: float, restitution: float) -> World:
    """A ball of 2 cm radius above or in the ground, at `solid`."""
    body = Body(
        Sphere(0.02), mass=0.1, position=(0, 0, height), material=Material(0.0, restitution)
    )
    return World(Scene([body], [Ground(Material(0.0, restitution))]), "solid")


def settling() -> float:
    """Part of its bouncing time that a ball with e = 0.9 loses by coming to rest too early."""
    world, last = ball(0.07, 0.9), 0.0
    for i in range(1500):
        world.advance(0.002)
        moves = world.position[0, 0, 2] > 0.0201 or abs(world.linear_velocity[0, 0, 2]) > 5e-3
        last = 0.002 * (i + 1) if moves else last
    return 1.0 - last / (np.sqrt(2.0 * 0.05 / GRAVITY) * (1.0 + 0.9) / (1.0 - 0.9))


def parting() -> float:
    """Mean speed in m/s at which a ball whose centre is 1 cm above the ground leaves it."""
    world = ball(0.01, 0.0)
    world.advance(0.006)
    return float(world.position[0, 0, 2] - 0.01) / 0.006


def landing_tower() -> float:
    """Largest speed in m/s left after a tower of eight has landed at 1 m/s without restitution."""
    material, scene = Material(0.5, 0.0), tower(8)
    bodies = [replace(b, linear_velocity=(0, 0, -1), material=material) for b in scene.bodies]
    world = World(Scene(bodies, [Ground(material)], gravity=(0, 0, 0)), "solid")
    world.advance(0.01)
    return float(np.abs(world.linear_velocity).max())


def spinning_slab() -> float:
    """How much farther a slab on its long edge slides, spinning at 3 rad/s, than v^2/(2 mu g)."""
    material = Material(0.5, 0.0)
    slab = Body(Box((0.05, 0.0015, 0.02)), mass=0.1, position=(0, 0, 0.02), material=material)
    world = World(Scene([slab], [Ground(material)]), "solid")
    world.advance(0.2)
    start = world.position[0, 0].copy()
    world.set_state(linear_velocity=(0.3, 0, 0), angular_velocity=(0, 0, 3))
    world.advance(1.0)
    straight = 0.3**2 / (2.0 * material.friction * GRAVITY)
    return float(np.linalg.norm(world.position[0, 0] - start)) / straight - 1.0


def bounce(preset: str) -> float:
    """Largest error of restitution of a ball, over all phases of the step."""
    ratios = [np.abs(rebounds(e, PRESETS[preset]) - e).max() for e in (0.25, 0.5, 0.75)]
    return float(max(ratios))


COLUMNS: dict[str, Callable[[], float]] = {
    "ball, balanced": partial(bounce, "balanced"),
    "face": partial(landing, "face", "balanced"),
    "edge": partial(landing, "edge", "balanced"),
    "corner": partial(landing, "corner", "balanced"),
    "rod gains, fast": partial(gain, ROD, "fast"),
    "plate gains, fast": partial(gain, PLATE, "fast"),
    "turn, m/s": partial(turn, "balanced"),
    "slip, m": partial(slip, "balanced"),
    "slide": partial(slide, (0.02, 0.02, 0.02), 0.5, partial(World, fidelity="balanced")),
    "3 at fast, m": partial(drift, 3, "fast"),
    "5 at balanced, m": partial(drift, 5, "balanced"),
    "ball, solid": partial(bounce, "solid"),
    "corner, solid": partial(landing, "corner", "solid"),
    "10 at solid, m": partial(drift, 10, "solid"),
    "settling, solid": settling,
    "parting, m/s": parting,
    "tower lands, m/s": landing_tower,
    "slab, solid": spinning_slab,
}

if __name__ == "__main__":
    print(json.dumps({name: measure() for name, measure in COLUMNS.items()}))
