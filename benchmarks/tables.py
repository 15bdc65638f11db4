"""The saved figures as Markdown, for README and docs: python -m benchmarks.tables [name ...].

Figures in the documents come from benchmarks/results.json, which `python -m benchmarks --save`
writes, and from nowhere else. --readme puts those of README.md in their place.
"""

import argparse
import json
import re
from pathlib import Path
from typing import Any

from benchmarks.report import Table, describe, markdown

RESULTS = Path(__file__).parent / "results.json"
README = Path(__file__).parent.parent / "README.md"
IN_README = (
    "speed",
    "speed_stack",
    "speed_throw",
    "presets",
    "tower 5",
    "accuracy",
    "restitution",
    "tumbling",
)
_PLACE = re.compile("(<!-- figures: begin -->\n).*(\n<!-- figures: end -->)", re.DOTALL)


def saved() -> tuple[dict[str, Any], dict[str, Table]]:
    """The circumstances of the saved run, and its tables by name."""
    results = json.loads(RESULTS.read_text())
    tables = [Table(**table) for table in results.pop("tables")]
    return results, {table.name: table for table in tables}


def _without(table: Table, column: str) -> Table:
    """A table less a column, and less the rows that have nothing else."""
    kept = [i for i, name in enumerate(table.columns) if name != column]
    rows = [[row[i] for i in kept] for row in table.rows if row[0] != column]
    return table._replace(columns=[table.columns[i] for i in kept], rows=rows)


def readme(text: str) -> str:
    """README's text with the saved figures; bars are for those who work on this."""
    circumstances, tables = saved()
    parts = [
        f"{table.title}:\n\n{markdown(table)}\n"
        for table in (_without(tables[name], "bar") for name in IN_README)
    ]
    parts.append(describe(circumstances))
    return _PLACE.sub(lambda m: m[1] + "\n".join(parts) + m[2], text)


def run() -> None:
    """Prints the tables named, or all, and what they were measured on."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tables", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name")
    parser.add_argument("--readme", action="store_true", help="write README.md instead")
    words = parser.parse_args()
    if not RESULTS.exists():
        parser.exit(2, "there are no saved figures yet: run python -m benchmarks --save\n")
    if words.readme:
        README.write_text(readme(README.read_text()))
        return
    circumstances, tables = saved()
    if unknown := [name for name in words.names if name not in tables]:
        parser.error(f"unknown: {', '.join(unknown)}; there are {', '.join(tables)}")
    for name in words.names or tables:
        print(f"{tables[name].title}:\n\n{markdown(tables[name])}\n")
    print(describe(circumstances))


if __name__ == "__main__":
    run()
