"""What a Fidelity buys and costs: errors and simulated seconds a second, MuJoCo in the same run.

Errors are relative, of scenes with closed forms (physics/reference/measures.py); towers of 4 cm
cubes tell how far they drift and sink in 10 s. Speed is that of towers on one thread: 64 worlds at
once, and one alone; MuJoCo steps one. MuJoCo has no restitution and so no oblique rebound. The
figures of any list of settings come from `of_settings`.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.mujoco_scene import MujocoWorld
from benchmarks.report import Cell, Table, main
from physics import PRESETS, Fidelity, Scene, World
from physics.reference.measures import (
    BLOCK,
    Make,
    acceleration,
    oblique,
    rebounds,
    roll,
    slide,
    stand,
)
from physics.reference.scenes import tower

TOWERS = (5, 10)
TIME = 10.0  # s
MANY = 64
SOLID = PRESETS["solid"]

SETTINGS: dict[str, Fidelity] = {
    **PRESETS,
    "spring, 1 ms": Fidelity(substep=1e-3),
    "spring, 0.5 ms": Fidelity(substep=0.5e-3),
    "spring, dashpot, 2 ms": Fidelity(damping="dashpot"),
    "spring, viscous, 2 ms": Fidelity(friction="viscous"),
    "impulse, 4 ms": replace(SOLID, substep=4e-3),
    "impulse, 1 ms": replace(SOLID, substep=1e-3),
    "impulse, 0.5 ms": replace(SOLID, substep=0.5e-3),
}
PEERS = {f"MuJoCo {1e3 * h:g} ms": h for h in (4e-3, 2e-3, 1e-3)}


def _ours(fidelity: Fidelity, scene: Scene) -> World:
    return World(scene, fidelity, threads=1)


def _peer(step: float, scene: Scene) -> MujocoWorld:
    return MujocoWorld(scene, step)


def _errors(make: Make, fidelity: Fidelity | None) -> list[Cell]:
    """Slide, slope, roll, and of ours restitution and oblique impacts."""
    found: list[Cell] = [
        slide(BLOCK, 0.5, make),
        acceleration(28.0, 2, make),
        roll(make),
    ]
    if fidelity is None:
        return [*found, None, None, None]
    worst = max(float(np.abs(rebounds(e, fidelity) - e).max()) for e in (0.25, 0.5, 0.75))
    return [*found, worst, oblique(0.1, 2.0, make), oblique(0.5, 0.5, make)]


def _rate(world: Any, worlds: int) -> float:
    """Simulated seconds a second of a world at rest; the best of three."""
    world.advance(1.0)
    best = 0.0
    for _ in range(3):
        start = perf_counter()
        world.advance(1.0)
        best = max(best, worlds / (perf_counter() - start))
    return best


def of_settings(settings: Mapping[str, Fidelity], peers: Mapping[str, float]) -> Iterator[Table]:
    """Errors and speed of each setting, and of MuJoCo at steps in s."""
    sides: dict[str, tuple[Make, Fidelity | None, Callable[[Scene], Any]]] = {}
    for name, fidelity in settings.items():
        batch = partial(World, fidelity=fidelity, count=MANY, threads=1)
        sides[name] = (partial(_ours, fidelity), fidelity, batch)
    for name, step in peers.items():
        sides[name] = (partial(_peer, step), None, partial(_peer, step))
    rows: list[list[Cell]] = [[name, *_errors(s[0], s[1])] for name, s in sides.items()]
    columns = ["setting", "slide from 0.5 m/s", "slope of 28°", "roll", "restitution"]
    columns += ["oblique, slides", "oblique, sticks"]
    yield Table("tradeoff", "Error against closed forms", columns, rows)

    for cubes in TOWERS:
        rows = []
        for name, (make, ours, many) in sides.items():
            standing = stand(cubes, TIME, make)
            alone = _rate(make(tower(cubes)), 1)
            together = alone if ours is None else _rate(many(tower(cubes)), MANY)
            rows.append([name, 1e3 * standing.drift, 1e3 * standing.sink, together, alone])
        peer = rows[-2][3]
        assert isinstance(peer, float)
        for row in rows:
            assert isinstance(row[3], float)
            row.append(row[3] / peer)
        columns = ["setting", f"drift in {TIME:g} s, mm", "sink of the topmost, mm"]
        columns += [f"simulated s/s, {MANY} worlds", "one world", "ratio to MuJoCo 2 ms"]
        yield Table(f"tower {cubes}", f"{cubes} stacked cubes, one core", columns, rows)


def measure() -> Iterator[Table]:
    """All tables of this module."""
    yield from of_settings(SETTINGS, PEERS)


if __name__ == "__main__":
    main(__doc__, measure)
