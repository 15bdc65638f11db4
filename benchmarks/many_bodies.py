"""Many bodies in one world: python -m benchmarks.many_bodies [--threads N] [--pybullet PYTHON].

Heaps of cubes that have settled, the time to build scenes, and a pyramid of cubes with MuJoCo and
PyBullet on the same scene, one after the other on one core.
"""

import argparse
import contextlib
import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks.peers.pyramids import mujoco_rate
from benchmarks.report.provenance import describe, provenance
from benchmarks.report.tables import Cell, Table, plain
from physics import PRESETS, World
from physics.reference.many_bodies import heap, pyramid

SETTLE, WINDOW, REPEATS = 1.5, 0.2, 5  # s, s
HEAPS = (10, 100, 1000, 10_000)
PYRAMIDS = (55, 465, 5050)
PEERS = Path(__file__).parent / "peers" / "pyramids.py"


def heaps(threads: int) -> Table:
    """Time per body, substep and contact in heaps that have settled."""
    rows: list[list[Cell]] = []
    for count in HEAPS:
        scene, fidelity = heap(count).scene, PRESETS["balanced"]
        start = perf_counter()
        world = World(scene, fidelity, threads=threads)
        built = perf_counter() - start
        world.advance(SETTLE)
        contacts = len(world.contacts().force)
        best = min(_seconds(world, WINDOW) for _ in range(REPEATS))
        substeps = round(WINDOW / fidelity.substep)
        each = best / substeps / count
        rows.append([
            count, 1e6 * each, 1e9 * best / substeps / contacts, contacts / count,
            1e3 * world.penetration()[0], built, world.nbytes / count / 1e3,
        ])  # fmt: skip
    columns = [
        "cubes", "us per body and substep", "ns per contact and substep", "contacts per body",
        "deepest penetration mm", "build s", "kB per body",
    ]  # fmt: skip
    title = (
        f"heaps of cubes of 4 cm, balanced, {threads} thread(s): {WINDOW:g} s after {SETTLE:g} s "
        f"of falling, the fastest of {REPEATS}"
    )
    return Table("heaps", title, columns, rows)


def _seconds(world: World, time: float) -> float:
    start = perf_counter()
    world.advance(time)
    return perf_counter() - start


def pyramids(threads: int, pybullet: Path | None) -> Table:
    """Body-substeps per second of pyramids."""
    rows: list[list[Cell]] = []
    for count in PYRAMIDS:
        scene, fidelity = pyramid(count)
        start = perf_counter()
        world = World(scene, fidelity, threads=threads)
        built = perf_counter() - start
        world.advance(fidelity.substep)
        steps = 60
        seconds = _seconds(world, steps * fidelity.substep)
        peer: float | None = None
        if pybullet is not None:
            ran = subprocess.run(
                [str(pybullet), str(PEERS), str(count)], capture_output=True, text=True, check=True
            )
            peer = json.loads(ran.stdout.splitlines()[-1])
        mujoco = mujoco_rate(count) if count < 1000 else None
        rows.append([count, 1e-6 * steps * count / seconds, mujoco, peer, built])
    columns = ["cubes", "this engine", "MuJoCo", "PyBullet", "build s"]
    title = (
        f"pyramids of cubes of 1 m, million body-substeps per second over the first 0.25 s, "
        f"{threads} thread(s); peers on one core"
    )
    return Table("pyramids", title, columns, rows)


def standing(count: int, threads: int) -> Table:
    """Whether a pyramid stands: sink and motion."""
    scene, fidelity = pyramid(count)
    world = World(scene, fidelity, threads=threads)
    start = world.position[0].copy()
    rows: list[list[Cell]] = []
    before = start
    for _ in range(5):
        world.advance(2.0)
        now = world.position[0].copy()
        moved = np.sqrt(((now - before) ** 2).sum(axis=1)).max()
        aside = np.abs(now - start)[:, :2].max()
        rows.append([float(world.time[0]), start[-1, 2] - now[-1, 2], moved, aside])
        before = now
    columns = ["s", "sink of the top m", "largest motion in 2 s m", "largest shift aside m"]
    return Table("standing", f"a pyramid of {len(scene.bodies)} cubes", columns, rows)


def tables(threads: int, pybullet: Path | None) -> Iterator[Table]:
    yield heaps(threads)
    yield pyramids(threads, pybullet)
    for count in (36, 820):
        yield standing(count, threads)


def run() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument(
        "--pybullet", type=Path, metavar="PYTHON", help="an interpreter that has PyBullet"
    )
    options = parser.parse_args()
    print(describe(provenance()))
    for table in tables(options.threads, options.pybullet):
        print(plain(table), flush=True)
    with contextlib.suppress(ImportError):  # Windows has no such module
        import resource

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"peak memory of this process {peak:.0f} MB")


if __name__ == "__main__":
    run()
