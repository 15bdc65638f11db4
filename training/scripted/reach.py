"""A controller for Reach."""

import numpy as np

from rigid_envs.tasks.reach import Reach

Array = np.ndarray


def reach(observation: dict[str, Array]) -> Array:
    """Moves straight to the goal.

    Args:
        observation: Of Reach.

    Returns:
        [n, 3] actions within ±1.
    """
    offset = observation["desired_goal"].astype(float) - observation["achieved_goal"]
    return np.clip(offset / Reach.finger.stride, -1.0, 1.0)
