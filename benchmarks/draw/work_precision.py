"""Plot: error of a sliding cube against wall time, one curve per method."""

from pathlib import Path

from benchmarks.draw.figure import INK, new_figure, write
from benchmarks.report.tables import Cell, Table

METHODS = {
    "spring": ("rigid-envs, springs", "#c8553d", "o"),
    "impulse": ("rigid-envs, impulses", "#8e5aa8", "D"),
    "MuJoCo": ("MuJoCo", "#3d6fb6", "s"),
}
PRESETS = ("fast", "balanced", "accurate", "solid")


def draw(table: Table, path: Path) -> None:
    """Draws the table `work precision`: filled markers for 64 worlds, open ones for one world."""
    figure, axes = new_figure()
    name, method, error, many, single = table.columns
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    worlds = many.rsplit(", ", 1)[-1]
    for key, (label, color, marker) in METHODS.items():
        chosen = [row for row in rows if row[method] == key]
        for column, face, style in ((many, color, "-"), (single, "white", "--")):
            points = sorted((_number(row[column]), _number(row[error])) for row in chosen
                            if row[column] is not None)  # fmt: skip
            if not points:
                continue
            count = "one world" if column == single else worlds
            axes.plot(
                *zip(*points, strict=True), style, marker=marker, color=color,
                markerfacecolor=face, label=f"{label}, {count} per core",
            )  # fmt: skip
        for row in chosen:
            if row[name] in PRESETS and row[many] is not None:
                axes.annotate(
                    str(row[name]), (_number(row[many]), _number(row[error])),
                    textcoords="offset points", xytext=(7, 5), fontsize=9, color=INK,
                )  # fmt: skip
            elif key == "MuJoCo":
                axes.annotate(
                    str(row[name]).removeprefix("MuJoCo "),
                    (_number(row[single]), _number(row[error])),
                    textcoords="offset points", xytext=(7, 5), fontsize=8, color=color,
                )  # fmt: skip
    axes.set_xlabel("wall time per simulated second of one world, ms (one core)")
    axes.set_ylabel("relative error of the stopping distance")
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    write(figure, table, path)


def _number(cell: Cell) -> float:
    assert isinstance(cell, float)
    return cell
