"""Plots: error against speed, one panel a scene, with the front of each engine."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import NullFormatter

from benchmarks.draw.figure import GRID, INK
from benchmarks.trade.fronts import WORLDS, front, rate
from benchmarks.trade.settings import OURS, PEER
from benchmarks.trade.store import Row, digest

# in the metadata of a PNG
DIGEST = "Figures"
COLORS = {"springs": "#c8553d", "impulses": "#8e5aa8", "rotation": "#c8553d", PEER: "#3d6fb6"}
# a setting; a thin line joins those that differ in one number alone
KINDS = {
    "springs": "settings, spring law",
    "impulses": "settings, impulse law",
    PEER: "settings, MuJoCo",
}
SETTING = {"linewidth": 0.6, "marker": ".", "markersize": 3.5, "alpha": 0.35}
LEAST = 1e-7  # errors below it are drawn at it
DPI = 110
PANEL = (3.1, 2.7)  # inches
# points by which a preset's name is away from it, and its side that is there
_LABELS = {
    "fast": (5, 4, "left"), "balanced": (4, -10, "left"), "accurate": (-4, 5, "right"),
    "solid": (5, -10, "left"),
}  # fmt: skip
_HALO = withStroke(linewidth=2.0, foreground="white")  # around names, which lines cross
ENGINES = {OURS: "#c8553d", PEER: "#3d6fb6"}


def draw(
    rows: Sequence[Row], names: Sequence[str], path: Path, worlds: str = "many", columns: int = 3
) -> None:
    """Writes a PNG with a panel for each trial.

    Args:
        rows: of docs/trade/trade.csv.
        names: of the trials.
        path: the PNG.
        worlds: "many" or "one".
        columns: panels side by side.
    """
    lines = -(-len(names) // columns)
    size = PANEL[0] * columns, PANEL[1] * lines + 0.5
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    for k, name in enumerate(names):
        axes = figure.add_subplot(lines, columns, k + 1)
        _panel(axes, [row for row in rows if row.trial == name], worlds)
        axes.set_title(name, fontsize=10, color=INK)
        if k % columns == 0:
            axes.set_ylabel("error", fontsize=9)
        if k >= len(names) - columns:
            axes.set_xlabel(f"simulated s/s, {WORLDS[worlds]}", fontsize=9)
    handles = [
        Line2D([], [], color=color, linewidth=2.5, label=f"{engine}: fastest at each error")
        for engine, color in ENGINES.items()
    ]
    mark = {"marker": "o", "markerfacecolor": "white", "markeredgewidth": 1.6, "linewidth": 0}
    handles.append(Line2D([], [], color=INK, label="presets", **mark))  # type: ignore[arg-type]
    handles += [
        Line2D([], [], color=COLORS[kind], label=label, **SETTING)  # type: ignore[arg-type]
        for kind, label in KINDS.items()
    ]
    # the fronts in the first row, the settings in the second; the legend fills columns
    handles = [handles[k] for k in (0, 3, 1, 4, 2, 5)]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=9
    )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI, metadata={DIGEST: digest(rows)})


def _panel(axes: Axes, rows: Sequence[Row], worlds: str) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):  # within one decade the labels would overlap
        axis.set_minor_formatter(NullFormatter())
    axes.margins(y=0.12)
    axes.grid(True, color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    curves: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if rate(row, worlds) > 0.0:
            curves.setdefault((row.engine, row.curve), []).append(row)
    for (engine, curve), points in curves.items():
        if curve == "presets":
            continue
        kind = engine if engine == PEER else curve.split(",")[0]
        color = COLORS.get(kind, COLORS["rotation"])
        axes.plot(*_points(points, worlds), color=color, **SETTING)  # type: ignore[arg-type]
    for engine, color in ENGINES.items():
        best = front(rows, engine, worlds)
        mark = "o" if len(best) == 1 else ""  # a front of one setting has no line
        axes.plot(*_points(best, worlds), marker=mark, color=color, linewidth=2.2)
    for row in curves.get((OURS, "presets"), ()):
        x, y = rate(row, worlds), max(row.error, LEAST)
        axes.plot([x], [y], "o", color=INK, markerfacecolor="white", markersize=5, zorder=5)
        across, up, side = _LABELS[row.label]
        axes.annotate(
            row.label, (x, y), textcoords="offset points", xytext=(across, up), ha=side,
            fontsize=7, color=INK, zorder=6, path_effects=[_HALO],
        )  # fmt: skip


def _points(rows: Sequence[Row], worlds: str) -> tuple[list[float], list[float]]:
    return [rate(row, worlds) for row in rows], [max(row.error, LEAST) for row in rows]
