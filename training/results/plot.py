"""Plots learning curves: of one run, or of several that differ only in their seed."""

import csv
import math
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from training.runs.run_folder import RunFolder
from training.settings.environment_ids import folder_name
from training.settings.errors import UsageError

STEPS = "time/total_timesteps"
SECONDS, ELAPSED = "time/wall_time", "time/time_elapsed"
EXPLORING, EVALUATED = "rollout/success_rate", "eval/success_rate"
"""Success of training episodes, whose actions are sampled, and of the mean action."""
POINTS = 200
"""Number of points at which several curves are averaged: more than the plot can resolve."""
FEW = 5
"""Points of a line, at most, that are marked."""

Curve = list[dict[str, float]]
"""Rows of a learning curve: steps, seconds and success rates by column name."""


def plot_learning_curves(folders: Sequence[RunFolder], image: Path | None = None) -> Path:
    """Plots the success rate against wall time and against steps.

    Args:
        folders: One or more runs of the same algorithm on the same task.
        image: The PNG to write; by default learning_curve.png in the folder of a single run, or
            <environment>_learning_curves.png next to the folders of several.

    Returns:
        The path of the PNG.

    Raises:
        UsageError: A run has no learning curve yet or is given twice, the runs differ in more than
            their seed, or the image cannot be written.
    """
    curves = [read_learning_curve(folder) for folder in folders]
    configs = [folder.config() for folder in folders]
    _check_comparable(folders)
    first = configs[0]
    if image is None and len(folders) == 1:
        image = folders[0].path / "learning_curve.png"
    elif image is None:
        image = folders[0].path.parent / f"{folder_name(first.env_id)}_learning_curves.png"
    if image.suffix != ".png":
        raise UsageError(f"output is {str(image)!r}, should end in .png")
    seeds = ", ".join(str(config.seed) for config in configs)
    word = "seeds" if len(configs) > 1 else "seed"
    draw_learning_curves(
        curves,
        image,
        title=f"{first.env_id}, {first.algo.upper()}, {word} {seeds}",
        labels=[f"seed {config.seed}" for config in configs],
        targets={config.target_success_rate for config in configs} - {None},  # type: ignore[arg-type]
    )
    return image


def draw_learning_curves(
    curves: Sequence[Curve],
    image: Path,
    *,
    title: str,
    labels: Sequence[str],
    targets: Collection[float] = (),
) -> None:
    """Plots one curve, or several thin curves with their mean and a band from minimum to maximum.

    The curves are those of the mean action; faint ones below them are those of training episodes.
    Runs without evaluations have only the latter. In the mean a run that ended at its target keeps
    its last value.

    Args:
        curves: The curves, each with at least one row.
        image: The PNG to write.
        title: Title of the plot.
        labels: A name for each curve.
        targets: Success rates at which training ends, shown as dotted lines.
    """
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, column, unit in ((left, SECONDS, 1.0), (right, STEPS, 1e6)):
        lines = [_line(rows, column, unit, EXPLORING) for rows in curves]
        evaluated = [_line(rows, column, unit, EVALUATED) for rows in curves]
        if all(len(x) > 0 for x, _ in evaluated):
            for n, line in enumerate(lines):
                label = "with exploration" if n == 0 else None
                axes.plot(*line, color="gray", linewidth=0.7, alpha=0.6, label=label)
            lines = evaluated
        if len(lines) == 1:
            label = "mean action" if lines is evaluated else None
            axes.plot(*lines[0], label=label, marker=_mark(lines[0]))
        else:
            _draw_spread(axes, lines, labels, targets)
        axes.grid(alpha=0.3)
        axes.set_xlim(left=0)
        for target in targets:
            axes.axhline(100 * target, color="gray", linestyle=":")
    success = "success / %" if lines is evaluated else "success with exploration / %"
    left.set(xlabel="wall time / s", ylabel=success, ylim=(-2, 102))
    right.set(xlabel="environment steps / million")
    lines, names = right.get_legend_handles_labels()
    if names:  # above the plots, where it hides nothing
        figure.legend(
            lines, names, loc="outside upper right", ncols=min(len(names), 4), fontsize="small"
        )
    figure.suptitle(title, x=0.01, ha="left")
    try:
        image.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(image, dpi=120)
    except OSError as error:
        raise UsageError(f"{image} cannot be written: {error.strerror}") from None


