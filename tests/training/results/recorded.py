"""Records runs in a repository of the tests."""

import json
from pathlib import Path

from training.results.results import update_results

PLACE = Path("results/ppo/Test-Reach-v0_seed3")
"""Folder of the result of the first run, in the repository."""


def update(repository: Path, *runs: Path, **options) -> list[str]:
    """Records runs; returns the reported lines."""
    lines: list[str] = []
    update_results(
        runs, repository=repository, episodes=20, quiet=True, report=lines.append, **options
    )
    return lines


def change(file: Path, **values) -> None:
    """Changes values of a JSON file."""
    file.write_text(json.dumps({**json.loads(file.read_text()), **values}))
