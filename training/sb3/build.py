"""Builds the worlds and the Stable-Baselines3 model that the settings describe."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize
from stable_baselines3.her import HerReplayBuffer

from training.datasets.demonstrations import read_demonstrations
from training.policies.bounded import BoundedPolicy
from training.policies.offsets import OffsetPolicy
from training.policies.pixels import PixelPolicy
from training.policies.symlog import (
    BoundedSymlogPolicy,
    SymlogActorCriticPolicy,
    SymlogPolicy,
)
from training.sb3.cloning import CloningSAC
from training.sb3.demonstration_buffers import DemonstrationBuffer, DemonstrationHerBuffer
from training.sb3.vec_env import RigidVecEnv
from training.settings.algorithms import (
    BOUNDED_POLICY,
    BOUNDED_SYMLOG_POLICY,
    OFFSET_POLICY,
    PIXEL_POLICY,
    SYMLOG_POLICY,
    SYMLOG_PPO_POLICY,
    PPOConfig,
    SACConfig,
)
from training.settings.config import TrainConfig
from training.settings.environments import make_training_env
from training.settings.errors import UsageError

SUCCESS_WINDOW = 1000
"""Least number of episodes over which the success rate of training is measured."""
POLICIES: dict[str, type[BasePolicy]] = {
    BOUNDED_POLICY: BoundedPolicy,
    OFFSET_POLICY: OffsetPolicy,
    SYMLOG_POLICY: SymlogPolicy,
    SYMLOG_PPO_POLICY: SymlogActorCriticPolicy,
    BOUNDED_SYMLOG_POLICY: BoundedSymlogPolicy,
    PIXEL_POLICY: PixelPolicy,
}
ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "elu": torch.nn.ELU}


class LinearSchedule:
    """A value that falls linearly to zero over the run."""

    def __init__(self, start: float):
        self.start = start

    def __call__(self, progress_remaining: float) -> float:
        """The value when this fraction of the run remains."""
        return progress_remaining * self.start


@contextmanager
def worlds_and_model(
    config: TrainConfig, device: str, num_threads: int
) -> Iterator[tuple[RigidVecEnv, BaseAlgorithm]]:
    """The worlds and the model of a run; afterwards closes the worlds.

    Args:
        config: The settings.
        device: Torch device of the networks.
        num_threads: Number of torch threads meanwhile.

    Raises:
        UsageError: The environment rejects its arguments, or the device does not exist.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(num_threads)
    worlds = RigidVecEnv(make_training_env(config, config.env_kwargs))
    try:
        yield worlds, _model(config, _wrapped(worlds, config), _checked_device(device))
    finally:
        torch.set_num_threads(threads)
        worlds.close()


def _wrapped(worlds: RigidVecEnv, config: TrainConfig) -> VecEnv:
    monitored = VecMonitor(worlds)
    if not (config.norm_obs or config.norm_reward):
        return monitored
    if config.algo == "ppo":
        return VecNormalize(
            monitored,
            norm_obs=config.norm_obs,
            norm_reward=config.norm_reward,
            gamma=config.gamma,
            epsilon=config.norm_epsilon,
        )
    # SAC: rewards are not scaled, because old transitions would get the statistics of the time at
    # which they are sampled. Goals are not scaled, because achieved and desired goals with
    # different scales could not be compared.
    goals = isinstance(monitored.observation_space, spaces.Dict)
    return VecNormalize(
        monitored, norm_reward=False, norm_obs_keys=["observation"] if goals else None
    )


def _model(config: TrainConfig, env: VecEnv, device: str) -> BaseAlgorithm:
    common: dict[str, Any] = {
        "policy": POLICIES.get(config.policy, config.policy),
        "env": env,
        "learning_rate": _schedule(config.learning_rate),
        "batch_size": config.batch_size,
        "gamma": config.gamma,
        "policy_kwargs": _policy_kwargs(config.policy_kwargs),
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
    kind: Any = SAC
    if config.cloning_steps:
        if config.demonstrations is None:
            raise UsageError(
                f"cloning_steps is {config.cloning_steps}, which requires demonstrations: record "
                "them with `rigid-envs dataset`, and train with --demonstrations NAME"
            )
        kind = CloningSAC
        common |= {
            "cloning_steps": config.cloning_steps,
            "cloning_weight": config.cloning_weight,
        }
    return kind(
        **common,
        buffer_size=config.buffer_size,
        learning_starts=config.learning_starts,
        train_freq=config.train_freq,
        gradient_steps=config.gradient_steps,
        tau=config.tau,
        ent_coef=config.ent_coef,
        **_replay_buffer(config),
    )


def _replay_buffer(config: SACConfig) -> dict[str, Any]:
    """The arguments of SAC for its replay buffer."""
    hindsight = config.replay_buffer_class is not None
    keywords = dict(config.replay_buffer_kwargs)
    if config.demonstrations is None:
        kind: Any = HerReplayBuffer if hindsight else None
    else:
        kind = DemonstrationHerBuffer if hindsight else DemonstrationBuffer
        keywords["episodes"] = read_demonstrations(config)
        keywords["fraction"] = config.demonstration_fraction
    return {"replay_buffer_class": kind, "replay_buffer_kwargs": keywords}


def _schedule(value: float | str) -> float | LinearSchedule:
    if isinstance(value, str):
        return LinearSchedule(float(value.removeprefix("lin_")))
    return value


def _policy_kwargs(policy_kwargs: dict[str, Any]) -> dict[str, Any]:
    """The configured network as arguments of Stable-Baselines3's policy."""
    network = dict(policy_kwargs)
    if "activation" in network:
        network["activation_fn"] = ACTIVATIONS[network.pop("activation")]
    return network


def _checked_device(device: str) -> str:
    try:
        found = torch.device(device) if device != "auto" else None
    except RuntimeError:
        raise UsageError(f"device is {device!r}, should be auto, cpu or cuda") from None
    if found is not None and found.type == "cuda" and not torch.cuda.is_available():
        raise UsageError(f"device is {device!r}, but torch finds no such device; should be cpu")
    return device
