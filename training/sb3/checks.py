"""Checks of the settings of a run, and of a checkpoint, before training starts."""

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from training.policies.export import policy_file_of
from training.runs.run_folder import RunFolder
from training.sb3.build import worlds_and_model
from training.sb3.model_state import read_state
from training.sb3.vec_env import RigidVecEnv
from training.settings.algorithms import SACConfig
from training.settings.config import TrainConfig
from training.settings.environments import make_training_env
from training.settings.errors import UsageError


def with_seed(config: TrainConfig) -> TrainConfig:
    """The settings, with a random seed if they have none."""
    seed = config.seed if config.seed is not None else int(np.random.default_rng().integers(2**31))
    return dataclasses.replace(config, seed=seed)


def check_settings(config: TrainConfig) -> None:
    """Reports what `train` would reject, without training or writing anything.

    Args:
        config: The settings.

    Raises:
        UsageError: The environment rejects its arguments, the run would end before the first
            update, or HER cannot recompute this reward.
    """
    with checked_worlds_and_model(with_seed(config), "cpu", 1):
        pass


@contextmanager
def checked_worlds_and_model(
    config: TrainConfig, device: str, num_threads: int
) -> Iterator[tuple[RigidVecEnv, BaseAlgorithm]]:
    """The worlds and the model of a new run, after all checks of its settings.

    Args:
        config: The settings, with a seed.
        device: Torch device of the networks.
        num_threads: Number of torch threads.

    Raises:
        UsageError: As `check_settings`, or the device does not exist.
    """
    if isinstance(config, SACConfig) and config.learning_starts >= config.n_timesteps:
        raise UsageError(
            f"{config.env_id}: learning_starts is {config.learning_starts}, should be less than "
            f"n_timesteps = {config.n_timesteps}, or nothing is learned"
        )
    with worlds_and_model(config, device, num_threads) as (worlds, model):
        policy_file_of(model, config).to_bytes()  # reports a policy that cannot be saved now
        _check_her(config, worlds.envs)
        _check_finetuning(config, worlds)
        yield worlds, model


def state_to_resume(folder: RunFolder) -> tuple[Path, dict[str, Any]]:
    """The last checkpoint of an unfinished run, and its state.json.

    Raises:
        UsageError: There is no checkpoint or a damaged one, or the run is finished.
    """
    found = folder.checkpoints()
    if not found:
        raise UsageError(
            f"{folder.path} has no checkpoint: the run ended before the first one; start a new run"
        )
    checkpoint = max(found)[1]
    try:
        state = read_state(checkpoint)
        steps, finished = int(state["steps"]), bool(state["finished"])
    except Exception as error:  # a damaged file can raise any exception
        raise UsageError(f"{checkpoint} is damaged: {error}") from error
    if finished:
        raise UsageError(f"{folder.path} is finished after {steps:,} steps: nothing to resume")
    return checkpoint, dict(state)


def _check_her(config: TrainConfig, envs: Any) -> None:
    """Raises UsageError if HER is configured and cannot recompute the reward from goals."""
    if not isinstance(config, SACConfig) or config.replay_buffer_class is None:
        return
    registered = envs.spec.max_episode_steps if envs.spec is not None else None
    limit = config.env_kwargs.get("max_episode_steps") or registered
    if limit == -1:
        raise UsageError(
            f"{config.env_id}: max_episode_steps is -1, should be at least 1 in training: "
            "HerReplayBuffer samples from complete episodes"
        )
    # the first update follows the first rollout that ends after learning_starts
    first = (config.learning_starts // config.rollout + 1) * config.rollout
    ends_early = bool(config.env_kwargs.get("terminate_on_success"))
    complete = 0 if limit is None or ends_early else config.n_envs * limit
    if first < complete:
        raise UsageError(
            f"{config.env_id}: learning_starts is {config.learning_starts}, should be at least "
            f"n_envs × max_episode_steps = {complete}, or n_timesteps is too small: "
            "HerReplayBuffer samples from complete episodes"
        )
    goal = np.zeros((1, *envs.single_observation_space["desired_goal"].shape))
    try:
        envs.compute_reward(goal, goal + 1.0, [{}])
    except ValueError as error:
        raise UsageError(
            f"{config.env_id}: HerReplayBuffer computes rewards from goals alone: {error}"
        ) from None


def _check_finetuning(config: TrainConfig, worlds: RigidVecEnv) -> None:
    """Raises UsageError if the environment of the fine-tuning stage cannot be used."""
    if not config.finetune_timesteps:
        return
    envs = make_training_env(config, config.last_stage_kwargs)
    try:
        worlds.check_compatible(envs)
        _check_her(config, envs)
    except ValueError as error:
        raise UsageError(f"finetune_env_kwargs is {config.finetune_env_kwargs}: {error}") from None
    finally:
        envs.close()
