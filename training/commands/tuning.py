"""The tune command: searches settings by many short trials and stops poor trials early.

All trials are stored in a database, by default an SQLite file. The same command resumes an
interrupted search, and several processes may work on one study.
"""

import json
import sys
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import optuna
from optuna.trial import TrialState

from training.results.trial import Stopped, success_of
from training.sb3.checks import check_settings
from training.settings.config import TrainConfig
from training.settings.environment_ids import folder_name
from training.settings.errors import UsageError
from training.settings.search_space import draw, with_drawn
from training.settings.seed_ranges import LIMIT
from training.settings.tasks import task_name

STEPS_DIVISOR = 10
"""By default a trial has this fraction, a tenth, of the steps in the settings."""
WARMUP_REPORTS = 2
"""Number of first comparisons that do not stop a trial: early success rates mean little."""
STARTUP_TRIALS = 5
"""Number of complete trials before any is stopped: the median of fewer trials means little."""
FAILURE = "failure"
"""Attribute of a trial that diverged. Interrupted trials do not have it and are repeated."""


@dataclass(frozen=True)
class Tuned:
    """Outcome of a search so far."""

    settings: TrainConfig | None
    """The best settings; None if no trial is complete."""
    summary: str
    """One line: the number of trials, and the best success rate."""
    interrupted: bool
    """Whether Ctrl-C ended the search."""


def tune(
    config: TrainConfig,
    log_folder: Path = Path("runs"),
    *,
    trials: int = 50,
    episodes: int = 1000,
    storage: str | None = None,
    study_name: str | None = None,
    device: str = "cpu",
    num_threads: int = 1,
    ray: str | None = None,
) -> Tuned:
    """Trains repeatedly with settings sampled from `search_space.SPACES`.

    Later samples depend on the earlier trials (tree-structured Parzen estimator, TPE). Trial n has
    the seed of `config` plus n. Its value is the fraction of evaluation episodes that end in
    success.

    Args:
        config: The settings that are not searched, and the steps of a trial.
        log_folder: Folder of the run folders, for the database; trials leave no run folder.
        trials: Number of trials in total, including those of earlier calls.
        episodes: Number of episodes of each evaluation.
        storage: An SQLite file, or the URL of a database.
        study_name: Name of the study in the database.
        device: Torch device of the networks.
        num_threads: Number of torch threads.
        ray: Address of a Ray cluster that runs the trials, as many at a time as its nodes have
            CPUs for their threads; "" for that of this machine or a new one. None runs them here,
            one after another.

    Raises:
        UsageError: The environment rejects its arguments, the database cannot be used, the study
            was started with other settings, there is no such cluster, or every trial has failed.
    """
    check_settings(config)
    search = _Search(config, trials, episodes, device, num_threads)
    if ray is None:
        study = search.study = _study(config, log_folder, storage, study_name, episodes)
        interrupted = search.run_here()
    else:
        from training.cluster.connection import connected

        with connected(ray):
            study = search.study = _study(config, log_folder, storage, study_name, episodes)
            interrupted = search.run_on_cluster()
    complete = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    if not complete and not interrupted:
        last = _done(study)[-1].user_attrs.get(FAILURE, "unknown")
        raise UsageError(f"all {trials} trials failed; the error of the last one: {last}")
    best = with_drawn(config, study.best_trial.params) if complete else None
    return Tuned(best, _summary(study), interrupted)


class _Search:
    """The trials of a study: asks for their settings, and tells their outcomes.

    Args:
        config: The settings that are not searched, and the steps of a trial.
        trials: Number of trials in total.
        episodes: Number of episodes of each evaluation.
        device: Torch device of the networks.
        num_threads: Number of torch threads.
    """

    study: optuna.Study

    def __init__(
        self, config: TrainConfig, trials: int, episodes: int, device: str, num_threads: int
    ):
        self.config, self.trials, self.episodes = config, trials, episodes
        self.device, self.num_threads = device, num_threads
        self.running: dict[int, tuple[optuna.Trial, float]] = {}

    def run_here(self) -> bool:
        """Runs trials one after another; returns whether Ctrl-C ended them."""
        while (trial := self._ask()) is not None:
            outcome: float | BaseException
            try:
                outcome = _success(self.config, trial, self.episodes, self.device, self.num_threads)
            except (Stopped, KeyboardInterrupt, ValueError) as error:
                outcome = error  # a ValueError is one of numbers that are not finite
            self._tell(trial.number, outcome)
            if isinstance(outcome, KeyboardInterrupt):
                return True
        return False

    def run_on_cluster(self) -> bool:
        """Runs trials on the Ray cluster; returns whether Ctrl-C ended them."""
        from training.cluster.connection import Demand
        from training.cluster.trials import TrialOrder, run_trials

        def ask() -> TrialOrder | None:
            trial = self._ask()
            if trial is None:
                return None
            settings = _settings(self.config, trial)
            return TrialOrder(trial.number, settings, self.episodes, self.device, self.num_threads)

        def report(number: int, value: float, interval: int) -> bool:
            return number in self.running and _report(self.running[number][0], value, interval)

        try:
            return run_trials(ask, report, self._tell, Demand.of(self.num_threads, self.device))
        finally:
            for number in list(self.running):  # to be repeated by the next call
                self._tell(number, KeyboardInterrupt())

    def _ask(self) -> optuna.Trial | None:
        """Starts a trial; None if enough are done or running."""
        if len(_done(self.study)) + len(self.running) >= self.trials:
            return None
        trial = self.study.ask()
        self.running[trial.number] = (trial, time.perf_counter())
        return trial

    def _tell(self, number: int, outcome: float | BaseException) -> None:
        """Stores the outcome of a trial: its success rate, or why it has none."""
        trial, start = self.running.pop(number)
        if isinstance(outcome, float):
            self.study.tell(trial, outcome)
            text = f"success {outcome:.1%}"
        elif isinstance(outcome, Stopped):
            self.study.tell(trial, state=TrialState.PRUNED)
            text = "stopped early"
        elif isinstance(outcome, ValueError):
            trial.set_user_attr(FAILURE, str(outcome))
            self.study.tell(trial, state=TrialState.FAIL)
            text = f"failed: {' '.join(str(outcome).split()):.100}"
        else:
            self.study.tell(trial, state=TrialState.FAIL)
            lost = not isinstance(outcome, KeyboardInterrupt)
            text = f"lost with its worker ({outcome})" if lost else "interrupted"
        seconds = time.perf_counter() - start
        print(f"trial {number}: {text} in {seconds:.0f} s; {_summary(self.study)}", file=sys.stderr)


