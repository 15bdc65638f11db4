"""Environments by id, with errors that say which id or argument was wrong."""

from collections.abc import Callable
from typing import Any, TypeVar

import gymnasium as gym
from gymnasium.vector import AutoresetMode, VectorEnv

import rigid_envs  # noqa: F401  (registers the ids)
from rigid_envs.wrappers import vector
from training.settings.config import TrainConfig
from training.settings.errors import UsageError, nearest
from training.settings.settings import calls_of

Made = TypeVar("Made")


def make_vector_env(env_id: str, num_envs: int, /, **env_kwargs: Any) -> VectorEnv:
    """The native vector environment, which resets ended worlds within the step.

    Raises:
        UsageError: The id is unknown or the environment refuses an argument.
    """
    return _make(
        env_id,
        env_kwargs,
        lambda: gym.make_vec(
            env_id,
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            autoreset_mode=AutoresetMode.SAME_STEP,
            **env_kwargs,
        ),
    )


def make_training_env(config: TrainConfig, env_kwargs: dict[str, Any]) -> VectorEnv:
    """The vector environment in the configured reward wrappers.

    Raises:
        UsageError: As `make_vector_env`; a wrapper refuses its arguments.
    """
    envs = make_vector_env(config.env_id, config.n_envs, **env_kwargs)
    for name, arguments in calls_of(config.env_wrapper):
        try:
            envs = getattr(vector, name.rpartition(".")[2])(envs, **arguments)
        except (TypeError, ValueError) as error:
            envs.close()
            raise UsageError(f"env_wrapper {name} refuses {arguments}: {error}") from error
    return envs


def make_single_env(env_id: str, /, **env_kwargs: Any) -> gym.Env:
    """The single environment.

    Raises:
        UsageError: The id is unknown or the environment refuses an argument.
    """
    return _make(env_id, env_kwargs, lambda: gym.make(env_id, **env_kwargs))


def _make(env_id: str, env_kwargs: dict[str, Any], make: Callable[[], Made]) -> Made:
    try:
        gym.spec(env_id)
    except (gym.error.Error, ImportError):
        # Ours first: someone who types no namespace means one of them.
        ours = [name for name in gym.registry if name.startswith("RigidEnvs/")]
        raise UsageError(
            f"unknown environment {env_id!r}; "
            f"did you mean {nearest(env_id, ours or gym.registry)!r}?"
        ) from None
    try:
        return make()
    except (TypeError, ValueError, AssertionError, gym.error.Error) as error:
        # Gymnasium asserts some of what it is given
        raise UsageError(f"{env_id} refuses {env_kwargs}: {error}") from error
