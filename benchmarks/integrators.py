"""Errors and speed of the integrators: python -m benchmarks.integrators.

A torque-free top with the moments 1, 2 and 3 kg m^2 turns for 10 s from the angular velocity
(1, 2, 2) rad/s, and a planet makes an orbit of eccentricity 0.9 around an attractor. The error is
the angle in rad, or the distance in m, from where the adaptive pair ends at a tolerance of 1e-12.
The speed is that of 1,024 such worlds on one thread, in simulated seconds per second.
"""

import argparse
import math
from collections.abc import Iterator
from time import perf_counter

import numpy as np

from benchmarks.report.provenance import describe, provenance
from benchmarks.report.tables import Cell, Table, plain
from physics import Attractor, Body, Box, Fidelity, Scene, World

TOP = Scene(
    [Body(Box((math.sqrt(2.0), 1.0, 1e-3)), mass=3.0, angular_velocity=(1.0, 2.0, 2.0))],
    gravity=(0.0, 0.0, 0.0),
)
ECCENTRICITY = 0.9
PLANET = Scene(
    [Body(
        Box((0.05, 0.03, 0.02)), mass=1.0, position=(1.0 + ECCENTRICITY, 0.0, 0.0),
        linear_velocity=(0.0, math.sqrt((1.0 - ECCENTRICITY) / (1.0 + ECCENTRICITY)), 0.0),
    )],
    gravity=(0.0, 0.0, 0.0), fields=[Attractor((0.0, 0.0, 0.0), 1.0)],
)  # fmt: skip
SCENES = {"top, 10 s": (TOP, 10.0), "orbit, 2 pi s": (PLANET, 2.0 * math.pi)}
WORLDS, REPEATS = 1024, 3


def settings() -> Iterator[Fidelity]:
    for integrator, steps in (
        ("euler", (1e-3, 1e-4)),
        ("midpoint", (1e-2, 1e-3, 1e-4)),
        ("rk4", (5e-2, 1e-2, 1e-3)),
    ):
        for step in steps:
            yield Fidelity(integrator=integrator, substep=step)
    for tolerance in (1e-4, 1e-6, 1e-8):
        yield Fidelity(integrator="adaptive", tolerance=tolerance, substep=1.0)


def _end(scene: Scene, fidelity: Fidelity, time: float) -> tuple[World, float]:
    """A world after its time, and what it took in s with 1,024 of them."""
    world, best = World(scene, fidelity, WORLDS, threads=1), math.inf
    world.advance(time)  # compiles
    for _ in range(REPEATS):
        world.reset()
        start = perf_counter()
        world.advance(time)
        best = min(best, perf_counter() - start)
    return world, best


def table(name: str) -> Table:
    scene, time = SCENES[name]
    exact = World(scene, Fidelity(integrator="adaptive", tolerance=1e-12, substep=1.0))
    exact.advance(time)
    rows: list[list[Cell]] = []
    for fidelity in settings():
        world, seconds = _end(scene, fidelity, time)
        apart = np.linalg.norm(world.position[0, 0] - exact.position[0, 0])
        p, q = world.orientation[0, 0], exact.orientation[0, 0]
        angle = 2.0 * min(np.linalg.norm(p - q), np.linalg.norm(p + q))
        adaptive = fidelity.tolerance is not None
        steps = float(world.steps[0]) if adaptive else math.ceil(time / fidelity.substep)
        set_by = f"tolerance {fidelity.tolerance:g}" if adaptive else f"{fidelity.substep:g} s"
        rows.append([
            fidelity.integrator, set_by, steps, float(max(apart, angle)), WORLDS * time / seconds,
            1e9 * seconds / (WORLDS * steps),
        ])  # fmt: skip
    columns = ["integrator", "step", "steps", "error", "s/s", "ns per step"]
    return Table("integrators", name, columns, rows)


def run() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.integrators", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.parse_args()
    print(describe(provenance()))
    for name in SCENES:
        print("\n" + plain(table(name)), flush=True)


if __name__ == "__main__":
    run()
