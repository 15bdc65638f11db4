"""Scenes whose motion has a closed form, and scenes that resemble the tasks.

Gravity is tilted instead of the ground: an incline of angle theta is a level plane on which g has
the component g sin(theta) along +x.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from physics.scene.drives import Drive
from physics.scene.fidelity import Fidelity
from physics.scene.material import Material
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Capsule, Shape, Sphere
from physics.scene.solids import Body, Ground
from physics.scene.validation import Vector
from physics.world import World

GRAVITY = 9.81  # m/s^2
CUBE = Box((0.02, 0.02, 0.02))
BALL = Sphere(0.02)
FAR_BELOW = -1e3  # m, height of a ground that no body reaches


def tilted_gravity(angle: float, gravity: float = GRAVITY) -> Vector:
    """Gravity in m/s^2 on a ground that slopes down along +x by `angle` rad."""
    return (gravity * math.sin(angle), 0.0, -gravity * math.cos(angle))


def _on_ground(
    shape: Shape, height: float, material: Material, gravity: Vector, **body: Any
) -> Scene:
    """A body with its centre at `height` m above a ground of the same material.

    `body` has further fields of the Body; its mass is 0.1 kg by default. Gravity is in m/s^2.
    """
    body = {"mass": 0.1, "position": (0.0, 0.0, height), **body}
    return Scene([Body(shape, material=material, **body)], [Ground(material)], gravity=gravity)


def block_on_ground(
    half_extents: tuple[float, float, float] = CUBE.half_extents,
    friction: float = 0.5,
    restitution: float = 0.0,
    angle: float = 0.0,
    stiffness: float | None = None,
    **body: Any,
) -> Scene:
    """A block on the ground, which is level or inclined by `angle` rad.

    Half extents are in m, stiffness is in N/m. `body` has further fields of the Body; its mass is
    0.1 kg by default.
    """
    material = Material(friction, restitution, stiffness)
    gravity = tilted_gravity(angle)
    return _on_ground(Box(half_extents), half_extents[2], material, gravity, **body)


def landing_cube(on: str, restitution: float, friction: float = 0.0, along: float = 0.0) -> Scene:
    """A cube without gravity that hits the ground at 1 m/s with a face, an edge or a corner.

    The centre of this face, edge or corner is vertically below the centre of the cube.

    Args:
        on: "face", "edge" or "corner".
        restitution: of cube and ground.
        friction: of cube and ground.
        along: m/s, horizontal speed.
    """
    half = CUBE.half_extents[0]
    corners = {"face": (0.0, 0.0, 1.0), "edge": (0.0, 1.0, 1.0), "corner": (1.0, 1.0, 1.0)}
    lowest = np.array(corners[on])
    reach = half * float(np.linalg.norm(lowest))
    # smallest rotation that makes `lowest` point down; for a face, half a revolution about x
    axis = np.cross(lowest, (0.0, 0.0, -1.0))
    axis = axis if axis.any() else np.array([1.0, 0.0, 0.0])
    angle = math.acos(-lowest[2] * half / reach)
    x, y, z = np.sin(0.5 * angle) * axis / np.linalg.norm(axis)
    scene = block_on_ground(
        friction=friction, restitution=restitution, position=(0, 0, reach + 0.01),
        linear_velocity=(along, 0, -1.0), orientation=(x, y, z, math.cos(0.5 * angle)),
    )  # fmt: skip
    return replace(scene, gravity=(0.0, 0.0, 0.0))


def sphere_on_ground(
    radius: float = BALL.radius,
    friction: float = 0.5,
    restitution: float = 0.0,
    angle: float = 0.0,
    gravity: float = GRAVITY,
    stiffness: float | None = None,
    **body: Any,
) -> Scene:
    """A ball that touches the ground, which is level or inclined by `angle` rad.

    The radius is in m, gravity in m/s^2, stiffness in N/m. `body` has further fields of the Body;
    its mass is 0.1 kg by default.
    """
    material = Material(friction, restitution, stiffness)
    return _on_ground(Sphere(radius), radius, material, tilted_gravity(angle, gravity), **body)


def capsule_on_ground(radius: float = 0.02, half_length: float = 0.03) -> Scene:
    """A capsule of 0.1 kg that lies on the ground along x; radius and half length in m."""
    lying = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))
    material = Material(0.5, 0.0)
    shape = Capsule(radius, half_length)
    return _on_ground(shape, radius, material, tilted_gravity(0.0), orientation=lying)


def push_like(cube_mass: float = 0.1, force_limit: float = 20.0, friction: float = 0.5) -> Scene:
    """A cube on the ground and a spherical drive 5 cm from its centre, along -x.

    The mass is in kg, the force limit of the drive in N.
    """
    material = Material(friction, 0.0)
    return Scene(
        [Body(CUBE, mass=cube_mass, position=(0.0, 0.0, 0.02), material=material)],
        [Ground(material)],
        [Drive(Sphere(0.015), 0.3, force_limit, (-0.05, 0.0, 0.02), material=material)],
    )


def two_cubes(
    first: dict[str, Any] | None = None,
    second: dict[str, Any] | None = None,
    material: Material | None = None,
    ground: float = FAR_BELOW,
    gravity: float = 0.0,
) -> Scene:
    """Two cubes of 0.1 kg, 6 cm apart along x, by default in free space.

    Args:
        first: fields of the first Body that override the defaults.
        second: fields of the second Body that override the defaults.
        material: of the cubes and the ground; friction 0.5 and restitution 0.5 if None.
        ground: m, height of the ground.
        gravity: m/s^2.
    """
    material = material or Material(0.5, 0.5)
    bodies = [
        Body(
            CUBE,
            **{"mass": 0.1, "position": (x, 0.0, 0.02), "material": material, **(fields or {})},
        )
        for x, fields in ((-0.03, first), (0.03, second))
    ]
    return Scene(bodies, [Ground(material, ground)], gravity=(0.0, 0.0, -gravity))


def tower(cubes: int, jitter: float = 2e-4, seed: int = 0) -> Scene:
    """A tower of equal cubes of 64 g, with random offsets along x and y of at most `jitter` m."""
    offsets = np.random.default_rng(seed).uniform(-jitter, jitter, (cubes, 2))
    half = CUBE.half_extents[2]
    material = Material(0.5, 0.0)
    bodies = [
        Body(CUBE, mass=0.064, position=(x, y, (2 * i + 1) * half), material=material)
        for i, (x, y) in enumerate(offsets)
    ]
    return Scene(bodies, [Ground(material)])


def pyramid(rows: int) -> Scene:
    """A wall of 64 g cubes, each above the gap of 2 mm between two cubes of the row below."""
    width, material = 2.0 * CUBE.half_extents[2], Material(0.5, 0.0)
    bodies = [
        Body(
            CUBE,
            mass=0.064,
            position=((i - (rows - row - 1) / 2) * 1.05 * width, 0.0, (row + 0.5) * width),
            material=material,
        )
        for row in range(rows)
        for i in range(rows - row)
    ]
    return Scene(bodies, [Ground(material)])


def heavy_top(ratio: float) -> Scene:
    """Two stacked cubes: the lower one of 64 g, the upper one `ratio` times as heavy."""
    material = Material(0.5, 0.0)
    bodies = [
        Body(CUBE, mass=mass, position=(offset, 0.5 * offset, height), material=material)
        for mass, offset, height in ((0.064, 0.0, 0.02), (0.064 * ratio, 2e-4, 0.06))
    ]
    return Scene(bodies, [Ground(material)])


def small_top(ratio: float) -> Scene:
    """Two stacked cubes of equal density: the lower one is `ratio` times as wide."""
    material, half = Material(0.5, 0.0), CUBE.half_extents[0]
    bodies = [
        Body(Box((size,) * 3), density=1000.0, position=(0, 0, height), material=material)
        for size, height in ((half, half), (half / ratio, 2.0 * half + half / ratio))
    ]
    return Scene(bodies, [Ground(material)])


def dominoes(count: int, gap: float = 0.03) -> Scene:
    """A row of dominoes of 8 by 24 by 50 mm, of which the first one topples.

    Their centres are `gap` m apart.
    """
    half = (0.004, 0.012, 0.025)
    stone, ground = Material(0.3, 0.0), Material(0.6, 0.0)
    first: dict[str, Any] = {
        "angular_velocity": (0.0, 3.0, 0.0),
        "linear_velocity": (3.0 * half[2], 0.0, 0.0),
    }
    bodies = [
        Body(
            Box(half),
            mass=0.02,
            position=(gap * i, 0.0, half[2]),
            material=stone,
            **(first if i == 0 else {}),
        )
        for i in range(count)
    ]
    return Scene(bodies, [Ground(ground)])


def leaning_cards(angle: float) -> Scene:
    """Two cards of 2 by 60 by 90 mm that lean against each other, `angle` rad from vertical."""
    thick, half = 0.001, (0.001, 0.03, 0.045)
    material = Material(0.6, 0.0)
    height = half[2] * math.cos(angle) + thick * math.sin(angle)
    offset = half[2] * math.sin(angle) + thick * math.cos(angle)
    bodies = [
        Body(
            Box(half),
            mass=0.002,
            position=(side * (offset + 1e-6), 0.0, height),
            orientation=(0.0, -side * math.sin(angle / 2), 0.0, math.cos(angle / 2)),
            material=material,
        )
        for side in (-1.0, 1.0)
    ]
    return Scene(bodies, [Ground(material)])


def torque_free_box(
    angular_velocity: Vector = (3.0, 0.0, 5.0),
    half_extents: tuple[float, float, float] = (0.03, 0.02, 0.01),
) -> Scene:
    """A box that rotates in free space.

    The angular velocity is in rad/s, half extents are in m. With the default half extents the
    moments of inertia increase from x to z.
    """
    body = Body(Box(half_extents), mass=0.1, angular_velocity=angular_velocity)
    return Scene([body], [Ground(height=FAR_BELOW)], gravity=(0.0, 0.0, 0.0))


def settled(
    scene: Scene, fidelity: str | Fidelity = "balanced", count: int = 1, time: float = 1.0
) -> World:
    """Worlds of a scene after `time` s; by default long enough for bodies to come to rest."""
    world = World(scene, fidelity, count)
    world.advance(time)
    return world
