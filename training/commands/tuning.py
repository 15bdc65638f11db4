"""Searches settings: many short trainings, of which the poor ones are cut short.

All trials are kept in a database, an SQLite file if nothing else is said. The same command goes on
where it ended, whatever ended it; several processes may work on one study.
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

PART = 10
"""A trial takes a tenth of the steps that the settings have, unless told otherwise."""
LOOKS = 10
"""Times that a trial is compared with others before it ends."""
FIRST_LOOKS = 2
"""Of them, those that cut nothing short: early success says little."""
TRIALS_BEFORE_CUTS = 5
"""Complete trials before any is cut short, for a median of fewer says little."""
FIRST_SEED = 2_000_000
"""Of the episodes to choose by: others than those that results are measured on."""
SEED_LIMIT = 2**32
"""Seeds of the search are below it."""
FAILURE = "failure"
"""Attribute of a trial that diverged; those that were interrupted have none, and are repeated."""


@dataclass(frozen=True)
class Tuned:
    """What a search has found so far."""

    settings: TrainConfig | None
    """The best settings; None if no trial is complete."""
    summary: str
    """How well they did, and out of how many, in a line."""
    interrupted: bool
    """Whether Ctrl-C ended the search."""


class Look(BaseCallback):
    """Reports the success rate at parts of a trial, and ends trials that do worse than most."""

    def __init__(self, trial: optuna.Trial, steps: int):
        super().__init__()
        self.trial = trial
        self.steps = steps
        self.looks = 0

    def _on_step(self) -> bool:
        due = LOOKS * self.num_timesteps // self.steps
        if self.looks < due < LOOKS:
            self.looks = due
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
    num_threads: int | None = None,
) -> Tuned:
    """Trains with settings drawn from `search_space.SPACES`, as many times as asked.

    What is tried later follows what did well (TPE). Trial n trains with the seed of `config` plus
    n, and counts as good as the share of episodes that its policy ends in success.

    Args:
        config: Settings that are not searched; its steps are those of a trial.
        log_folder: Where run folders are, and the database beside them; trials leave none.
        trials: How many in all, with those of former calls.
        episodes: How many to measure a policy on.
        storage: An SQLite file, or the URL of a database.
        study_name: Its name in the database.
        device: Torch device of the networks.
        num_threads: Threads of torch.

    Raises:
        UsageError: The environment refuses its arguments, the database cannot be used, the study
            was begun with other settings, or every trial has failed.
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
            outcome = "cut short"
        except KeyboardInterrupt:
            study.tell(trial, state=TrialState.FAIL)
            interrupted, outcome = True, "interrupted"
        except ValueError as error:  # torch's, of numbers that are not finite, or ours
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
        last = _done(study)[-1].user_attrs.get(FAILURE, "nothing")
        raise UsageError(f"none of {trials} trials came to an end; the last said: {last}")
    best = with_drawn(config, study.best_trial.params) if complete else None
    return Tuned(best, _summary(study), interrupted)


def _success(
    config: TrainConfig,
    trial: optuna.Trial,
    episodes: int,
    device: str,
    num_threads: int | None,
) -> float:
    """Trains a trial and measures its policy."""
    drawn = with_drawn(config, draw(config.algo, trial))
    seed = (config.seed or 0) + trial.number
    drawn = drawn.replace("search", seed=seed, target_success_rate=None)
    with tempfile.TemporaryDirectory() as folder:
        trained = train(
            drawn,
            Path(folder),
            device=device,
            num_threads=num_threads,
            save_every=2 * config.n_timesteps,  # at its end alone
            quiet=True,
            callbacks=[Look(trial, config.n_timesteps)],
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
    """Opens or begins a study.

    Raises:
        UsageError: The database cannot be used, or the study was begun with other settings.
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
    except Exception as error:  # whatever a database makes its driver raise
        said = str(error).splitlines()[0] if str(error) else repr(error)
        raise UsageError(f"storage {storage or default} cannot be used: {said}") from error
    begun = {"algo": config.algo, "env_id": config.env_id, "episodes": episodes}
    _check_begun_alike(study, {**config.as_mapping(), **begun})
    seed = ((config.seed or 0) + len(study.trials)) % SEED_LIMIT  # else it draws the same again
    running = any(trial.state == optuna.trial.TrialState.RUNNING for trial in study.trials)
    # beside another process, which began at as many trials, chance alone keeps the two apart
    study.sampler = optuna.samplers.TPESampler(seed=None if running else seed)
    study.pruner = optuna.pruners.MedianPruner(TRIALS_BEFORE_CUTS, FIRST_LOOKS + 1)
    return study


def _check_begun_alike(study: optuna.Study, settings: dict[str, Any]) -> None:
    """Raises UsageError unless the study's trials were made with these settings."""
    if "settings" not in study.user_attrs:
        study.set_user_attr("settings", json.dumps(settings))
        return
    before = json.loads(study.user_attrs["settings"])
    for name, value in json.loads(json.dumps(settings)).items():
        if name in before and before[name] != value:
            raise UsageError(
                f"{name} is {value!r}, but study {study.study_name!r} was begun with "
                f"{before[name]!r}: keep that, or give another --study-name"
            )


def _done(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    """Trials that need no repetition."""
    over = (TrialState.COMPLETE, TrialState.PRUNED)
    return [
        trial
        for trial in study.get_trials(deepcopy=False)
        if trial.state in over or FAILURE in trial.user_attrs
    ]


def _summary(study: optuna.Study) -> str:
    done = len(_done(study))
    if not study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)):
        return f"none of {done} trials is complete"
    best = study.best_trial
    return f"best of {done} trials: number {best.number}, success {best.value:.1%}"
