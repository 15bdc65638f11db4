"""Which task an environment and its arguments define."""

import json
import re
from typing import Any

import gymnasium as gym

import rigid_envs  # noqa: F401  (registers the ids)
from training.settings.environment_ids import folder_name, plain_id

SAME_TASK = (
    "reward_type", "fidelity", "observe_task_guide",
    "pixel_size", "camera",
)  # fmt: skip
"""Arguments of the environment that do not change the task to be solved."""


def task_name(env_id: str, arguments: dict[str, Any]) -> str:
    """Name of the task that an environment and its arguments define.

    As RigidEnvs-Push-v0-target_yaw-true. A dense id and its plain id are the same task.

    Args:
        env_id: Environment id.
        arguments: Its arguments. The name omits those of SAME_TASK, those that are false or 0, and
            a `max_episode_steps` equal to the registered one.
    """
    words = [folder_name(plain_id(env_id))]
    for name in changed_arguments(env_id, arguments):
        value = re.sub(r"[^A-Za-z0-9.]+", "-", json.dumps(arguments[name], default=str))
        words.append(f"{name}-{value.strip('-')}")
    return "-".join(words)


def changed_arguments(env_id: str, arguments: dict[str, Any]) -> list[str]:
    """Names of the arguments that make another task than the registered one, see `task_name`."""
    spec = gym.registry.get(env_id)
    changed = {name for name, value in arguments.items() if value}
    if spec is not None and arguments.get("max_episode_steps") == spec.max_episode_steps:
        changed.discard("max_episode_steps")
    return sorted(changed - set(SAME_TASK))
