"""Figures that carry a digest of the numbers that they show."""

import hashlib
import json
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.report.tables import Table

DIGEST = "Figures"  # key in the PNG's metadata
SIZE, DPI = (7.2, 4.2), 130  # inches, dots per inch
INK, GRID = "#343a42", "#dfe3e8"


def new_figure() -> tuple[Figure, Axes]:
    """An empty figure with one pair of logarithmic axes."""
    figure = Figure(figsize=SIZE, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def digest(table: Table) -> str:
    """SHA-256 of a table's columns and rows, in hexadecimal."""
    content = json.dumps([table.columns, table.rows], ensure_ascii=False)
    return hashlib.sha256(content.encode()).hexdigest()


def write(figure: Figure, table: Table, path: Path) -> None:
    """Writes a PNG whose metadata hold the digest of the table."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI, metadata={DIGEST: digest(table)})
