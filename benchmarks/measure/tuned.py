"""What a tuned number of the engine decides, measured for one set of values.

Prints the columns of `python -m benchmarks.sweep`, one JSON object. Run it with the packages of the
source tree that is to be measured.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from physics import PRESETS, Box, World
from physics.reference.measures import energy_gain, grazing, rebounds, slide, stand
from physics.reference.scenes import landing_cube

SPEEDS = np.repeat([0.3, 1.0, 1.5, 3.0], 8)  # m/s
ROD, PLATE = Box((0.005, 0.005, 0.02)), Box((0.02, 0.02, 0.004))


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


def bounce(preset: str) -> float:
    """Largest error of restitution of a ball, over all phases of the step."""
    ratios = [np.abs(rebounds(e, PRESETS[preset]) - e).max() for e in (0.25, 0.5, 0.75)]
    return float(max(ratios))


COLUMNS: dict[str, Callable[[], float]] = {
    "ball, balanced": partial(bounce, "balanced"),
    "face": partial(landing, "face", "balanced"),
    "edge": partial(landing, "edge", "balanced"),
    "corner": partial(landing, "corner", "balanced"),
    "rod gains": partial(gain, ROD, "balanced"),
    "plate gains": partial(gain, PLATE, "balanced"),
    "slide": partial(slide, (0.02, 0.02, 0.02), 0.5, partial(World, fidelity="balanced")),
    "3 at fast, m": partial(drift, 3, "fast"),
    "5 at balanced, m": partial(drift, 5, "balanced"),
    "ball, solid": partial(bounce, "solid"),
    "corner, solid": partial(landing, "corner", "solid"),
    "10 at solid, m": partial(drift, 10, "solid"),
}

if __name__ == "__main__":
    print(json.dumps({name: measure() for name, measure in COLUMNS.items()}))
