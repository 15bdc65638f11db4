"""Learning curves as a picture: of one run, or of several that differ by their seed."""

import csv
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from training.runs.run_folder import RunFolder, folder_name
from training.settings.errors import UsageError

STEPS = "time/total_timesteps"
SECONDS = "time/wall_time"
SUCCESS = "rollout/success_rate"
POINTS = 200
"""At which the curves of several runs are compared: more than the picture can show."""

Curve = list[dict[str, float]]
"""Rows of a learning curve: steps, seconds and success by the names of their columns."""


def plot_learning_curves(folders: Sequence[RunFolder], picture: Path | None = None) -> Path:
    """Draws the success rate against wall time and against steps.

    Args:
        folders: One or more runs, of the same algorithm on the same task.
        picture: The PNG to write; if not given, learning_curve.png in the folder of a single run,
            <environment>_learning_curves.png beside the folders of several.

    Returns:
        The path of the picture.

    Raises:
        UsageError: A run has no learning curve yet, is given twice, or is one of another kind.
    """
    curves = [read_learning_curve(folder) for folder in folders]
    configs = [folder.config() for folder in folders]
    _check_same_kind(folders)
    first = configs[0]
    if picture is None and len(folders) == 1:
        picture = folders[0].path / "learning_curve.png"
    elif picture is None:
        picture = folders[0].path.parent / f"{folder_name(first.env_id)}_learning_curves.png"
    seeds = ", ".join(str(config.seed) for config in configs)
    draw_learning_curves(
        curves,
        picture,
        title=f"{first.env_id}, {first.algo}, seed{'s' if len(configs) > 1 else ''} {seeds}",
        labels=[f"seed {config.seed}" for config in configs],
        targets={config.target_success_rate for config in configs} - {None},  # type: ignore[arg-type]
    )
    return picture


def draw_learning_curves(
    curves: Sequence[Curve],
    picture: Path,
    *,
    title: str,
    labels: Sequence[str],
    targets: Collection[float] = (),
) -> None:
    """Draws one curve thick, or several thin with their mean and the band from lowest to highest.

    Args:
        curves: The curves, each with at least one row.
        picture: The PNG to write.
        title: What stands above.
        labels: A name for each curve.
        targets: Success rates at which training ends, dotted.
    """
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, column, unit in ((left, SECONDS, 1.0), (right, STEPS, 1e6)):
        lines = [
            (np.array([row[column] for row in rows]) / unit, [100 * row[SUCCESS] for row in rows])
            for rows in curves
        ]
        if len(lines) == 1:
            axes.plot(*lines[0])
        else:
            _draw_spread(axes, lines, labels)
        axes.grid(alpha=0.3)
        axes.set_xlim(left=0)
        for target in targets:
            axes.axhline(100 * target, color="gray", linestyle=":")
    left.set(xlabel="wall time / s", ylabel="success / %", ylim=(-2, 102))
    right.set(xlabel="environment steps / million")
    if len(curves) > 1:
        right.legend(loc="lower right", fontsize="small")
    figure.suptitle(title)
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=120)


def mean_and_spread(
    lines: Sequence[tuple[Sequence[float] | np.ndarray, Sequence[float]]],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
    """Mean, lowest and highest of several lines where all of them have values.

    Beyond the end of the shortest nothing is assumed of it: a run that has reached its target and
    one that was given fewer steps end alike.

    Args:
        lines: Places in rising order and values, of each line.

    Returns:
        Places, means, lowest and highest values `(points,)`; None if the lines share no stretch.
    """
    start, end = max(x[0] for x, _ in lines), min(x[-1] for x, _ in lines)
    if start >= end:
        return None
    places = np.linspace(start, end, POINTS)
    values = np.array([np.interp(places, x, y) for x, y in lines])
    return places, values.mean(axis=0), values.min(axis=0), values.max(axis=0)


def _draw_spread(
    axes: Axes, lines: Sequence[tuple[np.ndarray, list[float]]], labels: Sequence[str]
) -> None:
    for line, label in zip(lines, labels, strict=True):
        axes.plot(*line, linewidth=0.7, alpha=0.8, label=label)
    shared = mean_and_spread(lines)
    if shared is not None:
        places, mean, lowest, highest = shared
        axes.fill_between(places, lowest, highest, color="black", alpha=0.12, linewidth=0)
        axes.plot(places, mean, color="black", linewidth=2, label="mean")


def read_learning_curve(folder: RunFolder) -> Curve:
    """The rows of progress.csv that know a success rate: steps, seconds and success.

    Raises:
        UsageError: There are none.
    """
    return read_curve(folder.progress)


def read_curve(progress: Path) -> Curve:
    """The same of a file; arguments and errors as of `read_learning_curve`."""
    columns = (STEPS, SECONDS, SUCCESS)
    try:
        with progress.open(encoding="utf-8", newline="") as file:
            rows = [
                {column: float(row[column]) for column in columns}
                for row in csv.DictReader(file)
                if all(row.get(column) for column in columns)
            ]
    except FileNotFoundError:
        raise UsageError(
            f"{progress.parent} holds no learning curve: {progress.name} is missing"
        ) from None
    except (ValueError, OSError, csv.Error) as error:
        raise UsageError(f"{progress} is damaged: {error}") from None
    if not rows:
        raise UsageError(f"{progress} has no row with a success rate yet")
    return rows


def _check_same_kind(folders: Sequence[RunFolder]) -> None:
    """Raises UsageError unless the runs can be seeds of one experiment."""
    seen: set[Path] = set()
    first = folders[0].config()
    for folder in folders:
        if folder.path.resolve() in seen:
            raise UsageError(f"{folder.path} is given twice; each run should be given once")
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
                    "runs that are drawn together should differ by their seed only"
                )
