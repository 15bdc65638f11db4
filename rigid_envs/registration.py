"""The environments' ids. Gymnasium 1.x loads no plugins: importing rigid_envs registers them."""

import gymnasium as gym

# id: task, and steps of an episode
ENVIRONMENTS = {
    "RigidEnvs/Push-v0": ("push", 50),
    "RigidEnvs/Stack-v0": ("stack", 100),
    "RigidEnvs/Throw-v0": ("throw", 50),
}


def register() -> None:
    """Registers every id once."""
    for name, (task, steps) in ENVIRONMENTS.items():
        if name not in gym.registry:
            gym.register(
                name,
                entry_point="rigid_envs.env:RigidEnv",
                vector_entry_point="rigid_envs.vector_env:RigidVectorEnv",
                max_episode_steps=steps,
                order_enforce=False,  # both kinds ask for a reset themselves
                kwargs={"task": task},
            )
