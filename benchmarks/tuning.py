"""Compares tune with an exhaustive sweep on random scenes: python -m benchmarks.tuning.

Scenes: one or two bodies, boxes or balls of 1 to 5 cm with densities of 200 to 2,000 kg/m³, up to
3 cm above the ground, at up to 1 m/s along it; friction 0.2 to 0.9, restitution 0 to 0.6, both for
all solids. 0.6 s are simulated; the tolerance is 1, 3 or 10 mm. The sweep measures every fidelity
that tune knows, against the same kind of reference. The ratio is the cost of tune's choice over
that of the cheapest one within the tolerance, both as the sweep measured them. The table is saved
in benchmarks/results.json.
"""

import argparse
import math
from time import perf_counter

import numpy as np

from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import save
from benchmarks.report.tables import Cell, Table, plain
from physics import Body, Box, Ground, Material, Scene, Sphere, tune

SCENES, TIME = 20, 0.6  # s
TOLERANCES = (1e-3, 3e-3, 1e-2)  # m


def scene_of(seed: int) -> tuple[str, Scene, float]:
    """What is in a random scene, the scene, and a tolerance in m."""
    random = np.random.default_rng(seed)
    material = Material(random.uniform(0.2, 0.9), random.uniform(0.0, 0.6))
    bodies, names = [], []
    for k in range(random.integers(1, 3)):
        size = random.uniform(0.005, 0.025)
        ball = random.random() < 0.5
        half = size * random.uniform(0.6, 1.0, 3)
        names.append("ball" if ball else "box")
        height = (size if ball else half[2]) + random.uniform(0.0, 0.03)
        turn = random.uniform(0.0, 2.0 * math.pi)
        along = random.uniform(0.0, 1.0) * np.array([math.cos(turn), math.sin(turn)])
        bodies.append(
            Body(
                Sphere(size) if ball else Box((half[0], half[1], half[2])),
                density=random.uniform(200.0, 2000.0),
                position=(0.06 * k, 0.0, height),
                linear_velocity=(along[0], along[1], 0.0),
                material=material,
            )
        )
    scene = Scene(bodies, [Ground(material)])
    return ", ".join(sorted(names)), scene, float(random.choice(TOLERANCES))


def compare(seed: int) -> list[Cell]:
    """A row of the table."""
    name, scene, tolerance = scene_of(seed)
    tune(scene, tolerance, time=TIME)  # compiles
    begin = perf_counter()
    tuned = tune(scene, tolerance, time=TIME)
    seconds = perf_counter() - begin
    if tuned.fidelity is None:
        return [str(seed), name, tolerance, "none", None, seconds, tuned.reason[:60]]
    swept = tune(scene, tolerance, time=TIME, exhaustive=True)
    cost = {e.fidelity: e.cost for e in swept.evidence if e.error <= tolerance}
    ratio = cost.get(tuned.fidelity, math.inf) / swept.cost
    return [str(seed), name, tolerance, ratio, tuned.error, seconds, ""]


def main() -> None:
    """Prints a row per scene, and saves them."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.tuning", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--scenes", type=int, default=SCENES)
    count = parser.parse_args().scenes
    this_run = provenance()
    print(describe(this_run))
    rows = []
    for seed in range(count):
        rows.append(compare(seed))
        print(*rows[-1], flush=True)
    columns = ["seed", "bodies", "tolerance, m", "cost / cheapest", "error, m", "s", "none because"]
    table = Table("tuning", f"tune on {count} random scenes", columns, rows)
    print(plain(table))
    save([table], this_run, keep=True)


if __name__ == "__main__":
    main()
