"""Push by preset: speed, the fraction of time that the engine takes, and the stability margin."""

import statistics
from collections.abc import Iterator
from time import perf_counter

import numpy as np

from benchmarks.measure.episodes import WORLDS, recorded_episode, vector_side
from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import clocked, rate
from physics import PRESETS, World
from rigid_envs.tasks import Push

SECONDS, ROUNDS = 2.0, 3
CHECKED = 64  # worlds whose stable step and contacts are read


def measure() -> Iterator[Table]:
    """One table."""
    rows: list[list[Cell]] = []
    for preset, fidelity in PRESETS.items():
        side = vector_side("push", preset)
        side()
        smallest, contacts = np.inf, 0
        world = recorded_episode("push", CHECKED, preset)[0]
        for w in range(CHECKED):
            smallest = min(smallest, world.largest_stable_step(w))
            contacts += len(world.contacts(w).penetration)
        start = perf_counter()
        with clocked(World, "advance") as spent:
            rates = [rate(side, SECONDS) for _ in range(ROUNDS)]
        engine = sum(spent) / (perf_counter() - start)
        median, substeps = statistics.median(rates), round(Push.frame / fidelity.substep)
        numbers = [substeps, median, median * substeps, engine, 1.0 - engine]
        rows.append([preset, *numbers, fidelity.substep / smallest, contacts / CHECKED])
    columns = ["preset", "substeps", "env steps/s", "substeps/s", "time in engine", "time in task"]
    columns += ["substep / largest stable", "contacts per world"]
    yield Table("presets", f"Push by preset, {WORLDS:,} worlds", columns, rows)
