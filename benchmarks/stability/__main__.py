"""Maps of stability: python -m benchmarks.stability [--settings balanced ...].

For each preset, with its substep and others: a run is stable; it drifted, if a body isn't where it
belongs (10 % of its width, 5 % of a rebound); it diverged, if it isn't finite or its energy grows
by more than a tenth; it is refused, if a World doesn't accept the substep. What is refused is
simulated, too, with allow_unstable=True. Line: the substep from which on it is refused, or with
which theory expects trouble. Writes docs/trade/stability.csv and a picture for each setting, and
saves a table in benchmarks/results.json; it resumes from the CSV. With another CSV, nothing is
saved elsewhere.
"""

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.report.csv_file import append_rows, read_rows
from benchmarks.report.provenance import ROOT, describe, provenance
from benchmarks.report.results_file import save
from benchmarks.stability.maps import MAPS, Map, at
from benchmarks.stability.summary import ranges
from physics import PRESETS, Fidelity, Scene, SimulationDiverged, World

PATH = ROOT / "docs" / "trade" / "stability.csv"
SUBSTEPS = tuple(float(f"{h:.3g}") for h in np.geomspace(0.1e-3, 20e-3, 16))  # s
GROWN = 1.1
STABLE, DRIFTED, DIVERGED = "stable", "drifted", "diverged"


class Cell(NamedTuple):
    """A run.

    Attributes:
        setting: name of a preset, whose substep is replaced.
        map: name of the parameter.
        value: of the parameter.
        substep: s.
        outcome: "stable", "drifted" or "diverged".
        refused: 1 if a World doesn't accept the substep.
        limit: s, predicted largest substep; 0: none.
    """

    setting: str
    map: str
    value: float
    substep: float
    outcome: str
    refused: int
    limit: float


def outcome(scene: Scene, chosen: Map, value: float, fidelity: Fidelity) -> str:
    """How a run ends."""
    try:
        world = World(scene, fidelity, threads=1, allow_unstable=True)
        start = _energy(world)
        # whole substeps, for a time that they don't divide would shorten them
        piece = math.ceil(0.1 / fidelity.substep) * fidelity.substep
        for _ in range(math.ceil(chosen.time / piece)):
            world.advance(piece)
            if not _energy(world) < GROWN * start + 1e-3 * _scale(scene):
                return DIVERGED
    except SimulationDiverged:
        return DIVERGED
    return DRIFTED if chosen.drifted(world, value) else STABLE


def _energy(world: World) -> float:
    return float((world.kinetic_energy() + world.potential_energy())[0])


def _scale(scene: Scene) -> float:
    """J that lift every body by its width."""
    return sum(9.81 * float(body.mass or 0.0) * body.shape.width for body in scene.bodies)


def refused(scene: Scene, fidelity: Fidelity) -> bool:
    """Whether a World doesn't accept the substep."""
    try:
        World(scene, fidelity, threads=1)
    except ValueError:
        return True
    return False


def measured(setting: str, chosen: Map) -> Iterator[Cell]:
    """All runs of a map."""
    base = PRESETS[setting]
    substeps = sorted({*SUBSTEPS, base.substep})
    for value in chosen.values:
        scene = chosen.scene(value)
        no = [refused(scene, at(base, h)) for h in substeps]
        accepted = [h for h, r in zip(substeps, no, strict=True) if not r]
        limit = max(accepted, default=substeps[0]) if any(no) else 0.0
        if chosen.limit is not None:
            limit = chosen.limit(value, base)
        for h, r in zip(substeps, no, strict=True):
            found = outcome(scene, chosen, value, at(base, h))
            yield Cell(setting, chosen.name, value, h, found, int(r), limit)


def load(path: Path = PATH) -> list[Cell]:
    """The cells of a file; none if it doesn't exist."""
    return [
        Cell(setting, name, float(value), float(substep), found, int(no), float(limit))
        for setting, name, value, substep, found, no, limit in read_rows(path, Cell._fields)
    ]


def main() -> None:
    """Measures the maps that the file doesn't hold, and draws all of them."""
    from benchmarks.draw import stability

    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.stability", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--settings", nargs="+", choices=list(PRESETS), default=list(PRESETS))
    parser.add_argument("--data", type=Path, default=PATH, metavar="CSV")
    options = parser.parse_args()
    this_run = provenance()
    print(describe(this_run))
    done = {(cell.setting, cell.map) for cell in load(options.data)}
    for setting in options.settings:
        for chosen in MAPS:
            if (setting, chosen.name) in done:
                continue
            cells = list(measured(setting, chosen))
            append_rows(options.data, Cell._fields, cells)
            counts = {o: sum(c.outcome == o for c in cells) for o in (STABLE, DRIFTED, DIVERGED)}
            print(setting, chosen.name, counts, flush=True)
    for path in stability.draw_all(load(options.data), options.data.parent):
        print(f"written: {path}")
    if options.data == PATH:
        save([ranges(load())], this_run, keep=True)


if __name__ == "__main__":
    main()
