"""Several runs that differ in their seed: one after another, or as tasks of a Ray cluster."""

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from training.settings.errors import UsageError
from training.settings.seed_ranges import LIMIT

if TYPE_CHECKING:
    from training.runs.run_folder import RunFolder
    from training.settings.config import TrainConfig

MOST_SEEDS = 1000
"""Largest number of runs of a command: more are a slip of the pen."""


def seeds(text: str) -> tuple[int, ...]:
    """Parses seeds such as "0-9", "0,3,7" or "0-2,5" in the given order.

    Raises:
        argparse.ArgumentTypeError: No such list, an empty range, a seed that appears twice, or too
            many seeds.
    """
    found: list[int] = []
    for part in text.split(","):
        bounds = re.fullmatch(r"\s*(\d{1,10})\s*(?:-\s*(\d{1,10})\s*)?", part, re.ASCII)
        if bounds is None:
            raise argparse.ArgumentTypeError(
                f'{text[:60]!r}: {part[:60]!r} should be a seed or a range, as in "0-9" or "0-2,5"'
            )
        first, last = int(bounds[1]), int(bounds[2] or bounds[1])
        if max(first, last) >= LIMIT:
            raise argparse.ArgumentTypeError(f"{text!r}: {part!r} should be below {LIMIT}")
        if last < first:
            raise argparse.ArgumentTypeError(
                f"{text!r}: the range {part!r} is empty, should be {last}-{first}"
            )
        if last - first + len(found) >= MOST_SEEDS:
            raise argparse.ArgumentTypeError(
                f"{text!r} has too many seeds, should have at most {MOST_SEEDS}"
            )
        found += range(first, last + 1)
    for index, seed in enumerate(found):
        if seed in found[:index]:
            raise argparse.ArgumentTypeError(
                f"{text!r} has seed {seed} twice, should have each seed once"
            )
    return tuple(found)


def train_seeds(
    config: "TrainConfig", seeds: Sequence[int], log_folder: Path, **machine: Any
) -> bool:
    """Trains one run for each seed, one after another; Ctrl-C ends the series.

    Args:
        config: The settings, but for the seed.
        seeds: The seeds.
        log_folder: Folder for run folders.
        machine: Arguments of `training.sb3.train.train`.

    Returns:
        Whether Ctrl-C ended the series. Each outcome is printed as soon as its run ends.

    Raises:
        UsageError: The settings are invalid, before any folder is created; or, after all seeds, one
            of the runs has failed.
    """
    from training.commands.demo import print_training
    from training.sb3.checks import check_settings
    from training.sb3.train import train

    check_settings(config)
    failures, interrupted = [], False
    for seed in seeds:
        try:
            result = train(config.replace(seed=seed), log_folder, **machine)
        except UsageError as error:
            failures.append(f"seed {seed}: {error}")
            continue
        print_training(result)
        if interrupted := result.interrupted:
            break
    _report(failures, len(seeds), interrupted)
    return interrupted


def train_on_ray(
    what: "Sequence[TrainConfig] | RunFolder", log_folder: Path, address: str, **machine: Any
) -> bool:
    """Trains new runs, or resumes one, as tasks of a Ray cluster.

    Args:
        what: The settings of each new run, or a run to resume.
        log_folder: Folder for run folders.
        address: Of the cluster, see `training.cluster.connection.connected`.
        machine: Arguments of `training.cluster.runs.train_runs`.

    Returns:
        Whether Ctrl-C ended the runs. The outcomes are printed.

    Raises:
        UsageError: Invalid settings, no such cluster, or no node that is large enough, before any
            folder is created; or, at the end, one of the runs has failed.
    """
    from training.cluster.connection import Demand, connected
    from training.cluster.runs import train_runs
    from training.commands.demo import print_training
    from training.runs.run_folder import RunFolder, create_run_folder
    from training.sb3.checks import check_settings, state_to_resume, with_seed

    if not isinstance(what, RunFolder):
        check_settings(what[0])
    with connected(address):
        Demand.of(machine["num_threads"], machine["device"]).check()
        if isinstance(what, RunFolder):
            state_to_resume(what)
            folders = [what]
        else:
            folders = [create_run_folder(log_folder, with_seed(one)) for one in what]
        outcome = train_runs(folders, **machine)
    for result in outcome.results:
        print_training(result)
    _report(outcome.failures, len(folders), outcome.interrupted)
    return outcome.interrupted


def _report(failures: Sequence[str], runs: int, interrupted: bool) -> None:
    """Raises UsageError if runs have failed; after Ctrl-C only prints which ones."""
    if not failures:
        return
    text = f"{len(failures)} of {runs} runs failed: {'; '.join(failures)}"
    if not interrupted:
        raise UsageError(text)
    print(text, file=sys.stderr)
