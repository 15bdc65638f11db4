"""Finished runs and a repository to record them in."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from training.results.results_page import README, TWINS
from training.sb3.train import train
from training.settings.config import TrainConfig


@pytest.fixture
def repository(tmp_path) -> Path:
    """A clone without results."""
    (tmp_path / "clone" / "docs").mkdir(parents=True)
    text = "# name\n<!-- results -->\nold\n<!-- /results -->\nmore\n"
    for page in (README, TWINS):
        (tmp_path / "clone" / page).write_text(text)
    return tmp_path / "clone"


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Callable[[TrainConfig], Path]:
    """Returns a finished run, trained once for each seed; copy it before changing it."""
    runs: dict[int | None, Path] = {}

    def run(config: TrainConfig) -> Path:
        if config.seed not in runs:
            folder = tmp_path_factory.mktemp("runs")
            runs[config.seed] = train(config, folder, quiet=True).folder.path
        return runs[config.seed]

    return run


@pytest.fixture
def without_images(monkeypatch) -> None:
    """Results are recorded without a plot and a video, which take longest."""
    monkeypatch.setattr("training.results.results._update_images", lambda *_: None)


@pytest.fixture
def runs(tmp_path, quick_ppo, finished) -> Path:
    """A folder with two finished runs, with the seeds 3 and 4."""
    for number, seed in ((1, 3), (2, 4)):
        to = tmp_path / "runs" / "ppo" / f"Test-Reach-v0_{number}"
        shutil.copytree(finished(quick_ppo.replace(seed=seed)), to)
    return tmp_path / "runs"
