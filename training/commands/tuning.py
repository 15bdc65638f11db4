"""The tune command: searches settings by many short trials and stops poor trials early.

All trials are stored in a database, by default an SQLite file. The same command resumes an
interrupted search, and several processes may work on one study.
"""

import json
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import optuna
from optuna.trial import TrialState
from stable_baselines3.common.callbacks import BaseCallback

from training.policies.trained_policy import trained_policy
from training.results.evaluate import evaluate
from training.results.result import task_name
from training.runs.run_folder import folder_name
from training.sb3.progress import success_rate
from training.sb3.train import train
from training.settings.config import TrainConfig
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError
from training.settings.search_space import draw, with_drawn

STEPS_DIVISOR = 10
"""By default a trial has this fraction, a tenth, of the steps in the settings."""
INTERMEDIATE_REPORTS = 10
"""Number of intervals of a trial; at the end of each but the last, it is compared with others."""
WARMUP_REPORTS = 2
"""Number of first comparisons that do not stop a trial: early success rates mean little."""
STARTUP_TRIALS = 5
"""Number of complete trials before any is stopped: the median of fewer trials means little."""
FIRST_SEED = 2_000_000
"""First seed of the evaluation, whose episodes differ from those of the recorded results."""
SEED_LIMIT = 2**32
"""Upper bound of the sampler's seed."""
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


class Pruning(BaseCallback):
    """Reports intermediate success rates of a trial, and stops it if most others are better.

    Args:
        trial: The trial.
        steps: Environment steps of the trial.
    """

    def __init__(self, trial: optuna.Trial, steps: int):
        super().__init__()
        self.trial = trial
        self.steps = steps
        self.reports = 0

    def _on_step(self) -> bool:
        due = INTERMEDIATE_REPORTS * self.num_timesteps // self.steps
        if self.reports < due < INTERMEDIATE_REPORTS:
            self.reports = due
            self.trial.report(success_rate(self.model) or 0.0, due)
            if self.trial.should_prune():
                raise optuna.TrialPruned
        return True


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

    Raises:
        UsageError: The environment rejects its arguments, the database cannot be used, the study
            was started with other settings, or every trial has failed.
    """
    make_vector_env(config.env_id, 1, **config.env_kwargs).close()
    study = _study(config, log_folder, storage, study_name, episodes)
    interrupted = False
    while not interrupted and len(_done(study)) < trials:
        trial, start = study.ask(), time.perf_counter()
        try:
            value = _success(config, trial, episodes, device, num_threads)
        except optuna.TrialPruned:
            study.tell(trial, state=TrialState.PRUNED)
            outcome = "stopped early"
        except KeyboardInterrupt:
            study.tell(trial, state=TrialState.FAIL)
            interrupted, outcome = True, "interrupted"
        except ValueError as error:  # not finite: raised by torch or by this project
            trial.set_user_attr(FAILURE, str(error))
            study.tell(trial, state=TrialState.FAIL)
            outcome = f"failed: {' '.join(str(error).split()):.100}"
        else:
            study.tell(trial, value)
            outcome = f"success {value:.1%}"
        seconds = time.perf_counter() - start
        print(
            f"trial {trial.number}: {outcome} in {seconds:.0f} s; {_summary(study)}",
            file=sys.stderr,
        )
    complete = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    if not complete and not interrupted:
        last = _done(study)[-1].user_attrs.get(FAILURE, "unknown")
        raise UsageError(f"all {trials} trials failed; the error of the last one: {last}")
    best = with_drawn(config, study.best_trial.params) if complete else None
    return Tuned(best, _summary(study), interrupted)


def _success(
    config: TrainConfig,
    trial: optuna.Trial,
    episodes: int,
    device: str,
    num_threads: int,
) -> float:
    """Trains with the settings of a trial and returns the success rate of the policy."""
    drawn = with_drawn(config, draw(config.algo, trial))
    seed = (config.seed or 0) + trial.number
    drawn = drawn.replace("search", seed=seed, target_success_rate=None, eval_freq=0)
    with tempfile.TemporaryDirectory() as folder:
        trained = train(
            drawn,
            Path(folder),
            device=device,
            num_threads=num_threads,
            save_every=2 * config.n_timesteps,  # only at the end
            quiet=True,
            callbacks=[Pruning(trial, config.n_timesteps)],
        )
        if trained.interrupted:
            raise KeyboardInterrupt
        policy = trained_policy(trained.folder.path)
        outcome = evaluate(policy, episodes, seed=FIRST_SEED, quiet=True)
    return float(outcome.success_at_end.mean())


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
    seed = ((config.seed or 0) + len(study.trials)) % SEED_LIMIT
    running = any(trial.state == TrialState.RUNNING for trial in study.trials)
    # a process that runs at the same time may have the same number of trials: no seed then
    study.sampler = optuna.samplers.TPESampler(seed=None if running else seed)
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
