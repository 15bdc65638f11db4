"""Scenes of SimBenchmark, at the steps of its published results: python -m benchmarks.simbench.

The scenes are those of github.com/leggedrobotics/SimBenchmark (2018): balls of 10 kg dropped with
e = 1 (bouncing); 6 x 6 x 6 balls of 10 kg that fall in a heap without friction, inelastic (666) and
elastic (elastic 666); 25 balls on a box that a force pushes diagonally (rolling). Errors are its
own: mean square of the energy's error in J², mean over time of the sum of squared penetrations in
m², mean square of the errors of velocity of box and ball in (m/s)². Published figures are the best
of its engines (RaiSim, Bullet, ODE, MuJoCo, DART) at this step; they are of other machines, so
times are not compared. The tables are saved in benchmarks/results.json.
"""

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import save
from benchmarks.report.tables import Cell, Table, plain
from benchmarks.trade.settings import milliseconds
from physics import (
    PRESETS,
    Body,
    Box,
    Fidelity,
    Ground,
    Material,
    Scene,
    SimulationDiverged,
    Sphere,
    World,
)

Array = np.ndarray

GRAVITY = (0.0, 0.0, -9.81)
RADIUS, MASS = 0.1, 10.0  # m, kg
FORCE, ROLLING_TIME = 150.0, 4.0  # N, s
HEADING = np.array([0.5, math.sqrt(0.75), 0.0])
GROUND_FRICTION, BALL_FRICTION = 0.4, 0.8


class Bench(NamedTuple):
    """A scene of SimBenchmark.

    Attributes:
        unit: of the error.
        published: the best published error at each step in s, and whose it is.
        measure: error of a fidelity.
        settings: that are measured, by name.
    """

    unit: str
    published: dict[float, tuple[float, str]]
    measure: Callable[[Fidelity], float]
    settings: dict[str, Fidelity]


def _heap(restitution: float, height: float) -> Scene:
    """216 balls on a lattice with small random displacements."""
    random = np.random.default_rng(42)
    material = Material(0.0, restitution)
    bodies = [
        Body(
            Sphere(RADIUS), mass=MASS, material=material,
            position=tuple(0.21 * np.array([i, j, k]) + 1e-3 * random.random(3) + (0, 0, height)),
        )
        for i in range(6) for j in range(6) for k in range(6)
    ]  # fmt: skip
    return Scene(bodies, [Ground(material)], gravity=GRAVITY)


def _bouncing() -> Scene:
    material = Material(0.0, 1.0)
    bodies = [
        Body(Sphere(RADIUS), mass=MASS, position=(2.0 * i, 2.0 * j, 5.0), material=material)
        for i in range(7) for j in range(7)
    ]  # fmt: skip
    return Scene(bodies, [Ground(material)], gravity=GRAVITY)


def _rolling() -> Scene:
    """The geometric mean of the frictions is 0.4 under the box and 0.8 on it."""
    box = Material(math.sqrt(BALL_FRICTION * GROUND_FRICTION), 0.0)
    ground = Material(GROUND_FRICTION**2 / box.friction, 0.0)
    ball = Material(BALL_FRICTION**2 / box.friction, 0.0)
    bodies = [Body(Box((10.0, 10.0, 0.5)), mass=10.0, position=(0, 0, 0.5), material=box)]
    bodies += [
        Body(Sphere(0.5), mass=1.0, position=(2.0 * i - 4.0, 2.0 * j - 4.0, 1.5), material=ball)
        for i in range(5) for j in range(5)
    ]  # fmt: skip
    return Scene(bodies, [Ground(ground)], gravity=GRAVITY)


def _run(scene: Scene, fidelity: Fidelity, time: float, error: Callable[[World], float],
         before: Callable[[World], None] = lambda _: None) -> float:  # fmt: skip
    """Mean of an error over all steps."""
    world = World(scene, fidelity, allow_unstable=True)
    step, found = fidelity.substep, []
    for _ in range(round(time / step)):
        found.append(error(world))
        before(world)
        world.advance(step)
    return float(np.mean(found))


def _energy_error(scene: Scene, time: float) -> Callable[[Fidelity], float]:
    start = sum(MASS * 9.81 * body.position[2] for body in scene.bodies)

    def error(world: World) -> float:
        return float((world.kinetic_energy() + world.potential_energy())[0] - start) ** 2

    return lambda fidelity: _run(scene, fidelity, time, error)


