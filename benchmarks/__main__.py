"""Runs all benchmarks, or those named: python -m benchmarks [--save] [name ...].

python -m benchmarks trade [trial ...] measures the trade of speed for accuracy, which takes
hours.
"""

import argparse
import sys
from importlib import import_module
from pathlib import Path
from time import perf_counter

from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import RESULTS, save
from benchmarks.report.tables import plain

# in this order; each is imported when it runs, as some need MuJoCo
NAMES = (
    "speed", "worlds", "presets", "startup", "waiting", "kernels", "memory", "rendering", "pixels",
    "accuracy", "truths", "classics", "consistency", "features", "flags", "time_control",
)  # fmt: skip
WITH_PANDA = ("speed", "worlds", "pixels")  # of these, those that also measure panda-gym


def run() -> None:
    """Prints the tables; --save writes them to benchmarks/results.json as well."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=", ".join(NAMES))
    parser.add_argument(
        "--save", action="store_true",
        help=f"write {RESULTS.name}: with names, the other tables in it are kept",
    )  # fmt: skip
    parser.add_argument(
        "--panda", type=Path, metavar="PYTHON",
        help="interpreter with panda-gym, see benchmarks/peers/README.md",
    )  # fmt: skip
    options = parser.parse_args()
    if unknown := [name for name in options.names if name not in NAMES]:
        parser.error(f"unknown benchmark: {', '.join(unknown)}; known: {', '.join(NAMES)}")
    this_run, tables = provenance(), []
    print(describe(this_run))
    for name in options.names or NAMES:
        start, module = perf_counter(), import_module(f"benchmarks.measure.{name}")
        print(f"\n# {name}\n\n{module.__doc__}")
        for table in module.measure(*([options.panda] if name in WITH_PANDA else [])):
            print(plain(table) + "\n", flush=True)
            tables.append(table)
        print(f"({perf_counter() - start:.0f} s)", flush=True)
    if options.save:
        save(tables, this_run, keep=bool(options.names))
        print(f"written: {RESULTS.parent.name}/{RESULTS.name}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["trade"]:
        import_module("benchmarks.trade.measure").main(sys.argv[2:])
    else:
        run()
