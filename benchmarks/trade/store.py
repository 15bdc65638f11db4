"""docs/trade/trade.csv: one row per trial and setting. A run that was interrupted resumes there."""

import hashlib
import math
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from benchmarks.report.csv_file import append_rows, read_rows
from benchmarks.report.provenance import ROOT

PATH = ROOT / "docs" / "trade" / "trade.csv"


class Row(NamedTuple):
    """A setting in a trial.

    Attributes:
        trial: name of the trial.
        engine: "rigid-envs" or "MuJoCo".
        curve: settings that differ only in their step share a curve.
        label: step, tolerance or preset.
        options: the Fidelity or MuJoCo's options, as Python text.
        status: "stable", "diverged" or "refused".
        error: see the trial; nan if there is none.
        energy: largest relative gain of energy.
        penetration: m, deepest.
        one: simulated s per s of one world; nan if not measured.
        many: simulated s per s of 4,096 worlds together.
        note: why a setting was refused or diverged.
    """

    trial: str
    engine: str
    curve: str
    label: str
    options: str
    status: str
    error: float
    energy: float
    penetration: float
    one: float
    many: float
    note: str = ""

    @property
    def key(self) -> tuple[str, str, str]:
        """Engine, curve and label, which name a setting."""
        return self.engine, self.curve, self.label


_NUMBERS = ("error", "energy", "penetration", "one", "many")


def load(path: Path = PATH) -> list[Row]:
    """All rows of a file; none if it doesn't exist.

    Raises:
        ValueError: the file has other columns.
    """
    rows = []
    for found in read_rows(path, Row._fields):
        values: dict[str, str | float] = dict(zip(Row._fields, found, strict=True))
        for name in _NUMBERS:
            values[name] = float(values[name]) if values[name] else math.nan
        rows.append(Row(**values))  # type: ignore[arg-type]
    return rows


def append(rows: Iterable[Row], path: Path = PATH) -> None:
    """Adds rows at the end of a file, which is created if it doesn't exist."""
    append_rows(path, Row._fields, ([_cell(value) for value in row] for row in rows))


def replace_all(rows: Iterable[Row], path: Path = PATH) -> None:
    """Replaces a file; an interruption leaves the one before."""
    unfinished = path.with_suffix(".tmp")
    unfinished.unlink(missing_ok=True)
    append(rows, unfinished)
    unfinished.replace(path)


class Partial:
    """What is measured of a trial that isn't complete: a file beside that of the results.

    Attributes:
        rows: the newest row of each setting, by its key.
        rounds: how often the cost of each setting was measured.
    """

    def __init__(self, path: Path, trial: str) -> None:
        self._path = path.with_name(f"{path.stem} {trial}.partial.csv")
        self.rows: dict[tuple[str, str, str], Row] = {}
        self.rounds: Counter[tuple[str, str, str]] = Counter()
        for row in load(self._path):
            self._take(row)

    def add(self, row: Row) -> None:
        """Keeps a row: first a setting's error alone, then with each round its costs, too."""
        append([row], self._path)
        self._take(row)

    def remove(self) -> None:
        """Deletes the file."""
        self._path.unlink(missing_ok=True)

    def _take(self, row: Row) -> None:
        self.rounds[row.key] = 0 if math.isnan(row.one) else self.rounds[row.key] + 1
        self.rows[row.key] = row


def _cell(value: str | float) -> str:
    if isinstance(value, str):
        return value
    return "" if math.isnan(value) else f"{value:.4g}"


def digest(rows: Iterable[Row]) -> str:
    """SHA-256 of rows, in hexadecimal."""
    text = "\n".join(",".join(_cell(value) for value in row) for row in rows)
    return hashlib.sha256(text.encode()).hexdigest()
