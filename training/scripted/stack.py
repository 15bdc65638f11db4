"""A controller for Stack with any number of cubes."""

import numpy as np

from rigid_envs.tasks.hand import Hand
from rigid_envs.tasks.stack import Stack

Array = np.ndarray

# m, distance from its goal at which a cube counts as placed; m, tolerance of the hand over a place
_PLACED, _OVER = 0.017, 0.004
# m, height above its support at which a cube rests on it
_RESTS = 0.001
# m, sideways tolerance at which a cube is lowered; m, height above the tower until then
_ALIGNED, _ABOVE = 0.0003, 0.003
# m, target depth below the final place, to press the cube down; m/s, speed of a cube at rest
_PRESS, _STILL = 0.004, 0.01
# m, opening beyond a cube's width: below it the fingers hold the cube; above it they are clear
_HOLDS, _CLEAR_OPENING = 0.003, 0.014
# m, least height of the pads above the bottom of a cube, so that they miss a wider cube under it
_FOOT = 0.003
# m, clearance above all cubes at which pads or a carried cube move sideways
_CLEAR = 0.015
# m/s
_SLOW = 0.2
OPEN, CLOSE = 1.0, -1.0


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
    states = values[:, len(Hand.bounds) :].reshape(count, n, -1)
    cubes, motion = states[:, :, 0:3], states[:, :, 7:10]

    halves = _half_widths(goals)
    tops = cubes[:, :, 2] + halves
    support = np.concatenate([np.zeros((count, 1)), tops[:, :-1]], axis=1)
    rests = cubes[:, :, 2] - halves - support < _RESTS
    placed = rests & (np.sqrt(np.sum((cubes - goals) ** 2, axis=-1)) < _PLACED)
    done = placed.all(axis=1)
    which = np.where(done, 0, np.argmin(placed, axis=1))
    cube, goal, half = cubes[worlds, which], goals[worlds, which], halves[worlds, which]
    # where the hand grasps it: lower pads would touch the ground or the cube below
    grasp = cube.copy()
    grasp[:, 2] += np.maximum(Hand.PAD + _FOOT - half, 0.0)
    near = np.abs(hand - grasp).max(axis=1) < 0.75 * half
    holds = near & (opening < 2.0 * half + _HOLDS) & ~done

    # with a cube: up, sideways, down, open
    below = goal.copy()
    on_tower = which > 0
    below[on_tower, :2] = cubes[worlds, which - 1][on_tower, :2]
    carried_cube = holds[:, None] & (np.arange(n) == which[:, None])
    top = np.where(carried_cube, 0.0, tops).max(axis=1)
    target, grip = hand.copy(), np.full(count, OPEN)
    still = np.abs(motion[worlds, which]).max(axis=1) < _STILL
    off = np.sqrt(np.sum((cube - below)[:, :2] ** 2, axis=1))
    aligned = off < np.where(cube[:, 2] < goal[:, 2] + 2.0 * _ABOVE, _ALIGNED, _OVER)
    low = aligned & (cube[:, 2] < goal[:, 2] + 0.001) & still
    height = np.maximum(top + half, goal[:, 2]) + _CLEAR
    slow = np.abs(velocity[:, :2]).max(axis=1) < _SLOW
    up = holds & ((off > 2.0 * _OVER) | ~slow) & ~(aligned & (cube[:, 2] < height - _CLEAR))
    grip[up | (holds & ~low)] = CLOSE
    target[up, 2] = (height + hand[:, 2] - cube[:, 2])[up]
    sideways = up & (cube[:, 2] > height - 0.5 * _CLEAR)
    target[sideways, :2] += (below - cube)[sideways, :2]
    down = holds & ~up & ~low
    target[down] += (below - cube)[down]
    target[down, 2] += np.where(aligned, -_PRESS, _ABOVE)[down]
    # without a cube: clear of all cubes, up, sideways, down, close
    free = ~holds & (opening > 2.0 * half + _CLEAR_OPENING)
    travel = top + Hand.PAD + _CLEAR
    over = np.sqrt(np.sum((cube - hand)[:, :2] ** 2, axis=1)) < _OVER
    over &= np.abs(velocity[:, :2]).max(axis=1) < _SLOW
    at_grasp = over & (np.abs(hand[:, 2] - grasp[:, 2]) < _OVER) & ~done
    rise = free & (~over | done)
    target[rise, 2] = travel[rise]
    sideways = rise & ~done & (hand[:, 2] > travel - 0.5 * _CLEAR)
    target[sideways, :2] = cube[sideways, :2]
    fetch = free & over & ~done
    target[fetch] = grasp[fetch]
    grip[~holds & at_grasp] = CLOSE

    strides = np.clip((target - reference) / Stack.hand.stride, -1.0, 1.0)
    return np.concatenate([strides, grip[:, None]], axis=1)


def _half_widths(goals: Array) -> Array:
    """Half the widths [n, cubes] m of the cubes, from their goals [n, cubes, 3] m."""
    halves = np.zeros(goals.shape[:2])
    top = np.zeros(len(goals))
    for i in range(goals.shape[1]):
        halves[:, i] = goals[:, i, 2] - top
        top = goals[:, i, 2] + halves[:, i]
    return halves
