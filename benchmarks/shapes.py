"""What round shapes and surface drag cost: python -m benchmarks.shapes.

ns per substep and world, one thread, 1,024 worlds. Bodies are as tall as the cube of the first row,
which their ratio refers to. Scenes take turns; figures are the fastest round, as other load on the
machine can only add time.
"""

import argparse
import math

import numpy as np

from benchmarks.measure.features import ROUNDS, SECONDS, WORLDS, frame_side
from benchmarks.report.provenance import describe, provenance
from benchmarks.report.tables import Cell, Table, plain
from benchmarks.report.timing import take_turns
from physics import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Drag,
    Ground,
    Particles,
    Scene,
    SurfaceDrag,
    Torus,
    World,
)
from physics.scene.fields import Field
from physics.scene.shapes import Shape

LYING = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # axis along y
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
HALF = 0.02  # m, height of the centre


def _lattice(count: int) -> Particles:
    """A cube of count^3 balls."""
    axis = (2.0 * np.arange(count) + 1.0 - count) * HALF / count
    grid = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    return Particles(tuple(map(tuple, grid.tolist())), HALF / count)


SHAPES: dict[str, tuple[Shape, tuple[float, ...]]] = {
    "Box": (Box((HALF, HALF, HALF)), UPRIGHT),
    "Capsule, lying": (Capsule(HALF, HALF), LYING),
    "Cylinder, standing": (Cylinder(HALF, HALF), UPRIGHT),
    "Cylinder, lying": (Cylinder(HALF, HALF), LYING),
    "Torus, flat": (Torus(2.0 * HALF, HALF), UPRIGHT),
    "Particles, 8": (_lattice(2), UPRIGHT),
    "Particles, 64": (_lattice(4), UPRIGHT),
}
FIELDS: dict[str, list[Field]] = {
    "none": [],
    "Drag": [Drag(quadratic=0.01)],
    "SurfaceDrag, 50 points": [SurfaceDrag(1.2, 1.0, points=50)],
    "SurfaceDrag, 200 points": [SurfaceDrag(1.2, 1.0)],
}


def _pile(shape: Shape, turn: tuple[float, ...], count: int) -> Scene:
    """Bodies on each other on the ground."""
    bodies = [
        Body(shape, mass=0.1, position=(0, 0, (2 * i + 1) * HALF), orientation=turn)
        for i in range(count)
    ]
    return Scene(bodies, [Ground()])


def _falling(fields: list[Field]) -> Scene:
    return Scene([Body(Box((HALF, HALF, HALF)), mass=0.1)], fields=fields)


def table(title: str, scenes: dict[str, Scene], law: str) -> Table:
    """One row per scene; the first one is the reference."""
    sides = {}
    for name, scene in scenes.items():
        world = World(scene, law, count=WORLDS, threads=1)
        world.advance(0.24)
        sides[name] = frame_side(world)
    cost = {name: 1e9 / max(found) for name, found in take_turns(sides, ROUNDS, SECONDS).items()}
    first = next(iter(cost.values()))
    rows: list[list[Cell]] = [[name, value, value / first] for name, value in cost.items()]
    return Table("shapes", f"{title}, {law}", ["body", "ns per substep", "ratio"], rows)


def run() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.shapes", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.parse_args()
    print(describe(provenance()))
    for law in ("balanced", "solid"):
        for count, title in ((1, "One on the ground"), (2, "Two on each other")):
            scenes = {
                name: _pile(shape, turn, count)
                for name, (shape, turn) in SHAPES.items()
                if count == 1 or turn == UPRIGHT
            }
            print("\n" + plain(table(title, scenes, law)), flush=True)
    fields = {name: _falling(found) for name, found in FIELDS.items()}
    print("\n" + plain(table("A box that falls, with a field", fields, "balanced")), flush=True)


if __name__ == "__main__":
    run()
