"""Registers the environment ids. Importing rigid_envs calls `register`."""

from typing import Any

import gymnasium as gym

from rigid_envs.tasks import TASKS

# names in ids: those of tasks
NAMES = {
    "Push": "push",
    "PushT": "push_t",
    "Reach": "reach",
    "Slide": "slide",
    "Stack": "stack",
    "Throw": "throw",
}
# id: arguments of the environment
ENVIRONMENTS: dict[str, dict[str, Any]] = {
    f"RigidEnvs/{name}{kind}-v0": {"task": task, **reward}
    for name, task in NAMES.items()
    for kind, reward in {"": {}, "Dense": {"reward_type": "dense"}}.items()
}


def register() -> None:
    """Registers each id that is not registered yet."""
    for env_id, arguments in ENVIRONMENTS.items():
        if env_id not in gym.registry:
            gym.register(
                env_id,
                entry_point="rigid_envs.env:RigidEnv",
                vector_entry_point="rigid_envs.vector_env:RigidVectorEnv",
                max_episode_steps=TASKS[arguments["task"]].max_episode_steps,
                order_enforce=False,  # both environments check it themselves
                kwargs=arguments,
            )
