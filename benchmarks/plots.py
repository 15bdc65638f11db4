"""Draws the pictures of README.md and docs: python -m benchmarks.plots [name ...].

Plots show the tables of benchmarks/results.json; the pictures of tasks show policies of results/.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from benchmarks.draw import env_steps, pixels, scenes, tasks, trade, view, worlds
from benchmarks.report.provenance import ROOT
from benchmarks.report.results_file import load
from benchmarks.report.tables import Table
from benchmarks.trade import impacts, rotating, sliding, standing, store


class Plot(NamedTuple):
    """A plot of a saved table.

    Attributes:
        table: name of the table.
        draw: writes the plot to a path.
        path: the PNG.
    """

    table: str
    draw: Callable[[Table, Path], None]
    path: Path


PLOTS = {
    "env_steps": Plot("worlds", env_steps.draw, ROOT / "docs/images/env_steps.png"),
}
# the animations of all tasks and of many worlds, and frames of an episode of each task
FILM = ROOT / "docs/images/tasks.gif"
WORLDS = ROOT / "docs/images/worlds.gif"
SCENES = ROOT / "docs/images/scenes.png"
VIEW = ROOT / "docs/images/view.png"
PIXELS = ROOT / "docs/images/pixels.png"
# plots of docs/trade/trade.csv: their trials
TRADE = {
    ROOT / "docs/images/trade.png": (
        "slide", "incline, rest", "bounce, e = 0.5", "tower of 5", "250 : 1", "grasp",
    ),
    ROOT / "docs/trade/friction.png": tuple(trial.name for trial in sliding.TRIALS),
    ROOT / "docs/trade/impacts.png": (
        *(trial.name for trial in impacts.TRIALS), "landing, slides", "five balls",
    ),
    ROOT / "docs/trade/standing.png": tuple(trial.name for trial in standing.TRIALS),
    ROOT / "docs/trade/rotation.png": tuple(trial.name for trial in rotating.TRIALS),
    ROOT / "docs/trade/truths.png": (
        "dome", "seam", "incline, 1 % too steep", "slim box", "overlap", "rocking",
    ),
}  # fmt: skip


def run() -> None:
    """Draws all pictures, or those named."""
    names = [*PLOTS, "trade", "tasks", "worlds", *tasks.STRIPS, "scenes", "pixels", "view"]
    parser = argparse.ArgumentParser(prog="python -m benchmarks.plots", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=", ".join(names))
    options = parser.parse_args()
    if unknown := [name for name in options.names if name not in names]:
        parser.error(f"unknown picture: {', '.join(unknown)}; known: {', '.join(names)}")
    saved = load()
    for name in options.names or names:
        if name == "tasks":
            tasks.draw_film(path := FILM)
        elif name == "worlds":
            worlds.draw(path := WORLDS)
        elif name == "view":
            view.draw(path := VIEW)
        elif name == "scenes":
            scenes.draw(path := SCENES)
        elif name == "pixels":
            pixels.draw(path := PIXELS)
        elif name in tasks.STRIPS:
            tasks.draw_strip(name, path := ROOT / f"docs/images/{name}.png")
        elif name == "trade":
            rows = store.load()
            done = {row.trial for row in rows}
            for path, trials in TRADE.items():
                trade.draw(rows, [trial for trial in trials if trial in done], path)
                print(f"written: {path.relative_to(ROOT)}")
            continue
        else:
            table, draw, path = PLOTS[name]
            if table not in saved.tables:
                parser.exit(2, f"{table!r} is not saved: run python -m benchmarks --save first\n")
            draw(saved.tables[table], path)
        print(f"written: {path.relative_to(ROOT)}")


if __name__ == "__main__":
    run()
