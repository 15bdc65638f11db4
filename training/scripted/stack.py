"""A controller for Stack with any number of cubes.

It is smooth where it can be: the path to a place is a funnel, whose height grows with the
horizontal distance, and errors are corrected on the way down. So it solves Stack with noise on its
actions, too, and can be imitated.
"""

import numpy as np

from rigid_envs.tasks.grasping.hand import Hand
from rigid_envs.tasks.stack import Stack

Array = np.ndarray

# m, distance from its goal and height above its support at which a cube counts as placed
_PLACED, _RESTS = 0.017, 0.003
# m, opening beyond a cube's width: below it the fingers hold the cube; above it they are clear
_HOLDS, _CLEAR_OPENING = 0.003, 0.014
# m, least height of the pads above the bottom of a cube, so that they miss a wider cube under it
_FOOT = 0.003
# m, clearance above all cubes at which pads or a carried cube move sideways
_CLEAR = 0.015
# height per horizontal distance beyond the width of the funnel; m, that width for the open hand
# and for a carried cube
_SLOPE, _HAND_FUNNEL, _CUBE_FUNNEL = 2.0, 0.01, 0.015
# horizontal error at which a cube is released: of two cubes, of half their width; m, of higher
# towers, which fall if their cubes are not in line
_ALIGNED, _IN_LINE = 0.2, 0.0003
# m, above its place and below it, to which a cube is lowered before and while it is aligned
_HOVER, _PRESS = 0.004, 0.002
# m and m/s, height above its place and speed of the hand at which a cube is released
_LOW, _SLOW = 0.005, 0.2
OPEN, CLOSE = 1.0, -1.0
_CUBE = (len(Stack(blocks=2).bounds) - len(Hand.bounds)) // 2  # components of a cube's observation

# The servo is critically damped: after a step of T the hand is d (1 + w T) exp(-w T) +
# v T exp(-w T) from its reference, where d is its distance and v its velocity now
_TURN = Hand.SERVO_FREQUENCY * Stack.frame
_KEPT, _GLIDE = (1.0 + _TURN) * np.exp(-_TURN), Stack.frame * np.exp(-_TURN)


def stack(observation: dict[str, Array]) -> Array:
    """Takes the lowest misplaced cube, lowers it onto its place from above, and releases it.

    Args:
        observation: Of Stack with any number of cubes.

    Returns:
        [n, 4] actions within ±1.
    """
    values = observation["observation"].astype(float)
    goals = observation["desired_goal"][:, :-1].astype(float)
    count, n = len(values), goals.shape[1] // 3
    worlds, goals = np.arange(count), goals.reshape(count, n, 3)
    hand, velocity = values[:, 0:3], values[:, 3:6]
    opening, reference = values[:, 6], values[:, 8:11]
    first, last = len(Hand.bounds), len(Hand.bounds) + n * _CUBE  # the guide may follow
    cubes = values[:, first:last].reshape(count, n, _CUBE)[:, :, 0:3]

    halves = _half_widths(goals)
    tops = cubes[:, :, 2] + halves
    support = np.concatenate([np.zeros((count, 1)), tops[:, :-1]], axis=1)
    # where the hand grasps each cube: lower pads would touch the ground or the cube below
    grasps = cubes.copy()
    grasps[:, :, 2] += np.maximum(Hand.PAD + _FOOT - halves, 0.0)
    held = np.abs(hand[:, None] - grasps).max(axis=2) < 0.75 * halves
    held &= opening[:, None] < 2.0 * halves + _HOLDS
    rests = cubes[:, :, 2] - halves - support < _RESTS
    placed = rests & (np.sqrt(np.sum((cubes - goals) ** 2, axis=2)) < _PLACED) & ~held
    done = placed.all(axis=1)
    which = np.where(done, 0, np.argmin(placed, axis=1))
    cube, half, holds = cubes[worlds, which], halves[worlds, which], held[worlds, which]
    place = goals[worlds, which]
    on_tower = which > 0  # the tower may have shifted: continue where its top cube is
    place[on_tower, :2] = cubes[worlds, which - 1][on_tower, :2]
    place[on_tower, 2] = (tops[worlds, which - 1] + half)[on_tower]

    # either the cube moves to its place, or the open hand to the cube
    start = np.where(holds[:, None], cube, hand)
    end = np.where(holds[:, None], place, grasps[worlds, which])
    move = np.where(done[:, None], 0.0, end - start)
    off = np.hypot(*move[:, :2].T)
    others = np.where(holds[:, None] & (np.arange(n) == which[:, None]), 0.0, tops)
    level = np.maximum(others.max(axis=1) + np.where(holds, half, Hand.PAD), end[:, 2]) + _CLEAR
    funnel = np.where(holds, _CUBE_FUNNEL, _HAND_FUNNEL)
    height = np.minimum(end[:, 2] + _SLOPE * np.maximum(off - funnel, 0.0), level)
    height[done] = level[done]
    nearby = np.maximum(off, np.abs(move[:, 2])) < np.minimum(_HAND_FUNNEL, 0.5 * half)
    grasps_now = ~holds & ~done & nearby
    # a cube is released where the servo would leave it, if it does not move fast
    drift = (1.0 - _KEPT) * (reference - hand) + _GLIDE * velocity
    ahead = np.hypot(*(move - drift)[:, :2].T)
    aligned = np.maximum(off, ahead) < (_ALIGNED * half if n == 2 else _IN_LINE)
    height[holds] += np.where(aligned, -_PRESS, _HOVER)[holds]
    slow = np.abs(velocity).max(axis=1) < _SLOW
    releases = holds & aligned & slow & (cube[:, 2] < place[:, 2] + _LOW)

    # sideways only above what is in the way
    move[:, :2] *= np.clip((start[:, 2] - height) / (0.5 * _CLEAR) + 1.0, 0.0, 1.0)[:, None]
    move[:, 2] = height - start[:, 2]
    opens = ~holds & (opening < 2.0 * half + _CLEAR_OPENING)
    move[(opens & ~grasps_now) | releases] = 0.0
    strides = np.clip((hand + move - reference) / Stack.hand.stride, -1.0, 1.0)
    grip = np.where((holds & ~releases) | grasps_now, CLOSE, OPEN)
    return np.concatenate([strides, grip[:, None]], axis=1)


def _half_widths(goals: Array) -> Array:
    """Half the widths [n, cubes] m of the cubes, from their goals [n, cubes, 3] m."""
    halves = np.zeros(goals.shape[:2])
    top = np.zeros(len(goals))
    for i in range(goals.shape[1]):
        halves[:, i] = goals[:, i, 2] - top
        top = goals[:, i, 2] + halves[:, i]
    return halves
