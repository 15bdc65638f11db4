"""Gymnasium environments on the particle-based rigid-body engine of `physics`."""

from rigid_envs.env import RigidEnv
from rigid_envs.episodes.runner import Runner
from rigid_envs.registration import register
from rigid_envs.tasks import Task
from rigid_envs.vector_env import RigidVectorEnv

register()

__all__ = ["RigidEnv", "RigidVectorEnv", "Runner", "Task"]
__version__ = "0.1.0"
