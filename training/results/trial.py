"""The success of settings after a short training, for a search."""

import tempfile
from collections.abc import Callable
from pathlib import Path

from stable_baselines3.common.callbacks import BaseCallback

from training.policies.trained_policy import trained_policy
from training.results.evaluate import evaluate
from training.sb3.progress import success_rate
from training.sb3.train import train
from training.settings.config import TrainConfig
from training.settings.seed_ranges import SEARCH

INTERMEDIATE_REPORTS = 10
"""Number of intervals of a trial; at the end of each but the last, it is compared with others."""

Report = Callable[[float, int], bool]
"""Called with a success rate and the number of the interval; returns whether to stop the trial."""


class Stopped(Exception):
    """A trial was stopped early."""


class IntermediateReports(BaseCallback):
    """Reports intermediate success rates of a trial, and raises Stopped if the answer is to stop.

    Args:
        report: Is called with each of them.
        steps: Environment steps of the trial.
    """

    def __init__(self, report: Report, steps: int):
        super().__init__()
        self.report = report
        self.steps = steps
        self.reports = 0

    def _on_step(self) -> bool:
        due = INTERMEDIATE_REPORTS * self.num_timesteps // self.steps
        if self.reports < due < INTERMEDIATE_REPORTS:
            self.reports = due
            if self.report(success_rate(self.model) or 0.0, due):
                raise Stopped
        return True


def success_of(
    config: TrainConfig, episodes: int, device: str, num_threads: int, report: Report
) -> float:
    """Trains in a temporary folder, and returns the success rate of the policy.

    Args:
        config: The settings.
        episodes: Number of episodes of the evaluation.
        device: Torch device of the networks.
        num_threads: Number of torch threads.
        report: Is called with intermediate success rates.

    Raises:
        Stopped: `report` has stopped the trial.
        KeyboardInterrupt: Ctrl-C.
        ValueError: The training has diverged.
    """
    with tempfile.TemporaryDirectory() as folder:
        trained = train(
            config,
            Path(folder),
            device=device,
            num_threads=num_threads,
            save_every=2 * config.n_timesteps,  # only at the end
            quiet=True,
            callbacks=[IntermediateReports(report, config.n_timesteps)],
        )
        if trained.interrupted:
            raise KeyboardInterrupt
        policy = trained_policy(trained.folder.path)
        outcome = evaluate(policy, episodes, seed=SEARCH, quiet=True)
    return float(outcome.success_at_end.mean())
