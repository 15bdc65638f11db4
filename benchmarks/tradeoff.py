"""What a Fidelity buys and costs: errors and simulated seconds a second, MuJoCo in the same run.

Errors are relative, of scenes with closed forms (physics/reference/measures.py); towers of 4 cm
cubes tell how far they drift and sink in 10 s, or that they fall. Speed is that of towers on one
thread: 64 worlds at once, and one alone; MuJoCo steps one. MuJoCo has no restitution and so no
oblique rebound; its cones are elliptic unless a row says pyramidal.
"""

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from physics.reference.scenes import CUBE, tower
from physics.scene.validation import positive

TOWERS = (5, 10)
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


def _ours(fidelity: Fidelity, scene: Scene) -> World:
    return World(scene, fidelity, threads=1)


def _peer(step: float, cone: str, scene: Scene) -> MujocoWorld:
    return MujocoWorld(scene, step, cone=cone)


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


def of_settings(
    settings: Mapping[str, Fidelity],
    peers: Mapping[str, tuple[float, str]] = PEERS,
    towers: Sequence[int] = TOWERS,
    time: float = TIME,
) -> Iterator[Table]:
    """Errors and speed of each setting, and of MuJoCo at steps in s with kinds of cones.

    Towers of so many cubes stand for `time` s, or fall.
    """
    sides: dict[str, tuple[Make, Fidelity | None, Callable[[Scene], Any]]] = {}
    for name, fidelity in settings.items():
        batch = partial(World, fidelity=fidelity, count=MANY, threads=1)
        sides[name] = (partial(_ours, fidelity), fidelity, batch)
    for name, (step, cone) in peers.items():
        theirs = partial(_peer, step, cone)
        sides[name] = (theirs, None, theirs)
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
            alone = _rate(make(tower(cubes)), 1)
            together = alone if ours is None else _rate(many(tower(cubes)), MANY)
            rows.append([name, 1e3 * standing.drift, 1e3 * standing.sink, together, alone])
        columns = ["setting", f"drift in {time:g} s, mm", "sink of the topmost, mm"]
        columns += [f"simulated s/s, {MANY} worlds", "one world"]
        # the first that stands, at the step of most presets
        stands = [row for row in rows if str(row[0]).startswith(PEER) and row[3] is not None]
        if stands:
            columns.append(f"ratio to {stands[0][0]}")
            measured = stands[0][3]
            for row in rows:
                row.append(_ratio(row[3], measured))
        yield Table(f"tower {cubes}", f"{cubes} stacked cubes, one core", columns, rows)


def _ratio(mine: Cell, theirs: Cell) -> Cell:
    return mine / theirs if isinstance(mine, float) and isinstance(theirs, float) else None


def measure() -> Iterator[Table]:
    """All tables of this module."""
    yield from of_settings(SETTINGS)


def setting(words: str) -> tuple[str, Fidelity]:
    """A name of SETTINGS, or fields of a Fidelity: substep=1e-3,contact_resolution=0.3."""
    if words in SETTINGS:
        return words, SETTINGS[words]
    fields: dict[str, Any] = {}
    for field in words.split(","):
        name, _, value = field.partition("=")
        if not value:
            raise argparse.ArgumentTypeError(
                f"{words!r} is neither one of {', '.join(map(repr, SETTINGS))} nor fields of a "
                "Fidelity, as substep=1e-3,contact_resolution=0.3"
            )
        try:
            fields[name.strip()] = int(value) if value.strip().isdigit() else float(value)
        except ValueError:
            fields[name.strip()] = value.strip()
    try:
        return words, Fidelity(**fields)
    except (TypeError, ValueError) as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _cubes(word: str) -> int:
    if not word.isdigit() or int(word) < 1:
        raise argparse.ArgumentTypeError(f"a tower has at least one cube, got {word!r}")
    return int(word)


def _time(word: str) -> float:
    try:
        return positive("--time", float(word))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def run() -> None:
    """Measures the settings named, or all."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tradeoff", description=__doc__)
    parser.add_argument(
        "settings", nargs="*", type=setting,
        help=f"{', '.join(map(repr, SETTINGS))}; or fields of a Fidelity, as substep=1e-3,skin=0.2",
    )  # fmt: skip
    parser.add_argument(
        "--towers", nargs="*", type=_cubes, default=TOWERS, metavar="CUBES",
        help="how many cubes to stack; after the settings",
    )  # fmt: skip
    parser.add_argument("--time", type=_time, default=TIME, help="s that towers are to stand")
    words = parser.parse_args()
    chosen = dict(words.settings) or SETTINGS
    main(__doc__, lambda: of_settings(chosen, towers=words.towers, time=words.time))


if __name__ == "__main__":
    run()
