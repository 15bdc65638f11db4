"""Which task an environment and its arguments define."""

import inspect
import json
import re
from typing import Any

import gymnasium as gym

import rigid_envs  # noqa: F401  (registers the ids)
from rigid_envs.catalog import NAMED_TASKS
from training.settings.environment_ids import folder_name, plain_id
from training.settings.errors import UsageError

SAME_TASK = (
    "reward_type", "shaped", "fidelity", "observe_task_guide",
    "pixel_size", "camera", "width", "height", "show_forces", "show_particles", "render_worlds",
    "threads",
)  # fmt: skip
"""Arguments of the environment that do not change the task to be solved."""


def task_name(env_id: str, arguments: dict[str, Any]) -> str:
    """Name of the task that an environment and its arguments define.

    As RigidEnvs-Push-v0-target_yaw-true. A dense id and its plain id are the same task.

    Args:
        env_id: Environment id.
        arguments: Its arguments. The name omits those of SAME_TASK, those that are false, 0 or the
            default of the task, and a `max_episode_steps` equal to the registered one.
    """
    words = [folder_name(plain_id(env_id))]
    for name in changed_arguments(env_id, arguments):
        value = re.sub(r"[^A-Za-z0-9.]+", "-", json.dumps(arguments[name], default=str))
        words.append(f"{name}-{value.strip('-')}")
    return "-".join(words)


def check_same_task(trained: str, env_id: str, what: str) -> None:
    """Raises UsageError if two ids are of different tasks of this project.

    Args:
        trained: Environment id that a policy was trained on.
        env_id: Another one, that it is to act on.
        what: Names the policy.
    """
    tasks = []
    for name in (trained, env_id):
        spec = gym.registry.get(name)
        tasks.append(spec.kwargs.get("task") if spec is not None else None)
    if all(task in NAMED_TASKS for task in tasks) and tasks[0] != tasks[1]:
        raise UsageError(f"{what} was trained on {trained}, which is another task than {env_id}")


def task_defaults(env_id: str) -> dict[str, Any]:
    """Arguments of a task of this project and their defaults; empty for other environments."""
    spec = gym.registry.get(env_id)
    task = NAMED_TASKS.get(str(spec.kwargs.get("task"))) if spec is not None else None
    parameters = inspect.signature(task).parameters.values() if task is not None else ()
    return {one.name: one.default for one in parameters}


def changed_arguments(env_id: str, arguments: dict[str, Any]) -> list[str]:
    """Names of the arguments that make another task than the registered one, see `task_name`."""
    spec = gym.registry.get(env_id)
    usual = task_defaults(env_id)
    changed = {n for n, value in arguments.items() if value and value != usual.get(n)}
    if spec is not None and arguments.get("max_episode_steps") == spec.max_episode_steps:
        changed.discard("max_episode_steps")
    return sorted(changed - set(SAME_TASK))
