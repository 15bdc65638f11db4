"""Registers the environment ids. Importing rigid_envs calls `register`."""

from typing import Any

import gymnasium as gym

from rigid_envs.catalog import NAMED_TASKS
from rigid_envs.twins import TWINS

# names in ids: those of tasks
NAMES = {
    "PickAndPlace": "pick_and_place",
    "Push": "push",
    "PushT": "push_t",
    "Reach": "reach",
    "Slide": "slide",
    "Stack": "stack",
    "Throw": "throw",
}
# names of twins in ids, as the originals have them: those of tasks
TWIN_NAMES = {twin.__name__: name for name, twin in TWINS.items()}


def _own_arguments(task: str) -> dict[str, Any]:
    """Arguments that an id sets because its task does."""
    twin = TWINS.get(task)
    return {"terminate_on_success": True} if twin is not None and twin.ends_on_success else {}


# id: arguments of the environment
ENVIRONMENTS: dict[str, dict[str, Any]] = {
    f"RigidEnvs/{name}{kind}-v0": {"task": task, **reward, **_own_arguments(task)}
    for name, task in {**NAMES, **TWIN_NAMES}.items()
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
                max_episode_steps=NAMED_TASKS[arguments["task"]].max_episode_steps,
                order_enforce=False,  # both environments check it themselves
                kwargs=arguments,
            )
