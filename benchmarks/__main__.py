"""All benchmarks in order, or those named: python -m benchmarks [--save] [name ...]."""

import argparse
import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from benchmarks import accuracy, features, memory, pictures, speed, startup, tradeoff
from benchmarks.report import Table, circumstances, describe, plain
from benchmarks.tables import RESULTS

BENCHMARKS: dict[str, Callable[[], Iterator[Table]]] = {
    "speed": speed.measure,
    "startup": startup.measure,
    "memory": memory.measure,
    "pictures": pictures.measure,
    "accuracy": accuracy.measure,
    "features": features.measure,
    "tradeoff": tradeoff.measure,
}


def run() -> None:
    """Prints the header and all tables; --save also writes them to benchmarks/results.json."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=", ".join(BENCHMARKS))
    parser.add_argument("--save", action="store_true", help=f"write {RESULTS.name}; needs all")
    parser.add_argument("--panda", type=Path, metavar="PYTHON", help="see benchmarks/peers")
    words = parser.parse_args()
    if unknown := [name for name in words.names if name not in BENCHMARKS]:
        parser.error(f"unknown: {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
    if words.save and words.names:
        parser.error("--save takes no names: the figures of one file belong to one run")
    chosen = {name: BENCHMARKS[name] for name in words.names or BENCHMARKS}
    if "speed" in chosen:
        chosen["speed"] = partial(speed.measure, words.panda)

    now, tables = circumstances(), []
    print(describe(now) + "\n")
    for measure in chosen.values():
        for table in measure():
            print(plain(table) + "\n", flush=True)
            tables.append(table._asdict())
    if words.save:
        RESULTS.write_text(
            json.dumps({**now, "tables": tables}, indent=1, ensure_ascii=False) + "\n"
        )
        print(f"written: {RESULTS.parent.name}/{RESULTS.name}")


if __name__ == "__main__":
    run()
