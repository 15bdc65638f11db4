"""Stack: the task, the cubes and their tower, where they start, and the dense reward."""

from rigid_envs.tasks.stack.task import Stack

__all__ = ["Stack"]
