"""A controller for Slide."""

import numpy as np

from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.slide import FRICTION, GRAVITY, RADIUS, Slide

Array = np.ndarray

# m, distance of the finger from the puck's centre at which a push starts, and up to which it lasts
_BEHIND, _TOUCHING = RADIUS + Finger.RADIUS + 0.04, RADIUS + Finger.RADIUS + 0.005
# m, largest distance from the line through puck and goal: at the start of a push, and during it
_ALIGNED, _ASIDE = 0.0015, 0.02
# m, tolerance of the place behind the puck at which the finger comes down
_OVER = 0.006
# m, height at which the finger moves around the puck, and pushes it
_TRAVEL, _LEVEL = 0.06, 0.016
# how much slower than the puck should be the finger pushes, as the puck rebounds from it; m, how
# far they move together
_REBOUND, _PUSH = 0.96, 0.03


def slide(observation: dict[str, Array]) -> Array:
    """Moves behind the puck and pushes it until it is fast enough to slide to the goal.

    Args:
        observation: Of Slide.

    Returns:
        [n, 3] actions within ±1.
    """
    values = observation["observation"].astype(float)
    finger, puck, velocity = values[:, 0:3], values[:, 6:9], values[:, 13:16]
    to_goal = (observation["desired_goal"] - puck)[:, :2]
    far = np.sqrt(np.sum(to_goal**2, axis=1))
    direction = to_goal / np.maximum(far, 1e-9)[:, None]
    place = puck[:, :2] - _BEHIND * direction

    offset = finger[:, :2] - puck[:, :2]
    along = np.sum(offset * direction, axis=1)
    aside = offset - along[:, None] * direction
    room = np.where(along < -_TOUCHING, _ALIGNED, _ASIDE)
    behind = (along < -RADIUS) & (np.sqrt(np.sum(aside**2, axis=1)) < room)
    over = np.sqrt(np.sum((finger[:, :2] - place) ** 2, axis=1)) < _OVER

    target = np.empty_like(finger)
    target[:, :2], target[:, 2] = place, np.where(over | behind, _LEVEL, _TRAVEL)
    pushing = behind & (finger[:, 2] < _LEVEL + 0.01)
    stride = Slide.frame * _REBOUND * _speed(np.maximum(far - _PUSH, 0.0))
    pushed = finger[:, :2] + stride[:, None] * direction - 0.8 * aside
    target[pushing, :2], target[pushing, 2] = pushed[pushing], _LEVEL
    done = np.sum(velocity[:, :2] * direction, axis=1) > _speed(far)
    done |= puck[:, 0] > Slide.finger.high[0]
    target[done] = finger[done]
    return np.clip((target - finger) / Slide.finger.stride, -1.0, 1.0)


def _speed(far: Array) -> Array:
    """The speed m/s at which a puck slides `far` m."""
    return np.asarray(np.sqrt(2.0 * FRICTION * GRAVITY * far))
