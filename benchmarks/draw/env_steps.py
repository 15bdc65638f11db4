"""Plot: environment steps per second of Push against the number of worlds."""

from pathlib import Path

from benchmarks.draw.figure import new_figure, write
from benchmarks.report.tables import Table

STYLES = {
    "RigidEnvs/Push-v0": ("rigid-envs Push-v0 (environment)", "#c8553d", "o"),
    "MuJoCo: rollout": ("MuJoCo rollout (physics only)", "#3d6fb6", "s"),
    "MuJoCo: batch": ("MuJoCo batch (physics only)", "#7fa6d9", "^"),
    "panda-gym: PandaPush-v3": ("panda-gym PandaPush-v3 (environment)", "#5f8f4e", "D"),
}


def draw(table: Table, path: Path) -> None:
    """Draws the table `worlds`; a side without figures is omitted."""
    figure, axes = new_figure()
    worlds = [int(str(cell).replace(",", "")) for cell in table.column("worlds")]
    for name, (label, color, marker) in STYLES.items():
        points = [
            (count, rate)
            for count, rate in zip(worlds, table.column(name), strict=True)
            if isinstance(rate, float)
        ]
        if points:
            axes.plot(*zip(*points, strict=True), marker=marker, color=color, label=label)
    axes.set_xscale("log", base=4)
    axes.set_xticks(worlds, [f"{count:,}" for count in worlds])
    axes.minorticks_off()
    axes.set_xlabel("worlds")
    axes.set_ylabel("environment steps per second")
    figure.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=9)
    write(figure, table, path)
