"""Checks of seeds and of the number of steps in an episode."""

from typing import Any

from physics.scene.validation import integer
from rigid_envs.tasks import Task

# in place of a seed: the world continues its own sequence of episodes
KEEP_SEED = -1


def check_seed(field: str, value: Any) -> int:
    """`value` as a seed.

    Raises:
        TypeError, ValueError: not an integer from 0 to 2**62; the message names `field`. A seed
            plus the index of a world fits into an int64 too.
    """
    return integer(field, value, low=0)


def step_limit(task: Task, max_episode_steps: Any) -> int | None:
    """Number of steps after which episodes are truncated; None for no limit.

    Raises:
        TypeError, ValueError: neither None, nor -1, nor a positive integer; or the task's own
            number is invalid.
    """
    field = "max_episode_steps"
    if max_episode_steps is None:
        field, max_episode_steps = f"{type(task).__name__}.{field}", task.max_episode_steps
    steps = integer(field, max_episode_steps, low=-(2**31))
    if steps < 1 and steps != -1:
        raise ValueError(f"{field} must be at least 1, or -1 for no limit, got {steps}")
    return None if steps == -1 else steps
