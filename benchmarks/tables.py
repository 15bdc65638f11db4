"""The saved figures as Markdown, for README and docs: python -m benchmarks.tables [name ...].

Figures in the documents come from benchmarks/results.json, which `python -m benchmarks --save`
writes, and from nowhere else.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from benchmarks.report import Table, describe, markdown

RESULTS = Path(__file__).parent / "results.json"


def saved() -> tuple[dict[str, Any], dict[str, Table]]:
    """The circumstances of the saved run, and its tables by name."""
    results = json.loads(RESULTS.read_text())
    tables = [Table(**table) for table in results.pop("tables")]
    return results, {table.name: table for table in tables}


def run() -> None:
    """Prints the tables named, or all, and what they were measured on."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tables", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name")
    words = parser.parse_args()
    if not RESULTS.exists():
        parser.exit(2, "there are no saved figures yet: run python -m benchmarks --save\n")
    circumstances, tables = saved()
    if unknown := [name for name in words.names if name not in tables]:
        parser.error(f"unknown: {', '.join(unknown)}; there are {', '.join(tables)}")
    for name in words.names or tables:
        print(f"{tables[name].title}:\n\n{markdown(tables[name])}\n")
    print(describe(circumstances))


if __name__ == "__main__":
    run()
