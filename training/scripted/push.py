"""A controller of Push."""

import numpy as np

from rigid_envs.tasks.push import FINGER, HALF, STRIDE

Array = np.ndarray

# m above the ground at which the finger travels without touching the cube
_TRAVEL = 2.0 * HALF + FINGER + 0.02
# m of finger from the cube's centre at which pushing begins, and what may be beside the line
_BEHIND, _ASIDE = 1.5 * HALF + FINGER + 0.005, 0.012
# m of the goal at which the finger stops pushing
_DONE = 0.02


def push(observation: dict[str, Array]) -> Array:
    """Goes over the cube to the side away from the goal, down, and pushes along the line.

    Each step is decided from the present alone: a finger that has slipped off the line rises and
    comes down behind the cube again.
    """
    values = observation["observation"].astype(float)
    finger, cube = values[:, 0:3], values[:, 6:9]
    to_goal = (observation["desired_goal"] - observation["achieved_goal"])[:, :2].astype(float)
    apart = np.sqrt(np.sum(to_goal**2, axis=1, keepdims=True))
    ahead = to_goal / np.maximum(apart, 1e-9)
    from_cube = finger[:, :2] - cube[:, :2]
    along = np.sum(from_cube * ahead, axis=1)
    aside = from_cube - along[:, None] * ahead
    off = np.sqrt(np.sum(aside**2, axis=1))

    low = finger[:, 2] < HALF + 0.02
    behind = (along < -0.8 * (HALF + FINGER)) & (off < 2.0 * _ASIDE)
    place = cube[:, :2] - _BEHIND * ahead
    over = np.sqrt(np.sum((finger[:, :2] - place) ** 2, axis=1)) < _ASIDE

    target = np.empty_like(finger)
    target[:, :2], target[:, 2] = place, _TRAVEL
    rising = ~behind & (finger[:, 2] < _TRAVEL - 0.01)
    target[rising, :2] = finger[rising, :2]
    descending = over & ~low
    target[descending, 2] = HALF
    pushing = behind & low
    # slower near the goal, and back onto the line through the cube's centre
    stride = np.clip(0.6 * apart[:, 0], 0.004, 0.025)[:, None]
    steered = finger[:, :2] + stride * ahead - 0.8 * aside
    target[pushing, :2], target[pushing, 2] = steered[pushing], HALF
    solved = apart[:, 0] < _DONE
    target[solved] = finger[solved]
    return np.clip((target - finger) / STRIDE, -1.0, 1.0)
