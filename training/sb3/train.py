"""Trains a policy into a run folder of its own, or goes on with a run."""

import dataclasses
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize
from stable_baselines3.her import HerReplayBuffer

from training.policies.bounded import BoundedPolicy
from training.policies.export import policy_file_of
from training.policies.offsets import OffsetPolicy
from training.runs.run_folder import RunFolder, create_run_folder
from training.sb3.bootstrap import BatchedTimeoutBootstrap
from training.sb3.checkpoint import PeriodicCheckpoint, save_checkpoint
from training.sb3.finish import FinishElsewhere
from training.sb3.learning_curve import continued_logger
from training.sb3.model_state import read_state, restore
from training.sb3.progress import StopAtSuccess, TrainingProgress, success_rate
from training.sb3.rollout_threads import OneThreadRollouts
from training.sb3.vec_env import RigidVecEnv
from training.settings.config import BOUNDED, OFFSETS, PPOConfig, SACConfig, TrainConfig
from training.settings.environments import make_training_env
from training.settings.errors import UsageError

SUCCESS_WINDOW = 1000
POLICIES: dict[str, type[BasePolicy]] = {BOUNDED: BoundedPolicy, OFFSETS: OffsetPolicy}
ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "elu": torch.nn.ELU}


@dataclass(frozen=True)
class TrainResult:
    """How a training run went."""

    folder: RunFolder
    """Where it is kept."""
    steps: int
    """Environment steps taken, summed over worlds."""
    steps_before: int
    """Those that a run had taken before it was resumed; 0 for one that was not."""
    seconds: float
    """Wall time of training since it began or was resumed, in seconds."""
    environment_share: float
    """Share of that time spent in the environments."""
    success_rate: float | None
    """Share of the last episodes that succeeded, under the exploring policy."""
    interrupted: bool
    """Whether Ctrl-C ended it."""


@dataclass(frozen=True)
class _Seconds:
    """Wall time of a run before it was resumed."""

    total: float
    """In seconds."""
    in_envs: float | None
    """How much of it in the environments; None for runs that did not keep it."""

    @classmethod
    def of(cls, state: dict[str, Any]) -> "_Seconds":
        """As a checkpoint has it."""
        in_envs = state.get("seconds_in_envs")
        return cls(float(state["seconds"]), None if in_envs is None else float(in_envs))


NO_SECONDS = _Seconds(0.0, 0.0)


class LinearSchedule:
    """A value that falls linearly to zero over the run."""

    def __init__(self, start: float):
        self.start = start

    def __call__(self, progress_remaining: float) -> float:
        """The value when this share of the run remains."""
        return progress_remaining * self.start


def train(
    config: TrainConfig,
    log_folder: Path = Path("runs"),
    *,
    device: str = "cpu",
    num_threads: int | None = None,
    save_every: int | None = None,
    quiet: bool = False,
    callbacks: Sequence[BaseCallback] = (),
) -> TrainResult:
    """Trains as configured; Ctrl-C ends it early and keeps what was learned.

    Args:
        config: What to train, and how.
        log_folder: Where run folders are made.
        device: Torch device of the networks.
        num_threads: Threads of torch; by default two, beyond which small networks gain nothing.
        save_every: Steps between checkpoints; a tenth of the run by default.
        quiet: Show no progress.
        callbacks: More to call at every step, after ours.

    Raises:
        UsageError: The environment refuses its arguments, the device does not exist, nothing would
            be learned, hindsight can't ask for this reward, or the disk is full; the last
            checkpoint stays then.
    """
    if isinstance(config, SACConfig) and config.learning_starts >= config.n_timesteps:
        raise UsageError(
            f"{config.env_id}: learning_starts is {config.learning_starts}, should be below "
            f"n_timesteps = {config.n_timesteps}, or nothing is learned"
        )
    seed = config.seed if config.seed is not None else int(np.random.default_rng().integers(2**31))
    config = dataclasses.replace(config, seed=seed)
    with _worlds_and_model(config, device, num_threads) as (worlds, model):
        policy_file_of(model, config).to_bytes()  # what can't be kept is not worth training
        _check_hindsight(config, worlds.envs)
        _check_finish(config, worlds)
        folder = create_run_folder(log_folder, config)
        with folder.claimed():
            with _naming_full_disks(folder):
                model.set_logger(configure(str(folder.path), ["csv", "tensorboard"]))
            return _learn(model, worlds, folder, config, save_every, quiet, more=callbacks)


