"""Truths of theory by preset: forces on curved surfaces, impacts, rocking.

`physics.reference.truths` states each scene and derives its right value. Values are ratios unless a
unit is given.
"""

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.report.tables import Cell, Table
from physics import PRESETS, Fidelity
from physics.reference.truths import ROWS

NEWTON = replace(PRESETS["solid"], solver="newton", contact_resolution=50.0)


def measure() -> Iterator[Table]:
    """One table: right values, and those of each preset and of Newton's method."""
    levels: dict[str, Fidelity] = {**PRESETS, "newton": NEWTON}
    rows: list[list[Cell]] = [
        [name, f"{right:.4g}", *(f"{value(level):.4f}" for level in levels.values())]
        for name, right, value in ROWS
    ]
    yield Table("truths", "Truths of theory", ["truth", "right", *levels], rows)
