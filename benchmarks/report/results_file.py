"""benchmarks/results.json: the saved tables, each with the run that measured it."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.report.tables import Table

RESULTS = Path(__file__).resolve().parents[1] / "results.json"


class Saved(NamedTuple):
    """The saved tables.

    Attributes:
        tables: tables by name.
        runs: by the name of a table, the provenance of the run that measured it.
    """

    tables: dict[str, Table]
    runs: dict[str, dict[str, Any]]


def load(path: Path = RESULTS) -> Saved:
    """Reads the saved tables; there are none if the file does not exist."""
    if not path.exists():
        return Saved({}, {})
    content = json.loads(path.read_text(encoding="utf-8"))
    tables, runs = {}, {}
    for entry in content["tables"]:
        run = content["runs"][entry.pop("run")]
        table = Table(**entry)
        tables[table.name], runs[table.name] = table, run
    return Saved(tables, runs)


def save(
    tables: Sequence[Table], run: dict[str, Any], path: Path = RESULTS, *, keep: bool = False
) -> None:
    """Writes the tables of a run.

    Args:
        tables: what the run measured.
        run: its provenance.
        path: the file.
        keep: keep the saved tables that this run did not measure; otherwise they are removed.
    """
    saved = load(path) if keep else Saved({}, {})
    for table in tables:
        saved.tables[table.name], saved.runs[table.name] = table, run
    runs: list[dict[str, Any]] = []
    entries = []
    for name, table in saved.tables.items():
        if saved.runs[name] not in runs:
            runs.append(saved.runs[name])
        entries.append({"run": runs.index(saved.runs[name]), **table._asdict()})
    content = {"runs": runs, "tables": entries}
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