def resume(
    folder: RunFolder,
    *,
    device: str = "cpu",
    num_threads: int | None = None,
    save_every: int | None = None,
    quiet: bool = False,
) -> TrainResult:
    """Goes on with a run from its last checkpoint, up to the steps that it was made for.

    Nothing is unpickled. The worlds begin new episodes, so a run that was resumed is not to the
    bit what it would have been.

    Args:
        folder: A run whose process has ended before its time.
        device: Torch device of the networks.
        num_threads: As of `train`.
        save_every: As of `train`.
        quiet: Show no progress.

    Raises:
        UsageError: The folder holds no run, no checkpoint or a damaged one, the run is finished,
            or another process is training it.
    """
    config = folder.config()
    with folder.claimed():
        found = folder.checkpoints()
        if not found:
            raise UsageError(
                f"{folder.path} holds no checkpoint to resume from: the run ended before its "
                "first one; train anew"
            )
        checkpoint = max(found)[1]
        with _worlds_and_model(config, device, num_threads) as (worlds, model):
            try:
                state = read_state(checkpoint)
                restore(model, checkpoint)
                before, finished = _Seconds.of(state), bool(state["finished"])
            except Exception as error:  # whatever a damaged file makes its reader raise
                raise UsageError(f"{checkpoint} is damaged: {error}") from error
            if finished or model.num_timesteps >= config.n_timesteps:
                raise UsageError(
                    f"{folder.path} is finished, after {model.num_timesteps:,} steps: "
                    "nothing to resume"
                )
            folder.note_resumption(model.num_timesteps)
            with _naming_full_disks(folder):
                model.set_logger(continued_logger(folder, checkpoint, state))
            return _learn(model, worlds, folder, config, save_every, quiet, before)


