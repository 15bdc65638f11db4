"""Scenes of many bodies for tests."""

import numpy as np

from physics import Body, Box, Ground, Material, Scene, Static

# cubes of 4 cm fall onto the ground between four walls; enough that they are found by a grid
HALF = 0.02


def heap(count: int, seed: int = 0, friction: float = 0.5) -> Scene:
    """Cubes at random orientations on a lattice above the ground."""
    random = np.random.default_rng(seed)
    side = max(2, round((2 * count) ** (1 / 3)))
    apart = 3.6 * HALF
    material = Material(friction=friction)
    bodies = []
    for k in range(count):
        place = np.array([k % side, k // side % side, k // side**2 + 0.7]) - [side / 2, side / 2, 0]
        bodies.append(
            Body(
                Box((HALF, HALF, HALF)),
                density=500.0,
                position=tuple(apart * place + random.uniform(-0.1, 0.1, 3) * HALF),
                orientation=tuple(random.normal(size=4)),
                material=material,
            )
        )
    half = side * apart / 2 + 2 * HALF
    far = half + 0.05
    walls = [
        Static(Box((half, 0.05, 1.0)), position=(0.0, y, 1.0), material=material)
        for y in (-far, far)
    ] + [
        Static(Box((0.05, half, 1.0)), position=(x, 0.0, 1.0), material=material)
        for x in (-far, far)
    ]
    return Scene(bodies, [Ground(material), *walls])


def wall(columns: int, rows: int) -> Scene:
    """Cubes of 4 cm in columns beside each other."""
    material = Material(friction=0.6)
    cube = Box((HALF, HALF, HALF))
    bodies = [
        Body(cube, density=500.0, position=(2.1 * HALF * x, 0.0, HALF * (2 * z + 1)),
             material=material)
        for z in range(rows) for x in range(columns)
    ]  # fmt: skip
    return Scene(bodies, [Ground(material)])