def _success(
    config: TrainConfig,
    trial: optuna.Trial,
    episodes: int,
    device: str,
    num_threads: int,
) -> float:
    """Trains with the settings of a trial and returns the success rate of the policy."""
    return success_of(
        _settings(config, trial), episodes, device, num_threads, partial(_report, trial)
    )


def _settings(config: TrainConfig, trial: optuna.Trial) -> TrainConfig:
    """The settings of a trial."""
    drawn = with_drawn(config, draw(config, trial))
    seed = ((config.seed or 0) + trial.number) % LIMIT
    return drawn.replace("search", seed=seed, target_success_rate=None, eval_freq=0)


def _report(trial: optuna.Trial, value: float, interval: int) -> bool:
    """Stores an intermediate success rate; whether most other trials are better."""
    trial.report(value, interval)
    return trial.should_prune()


def _study(
    config: TrainConfig,
    log_folder: Path,
    storage: str | None,
    study_name: str | None,
    episodes: int,
) -> optuna.Study:
    """Opens or creates a study.

    Raises:
        UsageError: The database cannot be used, or the study was started with other settings.
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    default = log_folder / config.algo / f"{folder_name(config.env_id)}_tuning.db"
    where = storage or str(default)
    name = study_name or f"{config.algo}-{task_name(config.env_id, config.env_kwargs)}"
    try:
        if "://" not in where:
            Path(where).parent.mkdir(parents=True, exist_ok=True)
            where = f"sqlite:///{where}"
        study = optuna.create_study(
            storage=where, study_name=name, direction="maximize", load_if_exists=True
        )
    except Exception as error:  # a database driver can raise any exception
        message = str(error).splitlines()[0] if str(error) else repr(error)
        raise UsageError(f"storage {storage or default} cannot be used: {message}") from error
    identity = {"algo": config.algo, "env_id": config.env_id, "episodes": episodes}
    _check_same_settings(study, {**config.as_mapping(), **identity})
    # another seed at each call, otherwise the same values would be sampled again
    seed = ((config.seed or 0) + len(study.trials)) % LIMIT
    running = any(trial.state == TrialState.RUNNING for trial in study.trials)
    # a process that runs at the same time may have the same number of trials: no seed then
    study.sampler = optuna.samplers.TPESampler(
        seed=None if running else seed,
        constant_liar=True,  # trials that run at the same time differ
    )
    study.pruner = optuna.pruners.MedianPruner(STARTUP_TRIALS, WARMUP_REPORTS + 1)
    return study


def _check_same_settings(study: optuna.Study, settings: dict[str, Any]) -> None:
    """Raises UsageError if the study was started with other settings."""
    if "settings" not in study.user_attrs:
        study.set_user_attr("settings", json.dumps(settings))
        return
    before = json.loads(study.user_attrs["settings"])
    for name, value in json.loads(json.dumps(settings)).items():
        if name in before and before[name] != value:
            raise UsageError(
                f"{name} is {value!r}, but study {study.study_name!r} was started with "
                f"{before[name]!r}: use that value, or another --study-name"
            )


def _done(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    """Trials that are not to be repeated: complete, stopped early or diverged."""
    finished = (TrialState.COMPLETE, TrialState.PRUNED)
    return [
        trial
        for trial in study.get_trials(deepcopy=False)
        if trial.state in finished or FAILURE in trial.user_attrs
    ]


def _summary(study: optuna.Study) -> str:
    done = len(_done(study))
    if not study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)):
        return f"none of {done} trials is complete"
    best = study.best_trial
    return f"best of {done} trials: number {best.number}, success {best.value:.1%}"