def _penetration_error(fidelity: Fidelity) -> float:
    upper = np.triu_indices(216, 1)

    def error(world: World) -> float:
        place = world.position[0]
        apart = np.linalg.norm(place[:, None] - place, axis=-1)[upper]
        deep = np.maximum(2.0 * RADIUS - apart, 0.0)
        below = np.maximum(RADIUS - place[:, 2], 0.0)
        return float(np.sum(deep**2) + np.sum(below**2))

    return _run(_heap(0.0, 0.101), fidelity, 10.0, error)


def _rolling_error(fidelity: Fidelity) -> float:
    on_ground = GROUND_FRICTION * (10.0 + 25.0) * 9.81
    on_ball = (FORCE - on_ground) / 10.0 / (3.5 + 25.0 / 10.0)
    box, ball = (FORCE - on_ground - 25.0 * on_ball) / 10.0, on_ball

    def error(world: World) -> float:
        velocity, time = world.linear_velocity[0], float(world.time[0])
        wrong = [velocity[0] - box * time * HEADING, velocity[1] - ball * time * HEADING]
        return float(np.sum(np.square(wrong)))

    def push(world: World) -> None:
        world.apply_wrench(force=FORCE * HEADING, body=0)

    return _run(_rolling(), fidelity, ROLLING_TIME, error, push)


_SOLID, _SPRING = PRESETS["solid"], PRESETS["balanced"]
_SWEPT = replace(_SOLID, time_control="swept")
BENCHES: dict[str, Bench] = {
    "bouncing": Bench(
        "J²",
        {
            1e-3: (0.0186, "RaiSim"), 4e-3: (4.76, "RaiSim"), 0.01: (186.0, "RaiSim"),
            0.04: (1.27e4, "RaiSim"), 0.1: (6.08e5, "RaiSim"),
        },
        _energy_error(_bouncing(), 20.0), {"swept": _SWEPT, "solid": _SOLID, "springs": _SPRING},
    ),
    "666": Bench(
        "m²",
        {
            4e-4: (2.36e-5, "RaiSim"), 1e-3: (1.35e-4, "RaiSim"), 4e-3: (2.08e-3, "ODE"),
            0.01: (0.0153, "RaiSim"), 0.04: (0.237, "ODE"), 0.1: (0.962, "RaiSim"),
        },
        _penetration_error, {"solid": _SOLID, "swept": _SWEPT, "springs": _SPRING},
    ),
    "elastic 666": Bench(
        "J²",
        {
            4e-4: (0.249, "RaiSim"), 1e-3: (8.37, "RaiSim"), 4e-3: (264.0, "RaiSim"),
            0.01: (5.18e6, "RaiSim"), 0.04: (2.73e9, "RaiSim"), 0.05: (1.12e6, "ODE"),
        },
        _energy_error(_heap(1.0, 1.101), 10.0),
        {"swept": _SWEPT, "solid": _SOLID, "springs": _SPRING},
    ),
    "rolling": Bench(
        "(m/s)²", {1e-3: (3.85e-27, "Bullet")}, _rolling_error,
        {"solid": _SOLID, "springs": _SPRING},
    ),
}  # fmt: skip


def rows(name: str) -> list[list[Cell]]:
    """Errors of our settings at each published step."""
    bench = BENCHES[name]
    found: list[list[Cell]] = []
    for step, (best, engine) in bench.published.items():
        least, which = math.inf, ""
        for setting, fidelity in bench.settings.items():
            try:
                error = bench.measure(replace(fidelity, substep=step))
            except (ValueError, SimulationDiverged):
                continue
            if error < least:
                least, which = error, setting
        ours = f"{least:.3g}" if which else "diverged"
        found.append([milliseconds(step), f"{best:.3g}", engine, ours, which])
        print(name, *found[-1], flush=True)
    return found


def main() -> None:
    """Prints and saves a table for each scene."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.simbench", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("scenes", nargs="*", metavar="scene", help=", ".join(BENCHES))
    names = parser.parse_args().scenes or list(BENCHES)
    if unknown := [name for name in names if name not in BENCHES]:
        parser.error(f"unknown scene: {', '.join(unknown)}; known: {', '.join(BENCHES)}")
    this_run = provenance()
    print(describe(this_run))
    for name in names:
        unit = BENCHES[name].unit
        columns = ["step", f"best published, {unit}", "by", f"ours, {unit}", "with"]
        table = Table(f"simbench {name}", f"SimBenchmark, {name}", columns, rows(name))
        print(plain(table) + "\n", flush=True)
        save([table], this_run, keep=True)


if __name__ == "__main__":
    main()