def _learn(
    model: BaseAlgorithm,
    worlds: RigidVecEnv,
    folder: RunFolder,
    config: TrainConfig,
    save_every: int | None,
    quiet: bool,
    before: _Seconds = NO_SECONDS,
    more: Sequence[BaseCallback] = (),
) -> TrainResult:
    """Takes the steps that are left, with checkpoints on the way and at the end."""
    steps_before, start = model.num_timesteps, time.perf_counter()

    def save(finished: bool = False) -> None:
        in_envs = before.in_envs
        save_checkpoint(
            model,
            folder,
            config,
            seconds=before.total + time.perf_counter() - start,
            seconds_in_envs=None if in_envs is None else in_envs + worlds.seconds_in_envs,
            finished=finished,
        )

    checkpoints = PeriodicCheckpoint(save_every or max(config.n_timesteps // 10, 1), save)
    progress = TrainingProgress(config.n_timesteps, quiet, before.total)
    callbacks: list[BaseCallback] = [checkpoints, progress]
    if isinstance(config, PPOConfig):
        callbacks += [BatchedTimeoutBootstrap(), OneThreadRollouts()]
    finish = None
    if config.finish_timesteps:
        assert config.seed is not None
        finish = FinishElsewhere(
            worlds,
            partial(make_training_env, config, config.last_env_kwargs),
            config.n_timesteps - config.finish_timesteps,
            config.seed + config.n_envs,
        )
        callbacks.append(finish)
    if config.target_success_rate is not None:
        callbacks.append(StopAtSuccess(config.target_success_rate, finish))
    callbacks += more
    interrupted = False
    try:
        left = config.n_timesteps - steps_before
        with _naming_full_disks(folder):
            model.learn(left, callback=callbacks, reset_num_timesteps=steps_before == 0)
    except RuntimeError as error:
        if "before the end of the first episode" not in str(error):
            raise
        assert isinstance(config, SACConfig)
        raise UsageError(
            f"learning_starts is {config.learning_starts}, should be above the "
            f"steps of the first episodes of all {config.n_envs} worlds: hindsight learns from "
            "whole episodes"
        ) from None
    except KeyboardInterrupt:
        interrupted = True
        if isinstance(model, OnPolicyAlgorithm) and checkpoints.rollout_from is not None:
            # no update has learned from the steps since, and none will
            model.num_timesteps = checkpoints.rollout_from
    finally:
        progress.close()
    seconds = time.perf_counter() - start
    save(finished=not interrupted)
    with _naming_full_disks(folder):
        model.logger.close()
    return TrainResult(
        folder=folder,
        steps=model.num_timesteps,
        steps_before=steps_before,
        seconds=seconds,
        environment_share=worlds.seconds_in_envs / seconds,
        success_rate=success_rate(model),
        interrupted=interrupted,
    )


def _check_hindsight(config: TrainConfig, envs: Any) -> None:
    """Raises UsageError now where hindsight would ask for rewards that nobody can tell."""
    if not isinstance(config, SACConfig) or config.replay_buffer_class is None:
        return
    goal = np.zeros((1, *envs.single_observation_space["desired_goal"].shape))
    try:
        envs.compute_reward(goal, goal + 1.0, [{}])
    except ValueError as error:
        raise UsageError(
            f"{config.env_id}: HerReplayBuffer asks for rewards of goals alone: {error}"
        ) from None


def _check_finish(config: TrainConfig, worlds: RigidVecEnv) -> None:
    """Raises UsageError now where the environment would refuse the last part of the run."""
    if not config.finish_timesteps:
        return
    envs = make_training_env(config, config.last_env_kwargs)
    try:
        worlds.check_like(envs)
        _check_hindsight(config, envs)
    except ValueError as error:
        raise UsageError(f"finish_env_kwargs is {config.finish_env_kwargs}: {error}") from None
    finally:
        envs.close()


@contextmanager
def _naming_full_disks(folder: RunFolder) -> Iterator[None]:
    """Makes a UsageError of what the system refuses, as to write the learning curve."""
    try:
        yield
    except OSError as error:
        raise UsageError(f"training stopped in {folder.path}: {error.strerror or error}") from error


@contextmanager
def _worlds_and_model(
    config: TrainConfig, device: str, num_threads: int | None
) -> Iterator[tuple[RigidVecEnv, BaseAlgorithm]]:
    threads = torch.get_num_threads()
    torch.set_num_threads(num_threads or min(2, os.cpu_count() or 1))
    worlds = RigidVecEnv(make_training_env(config, config.env_kwargs))
    try:
        yield worlds, _build(config, _wrapped(worlds, config), _checked(device))
    finally:
        torch.set_num_threads(threads)
        worlds.close()


def _wrapped(worlds: RigidVecEnv, config: TrainConfig) -> VecEnv:
    monitored = VecMonitor(worlds)
    if not config.normalize:
        return monitored
    if config.algo == "ppo":
        return VecNormalize(monitored, gamma=config.gamma)
    # a replay buffer's rewards would be scaled by what the statistics are when they are sampled,
    # and of achieved and desired goals scaled apart the difference can't be told
    goals = isinstance(monitored.observation_space, spaces.Dict)
    return VecNormalize(
        monitored, norm_reward=False, norm_obs_keys=["observation"] if goals else None
    )


def _build(config: TrainConfig, env: VecEnv, device: str) -> BaseAlgorithm:
    common: dict[str, Any] = {
        "policy": POLICIES.get(config.policy, config.policy),
        "env": env,
        "learning_rate": _schedule(config.learning_rate),
        "batch_size": config.batch_size,
        "gamma": config.gamma,
        "policy_kwargs": _network(config.policy_kwargs),
        "stats_window_size": max(SUCCESS_WINDOW, config.n_envs),
        "seed": config.seed,
        "device": device,
    }
    if isinstance(config, PPOConfig):
        return PPO(
            **common,
            n_steps=config.n_steps,
            n_epochs=config.n_epochs,
            gae_lambda=config.gae_lambda,
            ent_coef=config.ent_coef,
            vf_coef=config.vf_coef,
            max_grad_norm=config.max_grad_norm,
            clip_range=_schedule(config.clip_range),
            target_kl=config.target_kl,
        )
    assert isinstance(config, SACConfig)
    return SAC(
        **common,
        buffer_size=config.buffer_size,
        learning_starts=config.learning_starts,
        train_freq=config.train_freq,
        gradient_steps=config.gradient_steps,
        tau=config.tau,
        ent_coef=config.ent_coef,
        replay_buffer_class=HerReplayBuffer if config.replay_buffer_class else None,
        replay_buffer_kwargs=dict(config.replay_buffer_kwargs),
    )


def _schedule(value: float | str) -> float | LinearSchedule:
    if isinstance(value, str):
        return LinearSchedule(float(value.removeprefix("lin_")))
    return value


def _network(policy_kwargs: dict[str, Any]) -> dict[str, Any]:
    """The configured network in Stable-Baselines3's own terms."""
    network = dict(policy_kwargs)
    if "activation" in network:
        network["activation_fn"] = ACTIVATIONS[network.pop("activation")]
    return network


def _checked(device: str) -> str:
    try:
        wanted = torch.device(device) if device != "auto" else None
    except RuntimeError:
        raise UsageError(f"device is {device!r}, should be auto, cpu or cuda") from None
    if wanted is not None and wanted.type == "cuda" and not torch.cuda.is_available():
        raise UsageError(f"device is {device!r}, but torch sees no such device; should be cpu")
    return device
