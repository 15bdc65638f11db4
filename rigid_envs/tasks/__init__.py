"""The tasks, one a file: initial state, action, observation, goal and reward terms in NumPy."""

from rigid_envs.tasks.push import Push
from rigid_envs.tasks.task import Task

TASKS: dict[str, type[Task]] = {"push": Push}

__all__ = ["TASKS", "Push", "Task"]
