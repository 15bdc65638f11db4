"""Gymnasium environments on the rigid-body engine `physics`.

Importing this package registers the ids `RigidEnvs/PickAndPlace-v0`, `RigidEnvs/Push-v0`,
`RigidEnvs/PushT-v0`, `RigidEnvs/Reach-v0`, `RigidEnvs/Slide-v0`, `RigidEnvs/Stack-v0` and
`RigidEnvs/Throw-v0`, twins of
other suites' environments, such as `RigidEnvs/FetchPush-v0` and `RigidEnvs/PandaPush-v0`, and the
same ids with a dense reward, such as `RigidEnvs/PushDense-v0`.
`gym.register_envs` has no effect, but shows linters that the import is used:

    import gymnasium as gym
    import rigid_envs

    gym.register_envs(rigid_envs)
    env = gym.make("RigidEnvs/Push-v0")
    envs = gym.make_vec("RigidEnvs/Push-v0", num_envs=4096)
"""

from rigid_envs.env import RigidEnv
from rigid_envs.episodes.runner import Runner
from rigid_envs.registration import register
from rigid_envs.tasks import Task
from rigid_envs.vector_env import RigidVectorEnv

register()

__all__ = ["RigidEnv", "RigidVectorEnv", "Runner", "Task"]
__version__ = "0.1.0"