def mean_and_spread(
    lines: Sequence[tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray]],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
    """Mean, minimum and maximum of several lines over the range that all of them cover.

    Args:
        lines: For each line, the x values in ascending order and the y values.

    Returns:
        x values, means, minima and maxima `(points,)`; None if the lines have no common range.
    """
    start, end = max(x[0] for x, _ in lines), min(x[-1] for x, _ in lines)
    if start >= end:
        return None
    points = np.linspace(start, end, POINTS)
    values = np.array([np.interp(points, x, y) for x, y in lines])
    return points, values.mean(axis=0), values.min(axis=0), values.max(axis=0)


def _line(rows: Curve, column: str, unit: float, success: str) -> tuple[np.ndarray, np.ndarray]:
    """X values and success in %, of the rows that have it."""
    found = [(row[column] / unit, 100 * row[success]) for row in rows if success in row]
    x, y = np.array(found).reshape(-1, 2).T
    return x, y


def held(
    lines: Sequence[tuple[np.ndarray, np.ndarray]], targets: Collection[float]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Lines in which runs that ended at their target keep their last value up to the longest one.

    Args:
        lines: for each run, x values in ascending order and success in %.
        targets: success rates at which training ends.
    """
    end, least = max(x[-1] for x, _ in lines), 100.0 * min(targets, default=math.inf)
    return [
        (np.append(x, end), np.append(y, y[-1])) if y[-1] >= least and x[-1] < end else (x, y)
        for x, y in lines
    ]


def _draw_spread(
    axes: Axes,
    lines: Sequence[tuple[np.ndarray, np.ndarray]],
    labels: Sequence[str],
    targets: Collection[float],
) -> None:
    for line, label in zip(lines, labels, strict=True):
        axes.plot(*line, linewidth=0.7, alpha=0.8, label=label, marker=_mark(line))
    shared = mean_and_spread(held(lines, targets))
    if shared is not None:
        points, mean, lowest, highest = shared
        axes.fill_between(points, lowest, highest, color="black", alpha=0.12, linewidth=0)
        axes.plot(points, mean, color="black", linewidth=2, label="mean")


def _mark(line: tuple[np.ndarray, np.ndarray]) -> str:
    """A marker for a line of few points: of a single one, nothing else would be seen."""
    return "o" if len(line[0]) <= FEW else ""


def read_learning_curve(folder: RunFolder) -> Curve:
    """The rows of progress.csv that have a success rate: steps, seconds and success rates.

    Raises:
        UsageError: The folder holds no run, or progress.csv is missing, damaged or has no such row.
    """
    folder.check_exists()
    return read_curve(folder.progress)


def read_curve(progress: Path) -> Curve:
    """The rows of a file that have a success rate; errors as for `read_learning_curve`."""
    columns = (STEPS, SECONDS, ELAPSED, EXPLORING, EVALUATED)
    try:
        with progress.open(encoding="utf-8", newline="") as file:
            rows = [
                {name: float(row[name]) for name in columns if row.get(name)}
                for row in csv.DictReader(file)
                if row.get(STEPS) and (row.get(EXPLORING) or row.get(EVALUATED))
            ]
    except FileNotFoundError:
        raise UsageError(
            f"{progress.parent} has no learning curve: {progress.name} is missing"
        ) from None
    except (ValueError, OSError, csv.Error) as error:
        raise UsageError(f"{progress} is damaged: {error}") from None
    if not rows:
        raise UsageError(f"{progress} has no row with a success rate yet")
    _fill_in_seconds(rows)
    return rows


def _fill_in_seconds(rows: Curve) -> None:
    """Writes the wall time of rows that lack it: by the clock of Stable-Baselines3.

    That counts whole seconds, from zero again where a run was resumed.
    """
    begun = last = clock = 0.0
    for row in rows:
        elapsed = row.pop(ELAPSED, clock)
        if elapsed < clock:
            begun = last
        if SECONDS in row:
            begun = row[SECONDS] - elapsed
        last = row[SECONDS] = max(begun + elapsed, last)
        clock = elapsed


def _check_comparable(folders: Sequence[RunFolder]) -> None:
    """Raises UsageError if the runs differ in more than their seed."""
    seen: set[Path] = set()
    first = folders[0].config()
    for folder in folders:
        if folder.path.resolve() in seen:
            raise UsageError(f"{folder.path} is given twice, should be given once")
        seen.add(folder.path.resolve())
        config = folder.config()
        for name, own, expected in (
            ("algorithm", config.algo, first.algo),
            ("environment", config.env_id, first.env_id),
            ("env_kwargs", config.env_kwargs, first.env_kwargs),
        ):
            if own != expected:
                raise UsageError(
                    f"{name} of {folder.path} is {own!r}, but {folders[0].path} has {expected!r}: "
                    "runs in one plot should differ only in their seed"
                )
