"""The learning curve of a run, as a picture."""

import csv
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from training.errors import UsageError
from training.run_folder import RunFolder

STEPS = "time/total_timesteps"
SECONDS = "time/wall_time"
SUCCESS = "rollout/success_rate"


def plot_learning_curve(folder: RunFolder, picture: Path | None = None) -> Path:
    """Draws the success rate against wall time and against steps.

    Args:
        folder: The run.
        picture: The PNG to write; learning_curve.png in the run folder if not given.

    Returns:
        The path of the picture.

    Raises:
        UsageError: The run has no learning curve yet.
    """
    rows = read_learning_curve(folder)
    picture = picture or folder.path / "learning_curve.png"
    config = folder.config()
    success = [100 * row[SUCCESS] for row in rows]
    figure = Figure(figsize=(8, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, sharey=True)
    left.plot([row[SECONDS] for row in rows], success)
    left.set(xlabel="wall time / s", ylabel="success / %", ylim=(-2, 102))
    right.plot([row[STEPS] / 1e6 for row in rows], success)
    right.set(xlabel="environment steps / million")
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.set_xlim(left=0)
        if config.target_success_rate is not None:
            axes.axhline(100 * config.target_success_rate, color="gray", linestyle=":")
    figure.suptitle(f"{config.env_id}, {config.algo}, seed {config.seed}")
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=120)
    return picture


def read_learning_curve(folder: RunFolder) -> list[dict[str, float]]:
    """The rows of progress.csv that know a success rate: steps, seconds and success.

    Raises:
        UsageError: There are none.
    """
    columns = (STEPS, SECONDS, SUCCESS)
    try:
        with folder.progress.open(encoding="utf-8", newline="") as file:
            rows = [
                {column: float(row[column]) for column in columns}
                for row in csv.DictReader(file)
                if all(row.get(column) for column in columns)
            ]
    except FileNotFoundError:
        raise UsageError(
            f"{folder.path} holds no learning curve: progress.csv is missing"
        ) from None
    except ValueError as error:
        raise UsageError(f"{folder.progress} is damaged: {error}") from None
    if not rows:
        raise UsageError(f"{folder.progress} has no row with a success rate yet")
    return rows
