"""What each setting of a Fidelity costs and how large its errors are, with MuJoCo in the same run.

Errors against closed forms are relative (physics/reference/measures.py). Towers of 4 cm cubes show
how far they drift and sink in 10 s, or that they fall. Speed is that of towers on one thread: 64
worlds at once, and one world; MuJoCo advances one world. MuJoCo has no coefficient of restitution,
so no oblique rebound either. Its friction cones are elliptic unless a row says pyramidal.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.peers.mujoco_scene import MujocoWorld
from benchmarks.report.tables import Cell, Table
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
from physics.reference.scenes import CUBE, tower

TOWERS = (5, 10)  # cubes
TIME = 10.0  # s
MANY = 64
PEER = "MuJoCo 2 ms"
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
PEERS = {
    "MuJoCo 4 ms": (4e-3, "elliptic"),
    "MuJoCo 2 ms": (2e-3, "elliptic"),
    "MuJoCo 2 ms, pyramidal": (2e-3, "pyramidal"),
    "MuJoCo 1 ms": (1e-3, "elliptic"),
}


def of_settings(
    settings: Mapping[str, Fidelity],
    peers: Mapping[str, tuple[float, str]] = PEERS,
    towers: Sequence[int] = TOWERS,
    time: float = TIME,
) -> Iterator[Table]:
    """Errors and speed of each setting and of MuJoCo.

    Args:
        settings: fidelities by name.
        peers: MuJoCo's step in s and kind of friction cone, by name.
        towers: numbers of cubes.
        time: s that the towers are observed.
    """
    sides: dict[str, tuple[Make, Fidelity | None, Callable[[Scene], Any]]] = {}
    for name, fidelity in settings.items():
        batch = partial(World, fidelity=fidelity, count=MANY, threads=1)
        sides[name] = (partial(_ours, fidelity), fidelity, batch)
    for name, (step, cone) in peers.items():
        peer = partial(_peer, step, cone)
        sides[name] = (peer, None, peer)
    rows: list[list[Cell]] = [[name, *_errors(s[0], s[1])] for name, s in sides.items()]
    columns = ["setting", "slide from 0.5 m/s", "slope of 28°", "roll", "restitution"]
    columns += ["oblique, slides", "oblique, sticks"]
    yield Table("tradeoff", "Error against closed forms", columns, rows)

    for cubes in towers:
        rows = []
        for name, (make, ours, many) in sides.items():
            standing = stand(cubes, time, make)
            if standing.sink > CUBE.half_extents[2]:
                rows.append([name, "fell", None, None, None])
                continue
            single = _rate(make(tower(cubes)), 1)
            together = single if ours is None else _rate(many(tower(cubes)), MANY)
            rows.append([name, 1e3 * standing.drift, 1e3 * standing.sink, together, single])
        columns = ["setting", f"drift in {time:g} s, mm", "sink of the top cube, mm"]
        columns += [f"simulated s/s, {MANY} worlds", "one world"]
        # the first MuJoCo setting that stands, at the step of most presets
        stands = [row for row in rows if str(row[0]).startswith(PEER) and row[3] is not None]
        if stands:
            columns.append(f"ratio to {stands[0][0]}")
            reference = stands[0][3]
            for row in rows:
                row.append(_ratio(row[3], reference))
        yield Table(f"tower {cubes}", f"{cubes} stacked cubes, one core", columns, rows)


def measure() -> Iterator[Table]:
    """One table of errors, and one per tower."""
    yield from of_settings(SETTINGS)


def _ours(fidelity: Fidelity, scene: Scene) -> World:
    return World(scene, fidelity, threads=1)


def _peer(step: float, cone: str, scene: Scene) -> MujocoWorld:
    return MujocoWorld(scene, step, cone=cone)


def _errors(make: Make, fidelity: Fidelity | None) -> list[Cell]:
    """Slide, slope and roll; for our settings restitution and oblique impacts too."""
    found: list[Cell] = [
        slide(BLOCK, 0.5, make),
        acceleration(28.0, 2, make),
        roll(make),
    ]
    if fidelity is None:
        return [*found, None, None, None]
    largest = max(float(np.abs(rebounds(e, fidelity) - e).max()) for e in (0.25, 0.5, 0.75))
    return [*found, largest, oblique(0.1, 2.0, make), oblique(0.5, 0.5, make)]


def _rate(world: Any, worlds: int) -> float:
    """Simulated seconds per second of a world at rest; the fastest of three."""
    world.advance(1.0)
    fastest = 0.0
    for _ in range(3):
        start = perf_counter()
        world.advance(1.0)
        fastest = max(fastest, worlds / (perf_counter() - start))
    return fastest


def _ratio(own: Cell, peer: Cell) -> Cell:
    return own / peer if isinstance(own, float) and isinstance(peer, float) else None
