"""Records finished runs and updates the page of results."""

import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from training.policies.policy_file import read_policy
from training.results.plot import draw_learning_curves, read_curve
from training.results.record_run import MAX_FILE_BYTES, record_run
from training.results.result import Result, read_results
from training.results.results_page import write_pages
from training.results.results_tables import by_kind, image_paths
from training.results.video import record
from training.runs.run_folder import RunFolder
from training.settings.algorithms import ALGORITHMS
from training.settings.config_file import load_config
from training.settings.errors import UsageError, check_exists

SOURCE = Path(__file__).resolve().parents[2]
"""The source tree with the recorded results; an installed package has none."""
GIF_SIZES = ((320, 3), (240, 3), (240, 2), (160, 2))
"""Pixels and number of episodes, tried in this order until a GIF is small enough."""


def update_results(
    runs: Sequence[Path] = (),
    log_folder: Path = Path("runs"),
    repository: Path = SOURCE,
    *,
    episodes: int = 1000,
    replace: bool = False,
    quiet: bool = False,
    report: Callable[[str], object] = print,
) -> None:
    """Records finished runs that are not recorded yet, then updates page, README and images.

    Args:
        runs: Run folders; by default all in `log_folder`.
        log_folder: Folder of the run folders.
        repository: Folder with results, docs and README.
        episodes: Number of episodes of each evaluation.
        replace: Whether `runs` replace results with the same seeds.
        quiet: Show no progress.
        report: Called with a line for each run that was recorded or skipped, with the reason, and
            for each file that was written.

    Raises:
        UsageError: One of `runs` is not a run folder, or a file of the repository is damaged or
            missing.
    """
    check_repository(repository)
    if replace and not runs:
        raise UsageError("--replace requires run folders: the runs that replace others")
    for path in runs:
        RunFolder(path).check_exists()
    read_results(repository)  # reports damaged results before anything is evaluated
    for path in runs or _runs(log_folder):
        try:
            result = record_run(RunFolder(path), repository, episodes, replace=replace, quiet=quiet)
        except UsageError as error:
            report(f"skipped  {path}: {error}")
        else:
            place = result.folder(repository).relative_to(repository)
            report(f"recorded {path}: {place}")
            _remove_outdated(result, repository)
    for group in by_kind(read_results(repository)):
        _update_images(group, repository, quiet, report)
    for path in write_pages(repository):
        report(f"written  {path}")


def check_repository(repository: Path) -> None:
    """Raises UsageError unless a folder is a clone of this project."""
    check_exists(repository, "a clone of this project")
    for name in ("README.md", "docs"):
        if not (repository / name).exists():
            raise UsageError(
                f"{repository} has no {name}: results are stored in a clone of this project; "
                "give its folder with --repository"
            )


def _runs(log_folder: Path) -> Iterable[Path]:
    """Run folders, in the order of their names and numbers."""
    found = [
        path
        for algo in ALGORITHMS
        for path in (log_folder / algo).glob("*_*")
        if path.is_dir() and path.name.rpartition("_")[2].isdecimal()
    ]
    return sorted(
        found, key=lambda path: (path.parent, path.name.rpartition("_")[0], _number(path))
    )


def _number(path: Path) -> int:
    return int(path.name.rpartition("_")[2])


def _remove_outdated(result: Result, repository: Path) -> None:
    """Removes images that lack a new result, at once because the command may be interrupted."""
    curve, video = image_paths(result.kind)
    (repository / curve).unlink(missing_ok=True)
    seeds = [other.seed for other in read_results(repository) if other.kind == result.kind]
    if result.seed == min(seeds):
        (repository / video).unlink(missing_ok=True)


def _update_images(
    group: Sequence[Result], repository: Path, quiet: bool, report: Callable[[str], object]
) -> None:
    """Plots the learning curves, and records a GIF of the first seed, if they are missing."""
    curve, video = image_paths(group[0].kind)
    (repository / curve).parent.mkdir(parents=True, exist_ok=True)
    if not (repository / curve).exists():
        folders = [result.folder(repository) for result in group]
        config = load_config(group[0].algorithm, group[0].env_id, folders[0] / "config.yaml")
        draw_learning_curves(
            [read_curve(folder / "progress.csv") for folder in folders],
            repository / curve,
            title=group[0].title,
            labels=[f"seed {result.seed}" for result in group],
            targets=[rate for rate in (config.target_success_rate,) if rate is not None],
        )
        report(f"plotted  {curve}")
    if not (repository / video).exists():
        _record_gif(group[0].folder(repository) / "policy.safetensors", repository / video, quiet)
        report(f"video    {video}")


def _record_gif(policy_file: Path, video: Path, quiet: bool) -> None:
    """Records a GIF of a policy at the largest size for which the file is small enough."""
    policy = read_policy(policy_file)
    for width, episodes in GIF_SIZES:
        with tempfile.TemporaryDirectory() as folder:  # `record` writes a still image too
            made, _ = record(
                policy,
                Path(folder) / video.name,
                episodes=episodes,
                gif_width=width,
                quiet=quiet,
            )
            if made.stat().st_size <= MAX_FILE_BYTES or (width, episodes) == GIF_SIZES[-1]:
                video.write_bytes(made.read_bytes())
                return
