"""A controller of Stack, for any number of cubes."""

import numpy as np

from rigid_envs.tasks.hand import Hand
from rigid_envs.tasks.stack import Stack

Array = np.ndarray

# m of its goal at which a cube counts as placed, and of a place at which the hand is over it
_PLACED, _OVER = 0.017, 0.004
# m above what is under it at which a cube rests on it
_RESTS = 0.001
# m beside the tower at which a cube may be set down, and m above it until it is so near
_TRUE, _ABOVE = 0.0003, 0.003
# m below its place to which it is pressed, and m/s at which it stands still
_PRESS, _STILL = 0.004, 0.01
# m of opening beyond a cube's width: below, the fingers hold it; above, they are free of it
_HOLDS, _FREE = 0.003, 0.014
# m that pads stay above the foot of a cube, so that they don't meet a wider one under it
_FOOT = 0.003
# m above what stands at which pads or a cube travel
_CLEAR = 0.015
# m/s
_SLOW = 0.2
OPEN, CLOSE = 1.0, -1.0


def stack(observation: dict[str, Array]) -> Array:
    """Takes the lowest cube that isn't in its place, carries it there from above, and lets go."""
    values = observation["observation"].astype(float)
    goals = observation["desired_goal"][:, :-1].astype(float)
    count, n = len(values), goals.shape[1] // 3
    worlds, goals = np.arange(count), goals.reshape(count, n, 3)
    hand, velocity = values[:, 0:3], values[:, 3:6]
    opening, reference = values[:, 6], values[:, 8:11]
    seen = values[:, len(Hand.bounds) :].reshape(count, n, -1)
    cubes, motion = seen[:, :, 0:3], seen[:, :, 7:10]

    halves = _halves(goals)
    tops = cubes[:, :, 2] + halves
    under = np.concatenate([np.zeros((count, 1)), tops[:, :-1]], axis=1)
    rests = cubes[:, :, 2] - halves - under < _RESTS
    placed = rests & (np.sqrt(np.sum((cubes - goals) ** 2, axis=-1)) < _PLACED)
    done = placed.all(axis=1)
    which = np.where(done, 0, np.argmin(placed, axis=1))
    cube, goal, half = cubes[worlds, which], goals[worlds, which], halves[worlds, which]
    # where a hand takes it: low pads would meet the ground or what is under the cube
    grasp = cube.copy()
    grasp[:, 2] += np.maximum(Hand.PAD + _FOOT - half, 0.0)
    near = np.abs(hand - grasp).max(axis=1) < 0.75 * half
    holds = near & (opening < 2.0 * half + _HOLDS) & ~done

    # with a cube: up, across, down, and open
    below = goal.copy()
    on_tower = which > 0
    below[on_tower, :2] = cubes[worlds, which - 1][on_tower, :2]
    carried_one = holds[:, None] & (np.arange(n) == which[:, None])
    top = np.where(carried_one, 0.0, tops).max(axis=1)
    target, grip = hand.copy(), np.full(count, OPEN)
    still = np.abs(motion[worlds, which]).max(axis=1) < _STILL
    off = np.sqrt(np.sum((cube - below)[:, :2] ** 2, axis=1))
    there = off < np.where(cube[:, 2] < goal[:, 2] + 2.0 * _ABOVE, _TRUE, _OVER)
    low = there & (cube[:, 2] < goal[:, 2] + 0.001) & still
    carried = np.maximum(top + half, goal[:, 2]) + _CLEAR
    slow = np.abs(velocity[:, :2]).max(axis=1) < _SLOW
    up = holds & ((off > 2.0 * _OVER) | ~slow) & ~(there & (cube[:, 2] < carried - _CLEAR))
    grip[up | (holds & ~low)] = CLOSE
    target[up, 2] = (carried + hand[:, 2] - cube[:, 2])[up]
    across = up & (cube[:, 2] > carried - 0.5 * _CLEAR)
    target[across, :2] += (below - cube)[across, :2]
    down = holds & ~up & ~low
    target[down] += (below - cube)[down]
    target[down, 2] += np.where(there, -_PRESS, _ABOVE)[down]
    # without: free of what stands, up, across, down, and close
    free = ~holds & (opening > 2.0 * half + _FREE)
    travel = top + Hand.PAD + _CLEAR
    over = np.sqrt(np.sum((cube - hand)[:, :2] ** 2, axis=1)) < _OVER
    over &= np.abs(velocity[:, :2]).max(axis=1) < _SLOW
    beside = over & (np.abs(hand[:, 2] - grasp[:, 2]) < _OVER) & ~done
    rise = free & (~over | done)
    target[rise, 2] = travel[rise]
    across = rise & ~done & (hand[:, 2] > travel - 0.5 * _CLEAR)
    target[across, :2] = cube[across, :2]
    fetch = free & over & ~done
    target[fetch] = grasp[fetch]
    grip[~holds & beside] = CLOSE

    strides = np.clip((target - reference) / Stack.hand.stride, -1.0, 1.0)
    return np.concatenate([strides, grip[:, None]], axis=1)


def _halves(goals: Array) -> Array:
    """Half the widths [n, cubes] m of cubes by their places in the tower [n, cubes, 3] m."""
    halves = np.zeros(goals.shape[:2])
    top = np.zeros(len(goals))
    for i in range(goals.shape[1]):
        halves[:, i] = goals[:, i, 2] - top
        top = goals[:, i, 2] + halves[:, i]
    return halves
