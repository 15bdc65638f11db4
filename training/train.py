"""Trains a policy into a run folder of its own."""

import dataclasses
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize
from stable_baselines3.her import HerReplayBuffer

from training.bootstrap import BatchedTimeoutBootstrap
from training.checkpoint import PeriodicCheckpoint, save_checkpoint
from training.config import PPOConfig, SACConfig, TrainConfig
from training.environments import make_vector_env
from training.errors import UsageError
from training.export import policy_file_of
from training.progress import StopAtSuccess, TrainingProgress, success_rate
from training.run_folder import RunFolder, create_run_folder
from training.vec_env import RigidVecEnv

SUCCESS_WINDOW = 1000
ALGORITHM_CLASSES: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC}
ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "elu": torch.nn.ELU}


@dataclass(frozen=True)
class TrainResult:
    """How a training run went."""

    folder: RunFolder
    """Where it is kept."""
    steps: int
    """Environment steps taken, summed over worlds."""
    seconds: float
    """Wall time of training, in seconds."""
    environment_share: float
    """Share of that time spent in the environments."""
    success_rate: float | None
    """Share of the last episodes that succeeded, under the exploring policy."""
    interrupted: bool
    """Whether Ctrl-C ended it."""


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
) -> TrainResult:
    """Trains as configured; Ctrl-C ends it early and keeps what was learned.

    Args:
        config: What to train, and how.
        log_folder: Where run folders are made.
        device: Torch device of the networks.
        num_threads: Threads of torch; by default two, beyond which small networks gain nothing.
        save_every: Steps between checkpoints; a tenth of the run by default.
        quiet: Show no progress.

    Raises:
        UsageError: The environment refuses its arguments, or the device does not exist.
    """
    torch.set_num_threads(num_threads or min(2, os.cpu_count() or 1))
    seed = config.seed if config.seed is not None else int(np.random.default_rng().integers(2**31))
    config = dataclasses.replace(config, seed=seed)
    worlds = RigidVecEnv(make_vector_env(config.env_id, config.n_envs, **config.env_kwargs))
    try:
        model = _build(config, _wrapped(worlds, config), _checked(device))
        policy_file_of(model, config).to_bytes()  # what can't be kept is not worth training
        folder = create_run_folder(log_folder, config)
        model.set_logger(configure(str(folder.path), ["csv", "tensorboard"]))
        progress = TrainingProgress(config.n_timesteps, quiet)
        callbacks: list[BaseCallback] = [
            PeriodicCheckpoint(folder, config, save_every or max(config.n_timesteps // 10, 1)),
            progress,
        ]
        if isinstance(config, PPOConfig):
            callbacks.append(BatchedTimeoutBootstrap())
        if config.target_success_rate is not None:
            callbacks.append(StopAtSuccess(config.target_success_rate))
        start = time.perf_counter()
        interrupted = False
        try:
            model.learn(config.n_timesteps, callback=callbacks)
        except KeyboardInterrupt:
            interrupted = True
        finally:
            progress.close()
        seconds = time.perf_counter() - start
        save_checkpoint(model, folder, config)
        model.logger.close()
        return TrainResult(
            folder=folder,
            steps=model.num_timesteps,
            seconds=seconds,
            environment_share=worlds.seconds_in_envs / seconds,
            success_rate=success_rate(model),
            interrupted=interrupted,
        )
    finally:
        worlds.close()


def _wrapped(worlds: RigidVecEnv, config: TrainConfig) -> VecEnv:
    monitored = VecMonitor(worlds)
    return VecNormalize(monitored, gamma=config.gamma) if config.normalize else monitored


def _build(config: TrainConfig, env: VecEnv, device: str) -> BaseAlgorithm:
    common: dict[str, Any] = {
        "policy": config.policy,
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
