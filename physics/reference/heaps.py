"""Heaps: bodies on a jittered lattice above the floor of a box, as in Harada (2007)."""

from collections.abc import Sequence

import numpy as np

from physics.scene.material import Material
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Shape
from physics.scene.solids import Body, Ground, Static
from physics.scene.validation import integer

# of a lattice cell: how far a body may be from its middle
_JITTER = 0.1


def heap_scene(
    shapes: Sequence[Shape],
    columns: int,
    material: Material,
    density: float = 1000.0,
    seed: int = 0,
) -> Scene:
    """Bodies with random orientations on a lattice, over a ground between four walls.

    Args:
        shapes: of the bodies; bodies may share one.
        columns: of the lattice, along x and along y.
        material: of bodies, floor and walls.
        density: kg/m^3 of the bodies.
        seed: of the random numbers.

    Raises:
        TypeError, ValueError: columns below 1.
    """
    columns = integer("heap_scene columns", columns, low=1)
    draw = np.random.default_rng(seed)
    count, pitch = len(shapes), 2.2 * max(shape.reach for shape in set(shapes))
    index = np.arange(count)
    cell = np.stack([index % columns, index // columns % columns, index // columns**2], axis=-1)
    lattice = cell + 0.5 + draw.uniform(-0.5, 0.5, (count, 3)) * _JITTER / 2.2
    width = columns * pitch
    places = pitch * lattice - np.array([width, width, 0.0]) / 2.0
    turns = draw.normal(size=(count, 4))
    turns /= np.sqrt(np.sum(turns**2, axis=1, keepdims=True))
    height = float(places[:, 2].max()) + pitch
    thick = 0.5 * pitch
    statics: list[Ground | Static] = [Ground(material=material)]
    for axis in range(2):
        for sign in (-1.0, 1.0):
            half = [0.5 * width + 2.0 * thick] * 2 + [height]
            half[axis] = thick
            middle = [0.0, 0.0, 0.0]
            middle[axis] = sign * (0.5 * width + thick)
            wall = Box((half[0], half[1], half[2]))
            place = (middle[0], middle[1], height - thick)
            statics.append(Static(wall, position=place, material=material))
    bodies = [
        Body(shape, density=density, position=place, orientation=turn, material=material)
        for shape, place, turn in zip(
            shapes, map(tuple, places.tolist()), map(tuple, turns.tolist()), strict=True
        )
    ]
    return Scene(bodies=bodies, statics=statics)
