"""Scenes of many bodies: heaps, a pyramid, dominoes and rubble, of any number of bodies."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from physics.reference.heaps import heap_scene
from physics.scene.fidelity import PRESETS, Fidelity
from physics.scene.material import Material
from physics.scene.particles import Particles
from physics.scene.ready_bodies import chess_piece, torus
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Capsule, Shape, Sphere
from physics.scene.solids import Body, Ground, Static

# m, half the edge of a cube of the tasks
HALF = 0.02
# bodies at the bottom of a heap carry many others: at "balanced" they would press into each other
# by a third of their width; dominoes that fall press springs in by that much even at 0.5 ms
HEAP, DOMINOES = Fidelity(substep=0.5e-3), replace(PRESETS["solid"], substep=1e-3)


class LargeScene(NamedTuple):
    """A scene of many bodies and the fidelity that suits it."""

    scene: Scene
    fidelity: Fidelity


def heap(count: int, seed: int = 0, half: float = HALF, shapes: Sequence[Shape] = ()) -> LargeScene:
    """Cubes, or other shapes, fall onto the ground between four walls.

    They start on a lattice that is about half as high as it is wide, at random orientations and
    with a distance at which no two overlap.

    Args:
        count: number of bodies.
        seed: of the orientations, of small displacements and of the choice among `shapes`.
        half: m, half the edge of a cube.
        shapes: of the bodies, chosen at random; cubes by default.
    """
    random = np.random.default_rng(seed)
    choice = list(shapes) or [Box((half, half, half))]
    apart = 2.0 * max(shape.reach for shape in choice) + 0.2 * half
    side = max(2, round((2 * count) ** (1 / 3)))
    material = Material(friction=0.5)
    bodies = []
    for k in range(count):
        place = np.array([k % side - side / 2, k // side % side - side / 2, k // side**2 + 0.6])
        bodies.append(
            Body(
                choice[random.integers(len(choice))],
                density=500.0,
                position=tuple(apart * place + random.uniform(-0.1, 0.1, 3) * half),
                orientation=tuple(random.normal(size=4)),
                material=material,
            )
        )
    inside, thick = (side / 2 + 0.5) * apart, 2.0 * half
    height = (count / side**2 + 2.0) * apart
    far = inside + thick
    walls = [
        Static(Box((x, y, height)), position=(px, py, height), material=material)
        for x, y, px, py in (
            (far, thick, 0.0, -far), (far, thick, 0.0, far),
            (thick, inside, -far, 0.0), (thick, inside, far, 0.0),
        )
    ]  # fmt: skip
    return LargeScene(Scene(bodies, [Ground(material), *walls]), HEAP)


def rubble(count: int, seed: int = 0) -> LargeScene:
    """Boxes, balls and capsules of a few sizes fall between four walls."""
    sizes = [HALF * factor for factor in (0.6, 0.8, 1.0)]
    shapes: list[Shape] = [Box((r, 0.8 * r, 0.6 * r)) for r in sizes]
    shapes += [Sphere(r) for r in sizes] + [Capsule(0.5 * r, 0.6 * r) for r in sizes]
    return heap(count, seed, shapes=shapes)


def pyramid(count: int, seed: int = 0, gap: float = 0.05) -> LargeScene:
    """Rows of cubes of 1 m, each on two of the row below, as many rows as `count` allows.

    Args:
        count: number of cubes, at most; rows are complete.
        seed: not used: nothing is random.
        gap: m, between the cubes of a row.
    """
    base = int((math.sqrt(8 * count + 1) - 1) / 2)
    material, half = Material(friction=0.6), 0.5
    bodies = [
        Body(
            Box((half, half, half)),
            position=((k - (base - row - 1) / 2) * (1.0 + gap), 0.0, half + row),
            material=material,
        )
        for row in range(base)
        for k in range(base - row)
    ]
    # substeps as in four per frame of a screen with 60 Hz
    fidelity = Fidelity(law="impulse", contact_resolution=1.8, substep=1.0 / 240.0)
    return LargeScene(Scene(bodies, [Ground(material)]), fidelity)


def dominoes(count: int, seed: int = 0) -> LargeScene:
    """Dominoes of 5 cm in a spiral; the first one turns over its lower edge.

    It falls from 2.7 rad/s on: the least w with w^2 r^2 4/3 = 2 g (r - z), where r is the distance
    of its centre from the edge and z the height of the centre.
    """
    half, push = (0.004, 0.0125, 0.025), 6.0  # rad/s
    material = Material(friction=0.3)
    apart, turn = 0.02, 0.05  # m along the spiral, and between its turns
    bodies, angle = [], 4.0 * math.pi
    for n in range(count):
        radius = turn * angle / (2.0 * math.pi)
        heading = angle + 0.5 * math.pi
        x, y, pushed = math.cos(heading), math.sin(heading), push if n == 0 else 0.0
        speed = pushed * half[2]
        bodies.append(
            Body(
                Box(half),
                density=1000.0,
                position=(radius * math.cos(angle), radius * math.sin(angle), half[2]),
                orientation=(0.0, 0.0, math.sin(0.5 * heading), math.cos(0.5 * heading)),
                linear_velocity=(speed * x, speed * y, pushed * half[0]),
                angular_velocity=(-pushed * y, pushed * x, 0.0),
                material=material,
            )
        )
        angle += apart / radius
    return LargeScene(Scene(bodies, [Ground(material)]), DOMINOES)


def _particles(shape: Particles, count: int, seed: int) -> LargeScene:
    """Harada's heaps: equal bodies of balls of 1 cm, dropped into a box."""
    columns = max(1, round((0.7 * count) ** (1 / 3)))
    scene = heap_scene([shape] * count, columns, Material(friction=0.5, restitution=0.3), seed=seed)
    fidelity = Fidelity(
        damping="dashpot", friction="viscous", substep=1.5e-4, contact_resolution=0.25
    )
    return LargeScene(scene, fidelity)


def chess(count: int, seed: int = 0) -> LargeScene:
    """Chess pieces of four balls in a row fall between four walls."""
    return _particles(chess_piece(0.01), count, seed)


def tori(count: int, seed: int = 0) -> LargeScene:
    """Rings of six balls fall between four walls."""
    return _particles(torus(0.01), count, seed)


SCENES: dict[str, Callable[[int, int], LargeScene]] = {
    "chess": chess,
    "tori": tori,
    "pyramid": pyramid,
    "dominoes": dominoes,
    "rubble": rubble,
    "heap": heap,
}
