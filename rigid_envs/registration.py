"""Registers the environment ids. Importing rigid_envs calls `register`."""

from typing import Any

import gymnasium as gym

from rigid_envs.tasks import TASKS

# id: arguments of the environment
ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "RigidEnvs/Push-v0": {"task": "push"},
    "RigidEnvs/PushDense-v0": {"task": "push", "reward_type": "dense"},
    "RigidEnvs/Stack-v0": {"task": "stack"},
    "RigidEnvs/StackDense-v0": {"task": "stack", "reward_type": "dense"},
    "RigidEnvs/Throw-v0": {"task": "throw"},
    "RigidEnvs/ThrowDense-v0": {"task": "throw", "reward_type": "dense"},
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
