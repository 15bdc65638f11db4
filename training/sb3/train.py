"""Trains a policy into a new run folder, or resumes a run."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from training.runs.run_folder import RunFolder, create_run_folder
from training.sb3.bootstrap import BatchedTimeoutBootstrap
from training.sb3.build import worlds_and_model
from training.sb3.checkpoint import CurrentRollout, PeriodicCheckpoint, save_checkpoint
from training.sb3.checks import checked_worlds_and_model, state_to_resume, with_seed
from training.sb3.evaluation import SuccessEvaluation
from training.sb3.finetune import FineTuning
from training.sb3.learning_curve import continued_logger
from training.sb3.model_state import restore
from training.sb3.progress import StopAtSuccess, TrainingProgress, success_rate
from training.sb3.rollout_threads import OneThreadRollouts
from training.sb3.vec_env import RigidVecEnv
from training.settings.algorithms import PPOConfig, SACConfig
from training.settings.config import TrainConfig
from training.settings.environments import make_training_env, make_vector_env
from training.settings.errors import UsageError


@dataclass(frozen=True)
class TrainResult:
    """Outcome of a training run, including the time before it was resumed."""

    folder: RunFolder
    """The run folder."""
    steps: int
    """Environment steps of the whole run, summed over worlds."""
    steps_before: int
    """Steps before the run was resumed; 0 if it was not."""
    seconds: float
    """Wall time of training of the whole run, in seconds."""
    environment_time_fraction: float | None
    """Fraction of that time spent in the environments; None if unknown."""
    success_rate: float | None
    """Fraction of the last training episodes that succeeded, with sampled actions."""
    interrupted: bool
    """Whether Ctrl-C ended the run."""
    target_reached: float | None = None
    """Success of the mean action in the evaluation that ended the run before its last step."""


@dataclass(frozen=True)
class _Elapsed:
    """Wall time of a run, in seconds."""

    total: float = 0.0
    """All of it."""
    in_envs: float | None = 0.0
    """Time spent in the environments; None if the run did not record it."""

    @classmethod
    def of(cls, state: dict[str, Any]) -> "_Elapsed":
        """The time that a checkpoint recorded."""
        in_envs = state.get("seconds_in_envs")
        return cls(float(state["seconds"]), None if in_envs is None else float(in_envs))

    def plus(self, seconds: float, in_envs: float) -> "_Elapsed":
        """The sum with the time of this process."""
        before = self.in_envs
        return _Elapsed(self.total + seconds, None if before is None else before + in_envs)


def train(
    config: TrainConfig,
    log_folder: Path = Path("runs"),
    *,
    device: str = "cpu",
    num_threads: int = 1,
    save_every: int | None = None,
    quiet: bool = False,
    callbacks: Sequence[BaseCallback] = (),
    after_checkpoint: Callable[[RunFolder], None] | None = None,
) -> TrainResult:
    """Trains with the given settings; Ctrl-C ends training early and saves the policy.

    Args:
        config: The settings.
        log_folder: Folder for run folders.
        device: Torch device of the networks.
        num_threads: Number of torch threads. More of them gain little with small networks, take
            many times as long if another program uses their cores, and round differently.
        save_every: Steps between checkpoints; by default a tenth of the run.
        quiet: Show no progress.
        callbacks: Additional callbacks, called after those of training.
        after_checkpoint: Called with the run folder after each checkpoint, also the last one.

    Raises:
        UsageError: As `check_settings`, or the device does not exist, or the disk is full. The last
            checkpoint remains.
    """
    config = with_seed(config)
    with checked_worlds_and_model(config, device, num_threads) as (worlds, model):
        folder = create_run_folder(log_folder, config)
        with folder.locked():
            with _reporting_os_errors(folder):
                model.set_logger(configure(str(folder.path), ["csv", "tensorboard"]))
            return _learn(
                model, worlds, folder, config, save_every, quiet, after_checkpoint, more=callbacks
            )


def resume(
    folder: RunFolder,
    *,
    device: str = "cpu",
    num_threads: int = 1,
    save_every: int | None = None,
    quiet: bool = False,
    after_checkpoint: Callable[[RunFolder], None] | None = None,
) -> TrainResult:
    """Resumes a run from its last checkpoint and trains for the steps that remain.

    Nothing is unpickled. The worlds start new episodes, so the result is not bitwise identical to
    that of an uninterrupted run.

    Args:
        folder: A run whose process ended early.
        device: Torch device of the networks.
        num_threads: As for `train`.
        save_every: As for `train`.
        quiet: Show no progress.
        after_checkpoint: As for `train`.

    Raises:
        UsageError: The folder holds no run, no checkpoint or a damaged one, the run is finished, or
            another process is training it.
    """
    config = folder.config()
    with folder.locked():
        checkpoint, state = state_to_resume(folder)
        with worlds_and_model(config, device, num_threads) as (worlds, model):
            try:
                restore(model, checkpoint)
                before = _Elapsed.of(state)
            except UsageError:
                raise
            except Exception as error:  # a damaged file can raise any exception
                raise UsageError(f"{checkpoint} is damaged: {error}") from error
            folder.record_resumption(model.num_timesteps)
            with _reporting_os_errors(folder):
                model.set_logger(continued_logger(folder, checkpoint, state))
            return _learn(
                model, worlds, folder, config, save_every, quiet, after_checkpoint, before
            )


def _learn(
    model: BaseAlgorithm,
    worlds: RigidVecEnv,
    folder: RunFolder,
    config: TrainConfig,
    save_every: int | None,
    quiet: bool,
    after_checkpoint: Callable[[RunFolder], None] | None = None,
    before: _Elapsed = _Elapsed(),
    more: Sequence[BaseCallback] = (),
) -> TrainResult:
    """Trains for the remaining steps, and saves checkpoints meanwhile and at the end."""
    steps_before, start = model.num_timesteps, time.perf_counter()

    def elapsed() -> _Elapsed:
        return before.plus(time.perf_counter() - start, worlds.seconds_in_envs)

    def save(finished: bool = False) -> None:
        now = elapsed()
        save_checkpoint(
            model,
            folder,
            config,
            seconds=now.total,
            seconds_in_envs=now.in_envs,
            finished=finished,
        )
        if after_checkpoint is not None:
            after_checkpoint(folder)

    progress = TrainingProgress(config.n_timesteps, config.rollout, quiet, before.total)
    checkpoints = PeriodicCheckpoint(save_every or max(config.n_timesteps // 10, 1), save)
    rollout = CurrentRollout()
    callbacks = [checkpoints, progress, *_callbacks(config, worlds), *more, rollout]
    interrupted = False
    try:
        remaining = config.n_timesteps - steps_before
        with _reporting_os_errors(folder):
            model.learn(remaining, callback=callbacks, reset_num_timesteps=steps_before == 0)
    except RuntimeError as error:
        if "before the end of the first episode" not in str(error):
            raise
        assert isinstance(config, SACConfig)
        raise UsageError(
            f"learning_starts is {config.learning_starts}, should be greater than the steps of the "
            f"first episodes of all {config.n_envs} worlds: HER samples from complete episodes"
        ) from None
    except KeyboardInterrupt:
        interrupted = True
        if isinstance(model, OnPolicyAlgorithm) and rollout.start is not None:
            # the rollout is discarded: no update has used its steps
            model.num_timesteps = rollout.start
    finally:
        progress.close()
    total = elapsed()
    save(finished=not interrupted)
    rates = [one.evaluation.rate for one in callbacks if isinstance(one, StopAtSuccess)
             and one.reached]  # fmt: skip
    with _reporting_os_errors(folder):
        model.logger.close()
    return TrainResult(
        folder=folder,
        steps=model.num_timesteps,
        steps_before=steps_before,
        seconds=total.total,
        environment_time_fraction=None if total.in_envs is None else total.in_envs / total.total,
        success_rate=success_rate(model),
        interrupted=interrupted,
        target_reached=rates[0] if rates else None,
    )


def _callbacks(config: TrainConfig, worlds: RigidVecEnv) -> list[BaseCallback]:
    """The callbacks that the settings ask for."""
    callbacks: list[BaseCallback] = []
    if isinstance(config, PPOConfig):
        callbacks += [BatchedTimeoutBootstrap(), OneThreadRollouts()]
    finetuning = None
    if config.finetune_timesteps:
        assert config.seed is not None
        finetuning = FineTuning(
            worlds,
            partial(make_training_env, config, config.last_stage_kwargs),
            config.n_timesteps - config.finetune_timesteps,
            config.seed + config.n_envs,
        )
        callbacks.append(finetuning)
    if config.evaluation_interval:
        evaluation = SuccessEvaluation(
            partial(
                make_vector_env, config.env_id, config.n_eval_episodes, **config.final_env_kwargs
            ),
            config.evaluation_interval,
        )
        callbacks.append(evaluation)
        if config.target_success_rate is not None:
            callbacks.append(StopAtSuccess(config.target_success_rate, evaluation, finetuning))
    return callbacks


@contextmanager
def _reporting_os_errors(folder: RunFolder) -> Iterator[None]:
    """Turns an OSError, as of a full disk, into a UsageError."""
    try:
        yield
    except OSError as error:
        raise UsageError(f"training stopped in {folder.path}: {error.strerror or error}") from error
