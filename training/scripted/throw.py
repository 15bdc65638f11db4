"""A controller for Throw."""

import numpy as np

from rigid_envs.tasks.grasping.hand import Hand
from rigid_envs.tasks.throw import GRAVITY, Throw

Array = np.ndarray

# m, release point; rad, launch angle above the horizontal; m, length of the swing before it
_RELEASE, _ANGLE, _SWING = np.array([0.14, 0.0, 0.46]), 0.6, 0.5
# m, predicted miss at which the ball is released
_CLOSE_ENOUGH = 0.03
# s, delay of the fingers' opening
_DELAY = 0.008
OPEN, CLOSE = 1.0, -1.0


def throw(observation: dict[str, Array]) -> Array:
    """Moves back, swings at the speed that would hit the target, and releases the ball.

    Args:
        observation: Of Throw.

    Returns:
        [n, 4] actions within ±1.
    """
    values = observation["observation"].astype(float)
    goal = observation["desired_goal"].astype(float)
    first = len(Hand.bounds)
    hand, velocity, reference = values[:, 0:3], values[:, 3:6], values[:, 8:11]
    ball, speed = values[:, first : first + 3], values[:, first + 3 : first + 6]
    radius = goal[:, 2]  # the target is the centre of a ball on the ground
    held = (np.abs(ball - hand).max(axis=1) < 1.5 * radius) & (values[:, first + 9] == 0.0)

    swing = _launch_velocity(np.broadcast_to(_RELEASE, goal.shape), goal)
    direction = swing / np.sqrt(np.sum(swing**2, axis=1, keepdims=True))
    back = _RELEASE - _SWING * direction
    ready = (np.abs(hand - back).max(axis=1) < 0.01) & (np.abs(velocity).max(axis=1) < 0.3)
    swinging = ready | (np.sum(velocity * direction, axis=1) > 0.3)

    desired = _launch_velocity(ball, goal)
    target = back.copy()
    target[swinging] = (hand + Throw.frame * desired)[swinging]
    now = _miss(ball + _DELAY * speed, speed, goal)
    later = _miss(ball + (_DELAY + Throw.frame) * desired, desired, goal)
    late = hand[:, 0] > _RELEASE[0] - 0.08
    go = swinging & ((now < _CLOSE_ENOUGH) | (late & (now < later + 0.05)))
    grip = np.where(held & ~go, CLOSE, OPEN)
    strides = np.clip((target - reference) / Throw.hand.stride, -1.0, 1.0)
    strides[~held] = 0.0
    return np.concatenate([strides, grip[:, None]], axis=1)


def _miss(position: Array, velocity: Array, goal: Array) -> Array:
    """Distance [n] m between the goal and the landing point of a ball released now."""
    rise = velocity[:, 2]
    height = np.maximum(position[:, 2] - goal[:, 2], 0.0)
    flight = (rise + np.sqrt(rise**2 + 2.0 * GRAVITY * height)) / GRAVITY
    landing = position[:, :2] + flight[:, None] * velocity[:, :2]
    return np.sqrt(np.sum((goal[:, :2] - landing) ** 2, axis=1))


def _launch_velocity(position: Array, goal: Array) -> Array:
    """Velocity [n, 3] m/s, at the launch angle, that takes a ball from a position to the goal."""
    way = (goal - position)[:, :2]
    far = np.sqrt(np.sum(way**2, axis=1, keepdims=True))
    drop = np.maximum(position[:, 2:] - goal[:, 2:] + far * np.tan(_ANGLE), 0.05)
    level = far * np.sqrt(0.5 * GRAVITY / drop)
    return np.concatenate([level * way / far, level * np.tan(_ANGLE)], axis=1)
