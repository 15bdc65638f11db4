"""CSV files to which a long run appends, so that it can resume after an interruption."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path


def append_rows(path: Path, header: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    """Adds rows at the end of a file, which is created with its header if it isn't there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(header)
        writer.writerows(rows)


def read_rows(path: Path, header: Sequence[str]) -> list[list[str]]:
    """The rows of a file; none if it isn't there.

    Raises:
        ValueError: it begins with another header.
    """
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    if not rows or rows[0] != list(header):
        raise ValueError(f"{path} must begin with the line {','.join(header)}")
    return rows[1:]
