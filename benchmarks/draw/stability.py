"""Plots: maps of stability, one picture a setting, one panel a parameter."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from benchmarks.draw.figure import INK

OUTCOMES = {"stable": "#7fb88f", "drifted": "#ecc467", "diverged": "#c8553d"}
COLUMNS, PANEL, DPI = 4, (3.2, 2.7), 100  # panels side by side, inches


def draw_all(cells: Sequence[Any], folder: Path) -> Iterator[Path]:
    """Writes a picture of each setting into a folder."""
    for setting in dict.fromkeys(cell.setting for cell in cells):
        path = folder / f"stability_{setting}.png"
        draw([cell for cell in cells if cell.setting == setting], setting, path)
        yield path


def draw(cells: Sequence[Any], setting: str, path: Path) -> None:
    """Writes the maps of one setting."""
    names = list(dict.fromkeys(cell.map for cell in cells))
    lines = -(-(len(names) + 1) // COLUMNS)
    figure = Figure(figsize=(PANEL[0] * COLUMNS, PANEL[1] * lines), layout="constrained")
    FigureCanvasAgg(figure)
    for k, name in enumerate(names):
        axes = figure.add_subplot(lines, COLUMNS, k + 1)
        _panel(axes, [cell for cell in cells if cell.map == name])
        axes.set_xlabel(name, fontsize=9)
        if k % COLUMNS == 0:
            axes.set_ylabel("substep, ms", fontsize=9)
    key = figure.add_subplot(lines, COLUMNS, len(names) + 1)
    key.axis("off")
    handles: list[Any] = [Patch(color=color, label=name) for name, color in OUTCOMES.items()]
    handles.append(Patch(facecolor="white", edgecolor=INK, hatch="////", label="refused"))
    handles.append(Line2D([], [], color=INK, linewidth=2, label="predicted limit"))
    key.legend(handles=handles, loc="center", frameon=False, fontsize=9, title=f"{setting!r}, "
               "with other substeps", title_fontsize=10)  # fmt: skip
    figure.savefig(path, dpi=DPI)


def _panel(axes: Axes, cells: Sequence[Any]) -> None:
    values = sorted({cell.value for cell in cells})
    substeps = sorted({cell.substep for cell in cells})
    order = list(OUTCOMES)
    grid = np.zeros((len(substeps), len(values)))
    hatch = np.zeros_like(grid)
    limits = np.zeros(len(values))
    for cell in cells:
        row, column = substeps.index(cell.substep), values.index(cell.value)
        grid[row, column] = order.index(cell.outcome)
        hatch[row, column] = cell.refused
        limits[column] = cell.limit
    colors = ListedColormap(list(OUTCOMES.values()))
    axes.pcolormesh(grid, cmap=colors, vmin=-0.5, vmax=2.5, edgecolors="white", linewidth=0.4)
    for row, column in np.argwhere(hatch):
        axes.add_patch(Rectangle((column, row), 1, 1, fill=False, hatch="////", linewidth=0))
    # in cells: logarithmic in the substep
    steps = np.log(np.array(substeps))
    shown = limits > 0.0
    if shown.any():
        place = np.interp(np.log(limits[shown]), steps, np.arange(len(substeps)))
        axes.plot(np.flatnonzero(shown) + 0.5, place + 1.0, color=INK, linewidth=2)
    axes.set_ylim(0, len(substeps))
    rows = range(0, len(substeps), 3)
    axes.set_yticks([r + 0.5 for r in rows], [f"{1e3 * substeps[r]:.2g}" for r in rows])
    columns = range(0, len(values), max(1, len(values) // 5))
    axes.set_xticks([c + 0.5 for c in columns], [f"{values[c]:g}" for c in columns])
    axes.tick_params(labelsize=8, length=2)
