"""A table from the maps: the values of each parameter with which a preset is stable."""

from collections.abc import Sequence
from typing import Any

from benchmarks.report.tables import Cell, Table
from physics import PRESETS


def ranges(cells: Sequence[Any]) -> Table:
    """For each parameter and preset the longest range of values with a stable run."""
    rows: list[list[Cell]] = []
    for name in dict.fromkeys(cell.map for cell in cells):
        row: list[Cell] = [name]
        for preset, fidelity in PRESETS.items():
            runs = [cell for cell in cells if (cell.setting, cell.map) == (preset, name)]
            own = [run for run in runs if run.substep == fidelity.substep]
            row.append(_range(own) if own else None)
        rows.append(row)
    title = "Values with which each preset is stable"
    return Table("stability", title, ["parameter", *PRESETS], rows)


def _range(runs: Sequence[Any]) -> str:
    """The longest range of values with stable runs, as text."""
    ordered = sorted(runs, key=lambda run: run.value)
    best: list[float] = []
    current: list[float] = []
    for run in ordered:
        current = [*current, run.value] if run.outcome == "stable" and not run.refused else []
        best = max(best, current, key=len)
    if not best:
        return "none"
    text = f"{best[0]:,g} to {best[-1]:,g}" if len(best) > 1 else f"{best[0]:,g}"
    return f"all, {text}" if len(best) == len(ordered) else text
