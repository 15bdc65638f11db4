"""Random scenes: each must be refused with a reason that names a field, or stay finite.

The scenes have 1 to 6 bodies of random shapes with masses of 1e-6 to 1e6 kg, sizes of 1e-4 to
1e2 m, speeds up to 1e4 m/s and rad/s, gravity up to 1e3 m/s^2, any friction, restitution and
stiffness, at any pose, with drives, joints and fields, and any settings of Fidelity. They belong to
families, each with kernels of its own. A scene that runs does so for 50 substeps; a divergence must
come as SimulationDiverged with a reason. Where particles overlap so deeply that there is no room
for their contacts, a step refuses the scene by ContactOverflow. Constructors are then called with
garbage. What is not as it must be is a finding, and saved as a script in .failures/; so are
divergences.

python -m benchmarks.fuzz [--scenes 1e5] [--families "one box" ...] [--resume CSV] [--write]
"""

import argparse
import math
from collections import Counter
from pathlib import Path
from time import perf_counter

from benchmarks.fuzz.arguments import findings
from benchmarks.fuzz.families import FAMILIES, Family
from benchmarks.fuzz.outcomes import DIVERGED, FINDING, RAN, REFUSED, Outcome, outcome_of, save
from benchmarks.report.csv_file import append_rows, read_rows
from benchmarks.report.provenance import ROOT, describe, provenance
from benchmarks.report.results_file import save as save_tables
from benchmarks.report.tables import Cell, Table, plain

KINDS = (REFUSED, RAN, DIVERGED, FINDING)
SAVED = 5  # scenes of each family and kind that are saved
CHUNK = 500  # scenes; a line of the CSV each
HEADER = ["family", "first scene", *KINDS, "kernels", "s"]
Counts = dict[tuple[str, int], list[float]]


def run_family(family: Family, first: int, count: int) -> list[float]:
    """Runs scenes first ... first + count - 1; returns the numbers of HEADER after these."""
    kinds: Counter[str] = Counter()
    kernels, start = set(), perf_counter()
    for number in range(first, first + count):
        outcome: Outcome = outcome_of(family, number)
        kinds[outcome.kind] += 1
        if outcome.features:
            kernels.add(outcome.features)
        if outcome.kind in (DIVERGED, FINDING) and kinds[outcome.kind] <= SAVED:
            path = save(ROOT / ".failures", family, number, outcome)
            print(f"{family.name} {number}: {outcome.kind}: {outcome.reason[:200]} ({path.name})")
    return [*(float(kinds[kind]) for kind in KINDS), float(len(kernels)), perf_counter() - start]


def run(families: list[Family], scenes: float, path: Path | None) -> Counts:
    """Runs the scenes that a resumed file doesn't hold."""
    results: Counts = {}
    for row in read_rows(path, HEADER) if path else ():
        results[row[0], int(row[1])] = list(map(float, row[2:]))
    each = scenes / sum(family.share for family in families)
    counts = {family.name: max(1, math.ceil(each * family.share)) for family in families}
    chunks = [
        (family, first, min(CHUNK, counts[family.name] - first))
        for first in range(0, max(counts.values()), CHUNK)
        for family in families
        if first < counts[family.name]
    ]
    held = {key: int(sum(row[: len(KINDS)])) for key, row in results.items()}
    left = [
        (family, first, count)
        for family, first, count in chunks
        if held.get((family.name, first), 0) < count
    ]
    start = perf_counter()
    for done, (family, first, count) in enumerate(left):
        ran = held.get((family.name, first), 0)
        found = run_family(family, first + ran, count - ran)
        if ran:
            found = _joined(results[family.name, first], found)
        results[family.name, first] = found
        if path:
            append_rows(path, HEADER, [[family.name, first, *found]])
        spent = perf_counter() - start
        counted = ", ".join(f"{n:.0f} {kind}" for n, kind in zip(found, KINDS, strict=False))
        print(
            f"{family.name}: {counted} in {found[-1]:.0f} s; "
            f"{spent / (done + 1) * (len(left) - done - 1) / 60:.0f} min left",
            flush=True,
        )
    return results


def _joined(chunk: list[float], more: list[float]) -> list[float]:
    """The numbers of a chunk and of its further scenes, which may need the same kernels."""
    joined = [a + b for a, b in zip(chunk, more, strict=True)]
    joined[len(KINDS)] = max(chunk[len(KINDS)], more[len(KINDS)])
    return joined


def table(results: Counts) -> Table:
    """One row per family, and the total."""
    rows: list[list[Cell]] = []
    for name in dict.fromkeys(family for family, _ in results):
        own = [row for (family, _), row in results.items() if family == name]
        kernels = max(row[len(KINDS)] for row in own)
        total = [sum(column) for column in zip(*own, strict=True)]
        rows.append([name, *total[: len(KINDS)], kernels, total[-1]])
    sums = [sum(float(row[i] or 0.0) for row in rows) for i in range(1, len(HEADER) - 1)]
    rows.append(["all", *sums])
    return Table("fuzz", f"Scenes of {len(rows) - 1} families", ["family", *HEADER[2:]], rows)


def main() -> None:
    """Runs scenes of all families, then constructors; prints the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.fuzz", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    names = [family.name for family in FAMILIES]
    parser.add_argument("--scenes", type=float, default=1e4, help="of all families together")
    parser.add_argument("--families", nargs="+", choices=names, default=names, metavar="FAMILY")
    parser.add_argument("--resume", type=Path, metavar="CSV", help="chunks are appended to it")
    parser.add_argument("--write", action="store_true", help="keep the table for the docs")
    options = parser.parse_args()
    this_run = provenance()
    print(describe(this_run))
    chosen = [family for family in FAMILIES if family.name in options.families]
    outcomes = table(run(chosen, options.scenes, options.resume))
    print(plain(outcomes))
    calls, wrong = findings()
    print(f"\n{calls} constructors with garbage: {len(wrong)} findings")
    print("\n".join(wrong))
    if options.write:
        save_tables([outcomes], this_run, keep=True)


if __name__ == "__main__":
    main()
