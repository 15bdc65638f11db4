"""A controller of Throw."""

import numpy as np

from rigid_envs.tasks.hand import Hand
from rigid_envs.tasks.throw import GRAVITY, Throw

Array = np.ndarray

# m, through which the swing leads; rad, its rise; m, how far before it begins
_THROUGH, _RISE, _SWING = np.array([0.14, 0.0, 0.46]), 0.6, 0.5
# m beside the goal at which the ball may land, let go now
_CLOSE_BY = 0.03
# s that the fingers take to let go
_DELAY = 0.008
OPEN, CLOSE = 1.0, -1.0


def _miss(point: Array, motion: Array, goal: Array) -> Array:
    """Distance in m of a goal from where a ball with this motion lands."""
    rise = motion[:, 2]
    height = np.maximum(point[:, 2] - goal[:, 2], 0.0)
    flight = (rise + np.sqrt(rise**2 + 2.0 * GRAVITY * height)) / GRAVITY
    lands = point[:, :2] + flight[:, None] * motion[:, :2]
    return np.sqrt(np.sum((goal[:, :2] - lands) ** 2, axis=1))


def _launch(point: Array, goal: Array) -> Array:
    """Velocity in m/s, at the rise of the swing, that takes a ball from a point to the goal."""
    way = (goal - point)[:, :2]
    far = np.sqrt(np.sum(way**2, axis=1, keepdims=True))
    drop = np.maximum(point[:, 2:] - goal[:, 2:] + far * np.tan(_RISE), 0.05)
    level = far * np.sqrt(0.5 * GRAVITY / drop)
    return np.concatenate([level * way / far, level * np.tan(_RISE)], axis=1)


def throw(observation: dict[str, Array]) -> Array:
    """Draws back, swings at the speed that would hit from here, and lets go when it will."""
    values = observation["observation"].astype(float)
    goal = observation["desired_goal"].astype(float)
    first = len(Hand.bounds)
    hand, velocity, reference = values[:, 0:3], values[:, 3:6], values[:, 8:11]
    ball, speed = values[:, first : first + 3], values[:, first + 3 : first + 6]
    radius = goal[:, 2]  # at which a ball lies on the ground
    held = (np.abs(ball - hand).max(axis=1) < 1.5 * radius) & (values[:, first + 9] == 0.0)

    swing = _launch(np.broadcast_to(_THROUGH, goal.shape), goal)
    ahead = swing / np.sqrt(np.sum(swing**2, axis=1, keepdims=True))
    back = _THROUGH - _SWING * ahead
    ready = (np.abs(hand - back).max(axis=1) < 0.01) & (np.abs(velocity).max(axis=1) < 0.3)
    swinging = ready | (np.sum(velocity * ahead, axis=1) > 0.3)

    wanted = _launch(ball, goal)
    target = back.copy()
    target[swinging] = (hand + Throw.frame * wanted)[swinging]
    now = _miss(ball + _DELAY * speed, speed, goal)
    later = _miss(ball + (_DELAY + Throw.frame) * wanted, wanted, goal)
    late = hand[:, 0] > _THROUGH[0] - 0.08
    go = swinging & ((now < _CLOSE_BY) | (late & (now < later + 0.05)))
    grip = np.where(held & ~go, CLOSE, OPEN)
    strides = np.clip((target - reference) / Throw.hand.stride, -1.0, 1.0)
    strides[~held] = 0.0
    return np.concatenate([strides, grip[:, None]], axis=1)
