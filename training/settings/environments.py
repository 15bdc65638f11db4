"""Makes environments by id, with error messages that name a wrong id or argument."""

import inspect
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, TypeVar

import gymnasium as gym
from gymnasium.envs.registration import load_env_creator
from gymnasium.vector import AutoresetMode, VectorEnv

import rigid_envs  # noqa: F401  (registers the ids)
from rigid_envs.wrappers import vector
from training.settings.errors import UsageError, nearest
from training.settings.settings import parse_wrappers

if TYPE_CHECKING:  # at run time it would import yaml, which reading a policy does not need
    from training.settings.config import TrainConfig

Made = TypeVar("Made")

_threads: ContextVar[int | None] = ContextVar("threads", default=None)


@contextmanager
def environment_threads(threads: int) -> Iterator[None]:
    """Meanwhile, vector environments are made with this many threads instead of one for each core.

    It affects environments of this project whose arguments don't include `threads`.
    """
    before = _threads.set(threads)
    try:
        yield
    finally:
        _threads.reset(before)


def make_vector_env(env_id: str, num_envs: int, /, **env_kwargs: Any) -> VectorEnv:
    """The native vector environment with autoreset mode SAME_STEP.

    Raises:
        UsageError: The id is unknown, or the environment rejects an argument.
    """
    return _make(
        env_id,
        env_kwargs,
        lambda: gym.make_vec(
            env_id,
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            autoreset_mode=AutoresetMode.SAME_STEP,
            **{**_machine(env_id), **env_kwargs},
        ),
    )


def make_training_env(config: "TrainConfig", env_kwargs: dict[str, Any]) -> VectorEnv:
    """The vector environment in the reward wrappers of `config`.

    Its worlds run for so long that they wait for a kernel made for them, unless another kind is
    asked for.

    Raises:
        UsageError: As `make_vector_env`, or a wrapper rejects its arguments.
    """
    if _parameter(config.env_id, "kernel") and "RIGID_ENVS_KERNEL" not in os.environ:
        env_kwargs = {"kernel": "special", **env_kwargs}
    envs = make_vector_env(config.env_id, config.n_envs, **env_kwargs)
    for name, arguments in parse_wrappers(config.env_wrapper):
        try:
            envs = getattr(vector, name.rpartition(".")[2])(envs, **arguments)
        except (TypeError, ValueError) as error:
            envs.close()
            raise UsageError(f"env_wrapper: {name} rejects {arguments}: {error}") from error
    return envs


def make_single_env(env_id: str, /, **env_kwargs: Any) -> gym.Env:
    """The single environment.

    Raises:
        UsageError: The id is unknown, or the environment rejects an argument.
    """
    return _make(env_id, env_kwargs, lambda: gym.make(env_id, **env_kwargs))


def check_episodes_end(env_kwargs: dict[str, Any]) -> None:
    """Raises UsageError for episodes without an end, where whole ones are played."""
    if env_kwargs.get("max_episode_steps") == -1:
        raise UsageError(
            "max_episode_steps is -1, should be at least 1 here: whole episodes are played"
        )


def effective_fidelity(env_id: str, env_kwargs: dict[str, Any]) -> Any:
    """The fidelity that an environment uses: the argument, or the default of its constructor.

    None for an environment without such an argument.
    """
    arguments = {**_spec(env_id).kwargs, **env_kwargs}
    if "fidelity" in arguments:
        return arguments["fidelity"]
    parameter = _parameter(env_id, "fidelity")
    return parameter.default if parameter else None


def task_of(env_id: str) -> str | None:
    """Name of the task that an id was registered with, as "push"; None if without a name.

    Raises:
        UsageError: The id is unknown.
    """
    task = _spec(env_id).kwargs.get("task")
    return task if isinstance(task, str) else None


def registered_arguments(env_id: str) -> dict[str, Any]:
    """The arguments that an id sets itself, except its task: reward_type of a dense id.

    Raises:
        UsageError: The id is unknown.
    """
    return {name: value for name, value in _spec(env_id).kwargs.items() if name != "task"}


def _machine(env_id: str) -> dict[str, Any]:
    """The number of threads that `environment_threads` sets, if the environment accepts it."""
    threads = _threads.get()
    accepted = threads is not None and _parameter(env_id, "threads") is not None
    return {"threads": threads} if accepted else {}


def _parameter(env_id: str, name: str) -> inspect.Parameter | None:
    """A parameter of the vector environment's constructor; None if it has no such parameter."""
    entry_point = _spec(env_id).vector_entry_point
    creator = load_env_creator(entry_point) if isinstance(entry_point, str) else entry_point
    return inspect.signature(creator).parameters.get(name) if creator else None


def _make(env_id: str, env_kwargs: dict[str, Any], make: Callable[[], Made]) -> Made:
    _spec(env_id)
    try:
        return make()
    except MemoryError as error:
        raise UsageError(f"{env_id}: {error}") from None
    # Gymnasium checks some arguments by assert
    except (TypeError, ValueError, AssertionError, gym.error.Error) as error:
        own = "" if env_id.startswith("RigidEnvs/") else " (it is not an environment of rigid-envs)"
        given = {name: value for name, value in env_kwargs.items() if name != "kernel"}
        raise UsageError(f"{env_id}{own} rejects {given}: {error}") from error


def _spec(env_id: str) -> Any:
    """The registered specification.

    Raises:
        UsageError: The id is unknown.
    """
    try:
        return gym.spec(env_id)
    except (gym.error.Error, ImportError):
        # this project's ids first: without a namespace, one of them is meant
        own = [name for name in gym.registry if name.startswith("RigidEnvs/")]
        raise UsageError(
            f"unknown environment {env_id!r}; "
            f"did you mean {nearest(env_id, own or gym.registry)!r}?"
        ) from None
