"""Records finished runs and brings the page of results up to date."""

import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from training.policies.policy_file import read_policy
from training.results.plot import draw_learning_curves, read_curve
from training.results.record import record
from training.results.recording import LARGEST, record_run
from training.results.result import Result, read_results
from training.results.results_page import by_kind, pictures, write_pages
from training.runs.run_folder import RunFolder
from training.settings.config import ALGORITHMS
from training.settings.errors import UsageError

SOURCE = Path(__file__).resolve().parents[2]
"""The source tree, where results are kept; an installed package has none."""
FILM_WIDTHS = (320, 240, 160)
"""Pixels, tried from the largest until a film is small enough."""
FILM_EPISODES = 3


def update_results(
    runs: Sequence[Path] = (),
    log_folder: Path = Path("runs"),
    repository: Path = SOURCE,
    *,
    episodes: int = 1000,
    replace: bool = False,
    quiet: bool = False,
    say: Callable[[str], object] = print,
) -> None:
    """Records what is finished and not recorded yet, then rewrites page, README and pictures.

    Args:
        runs: Run folders; all under `log_folder` if none is given.
        log_folder: Where run folders are.
        repository: Where results, docs and README are.
        episodes: How many to evaluate on.
        replace: Whether the runs given take the place of results of their seeds.
        quiet: Show no progress.
        say: Takes a line for each run that was recorded or skipped, with the reason, and for each
            file that was written.

    Raises:
        UsageError: A run that was given is none, or a file of the repository is damaged or missing.
    """
    check_repository(repository)
    if replace and not runs:
        raise UsageError("--replace takes the run folders that should replace others")
    for path in runs:
        if not (path / "run.json").exists():
            raise UsageError(f"{path} is no run folder: run.json is missing")
    read_results(repository)  # what is damaged should show before anything is evaluated
    for path in runs or _runs(log_folder):
        try:
            result = record_run(RunFolder(path), repository, episodes, replace=replace, quiet=quiet)
        except UsageError as error:
            say(f"skipped  {path}: {error}")
        else:
            place = result.folder(repository).relative_to(repository)
            say(f"recorded {path}: {place}")
            _remove_outdated(result, repository)
    for group in by_kind(read_results(repository)):
        _draw(group, repository, quiet, say)
    for path in write_pages(repository):
        say(f"written  {path}")


def check_repository(repository: Path) -> None:
    """Raises UsageError where results can't be kept."""
    for name in ("README.md", "docs"):
        if not (repository / name).exists():
            raise UsageError(
                f"{repository} has no {name}: results are kept in a clone of the project; "
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
    """Removes pictures that a new result is missing from, at once: the command may yet be ended."""
    curve, film = pictures(result.kind)
    (repository / curve).unlink(missing_ok=True)
    seeds = [other.seed for other in read_results(repository) if other.kind == result.kind]
    if result.seed == min(seeds):
        (repository / film).unlink(missing_ok=True)


def _draw(
    group: Sequence[Result], repository: Path, quiet: bool, say: Callable[[str], object]
) -> None:
    """Draws the learning curves and films the first seed, where that is missing."""
    curve, film = pictures(group[0].kind)
    (repository / curve).parent.mkdir(parents=True, exist_ok=True)
    if not (repository / curve).exists():
        folders = [result.folder(repository) for result in group]
        draw_learning_curves(
            [read_curve(folder / "progress.csv") for folder in folders],
            repository / curve,
            title=f"{group[0].env_id}, {group[0].algorithm}",
            labels=[f"seed {result.seed}" for result in group],
        )
        say(f"drawn    {curve}")
    if not (repository / film).exists():
        _film(group[0].folder(repository) / "policy.policy", repository / film, quiet)
        say(f"filmed   {film}")


def _film(policy_file: Path, film: Path, quiet: bool) -> None:
    """Films a policy as large as its file may be."""
    policy = read_policy(policy_file)
    for width in FILM_WIDTHS:
        with tempfile.TemporaryDirectory() as folder:  # a film comes with a still
            made, _ = record(
                policy,
                Path(folder) / film.name,
                episodes=FILM_EPISODES,
                gif_width=width,
                quiet=quiet,
            )
            if made.stat().st_size <= LARGEST or width == FILM_WIDTHS[-1]:
                film.write_bytes(made.read_bytes())
                return
