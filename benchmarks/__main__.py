"""Runs all benchmarks, or those named: python -m benchmarks [--save] [name ...].

python -m benchmarks trade [trial ...] measures the trade of speed for accuracy, which takes
hours.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from time import perf_counter

from benchmarks.measure import (
    accuracy,
    consistency,
    features,
    flags,
    kernels,
    memory,
    pixels,
    presets,
    rendering,
    speed,
    startup,
    time_control,
    worlds,
)
from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import RESULTS, save
from benchmarks.report.tables import Table, plain
from benchmarks.trade import measure as trade

MODULES = {
    "speed": speed,
    "worlds": worlds,
    "presets": presets,
    "startup": startup,
    "kernels": kernels,
    "memory": memory,
    "rendering": rendering,
    "pixels": pixels,
    "accuracy": accuracy,
    "consistency": consistency,
    "features": features,
    "flags": flags,
    "time_control": time_control,
}


def run() -> None:
    """Prints the tables; --save writes them to benchmarks/results.json as well."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=", ".join(MODULES))
    parser.add_argument(
        "--save", action="store_true",
        help=f"write {RESULTS.name}: with names, the other tables in it are kept",
    )  # fmt: skip
    parser.add_argument(
        "--panda", type=Path, metavar="PYTHON",
        help="interpreter with panda-gym, see benchmarks/peers/README.md",
    )  # fmt: skip
    options = parser.parse_args()
    if unknown := [name for name in options.names if name not in MODULES]:
        parser.error(f"unknown benchmark: {', '.join(unknown)}; known: {', '.join(MODULES)}")
    benchmarks: dict[str, Callable[[], Iterator[Table]]] = {
        name: module.measure for name, module in MODULES.items()
    }
    for name, module in (("speed", speed), ("worlds", worlds), ("pixels", pixels)):
        benchmarks[name] = partial(module.measure, options.panda)

    this_run, tables = provenance(), []
    print(describe(this_run))
    for name in options.names or benchmarks:
        start = perf_counter()
        print(f"\n# {name}\n\n{MODULES[name].__doc__}")
        for table in benchmarks[name]():
            print(plain(table) + "\n", flush=True)
            tables.append(table)
        print(f"({perf_counter() - start:.0f} s)", flush=True)
    if options.save:
        save(tables, this_run, keep=bool(options.names))
        print(f"written: {RESULTS.parent.name}/{RESULTS.name}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["trade"]:
        trade.main(sys.argv[2:])
    else:
        run()
