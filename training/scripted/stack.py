"""A controller of Stack, for any number of cubes."""

import numpy as np

from rigid_envs.tasks.hand import Hand
from rigid_envs.tasks.stack import HALF, Stack

Array = np.ndarray

# m of its goal at which a cube counts as placed, and of a place at which the hand is over it
_PLACED, _OVER = 0.017, 0.004
# m above what is under it at which a cube rests on it
_RESTS = 0.001
# m beside the tower at which a cube may be set down, and m above it until it is so near
_TRUE, _ABOVE = 0.0003, 0.003
# m below its place to which it is pressed, and m/s at which it stands still
_PRESS, _STILL = 0.004, 0.01
# m of opening: below, the fingers hold a cube; above, they are free of one
_HOLDS, _FREE = 2.0 * HALF + 0.003, 2.0 * HALF + 0.014
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

    under = np.concatenate([np.full((count, 1), -HALF), cubes[:, :-1, 2]], axis=1)
    rests = cubes[:, :, 2] - under < 2.0 * HALF + _RESTS
    placed = rests & (np.sqrt(np.sum((cubes - goals) ** 2, axis=-1)) < _PLACED)
    done = placed.all(axis=1)
    which = np.where(done, 0, np.argmin(placed, axis=1))
    cube, goal = cubes[worlds, which], goals[worlds, which]
    holds = (np.abs(hand - cube).max(axis=1) < 0.75 * HALF) & (opening < _HOLDS) & ~done

    # with a cube: up, across, down, and open
    below = goal.copy()
    on_tower = which > 0
    below[on_tower, :2] = cubes[worlds, which - 1][on_tower, :2]
    highest = np.where(holds[:, None] & (np.arange(n) == which[:, None]), 0.0, cubes[:, :, 2])
    top = highest.max(axis=1) + HALF
    target, grip = hand.copy(), np.full(count, OPEN)
    still = np.abs(motion[worlds, which]).max(axis=1) < _STILL
    off = np.sqrt(np.sum((cube - below)[:, :2] ** 2, axis=1))
    there = off < np.where(cube[:, 2] < goal[:, 2] + 2.0 * _ABOVE, _TRUE, _OVER)
    low = there & (cube[:, 2] < goal[:, 2] + 0.001) & still
    carried = np.maximum(top + HALF, goal[:, 2]) + _CLEAR
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
    free = ~holds & (opening > _FREE)
    travel = top + Hand.PAD + _CLEAR
    over = np.sqrt(np.sum((cube - hand)[:, :2] ** 2, axis=1)) < _OVER
    over &= np.abs(velocity[:, :2]).max(axis=1) < _SLOW
    beside = over & (np.abs(hand[:, 2] - cube[:, 2]) < _OVER) & ~done
    rise = free & (~over | done)
    target[rise, 2] = travel[rise]
    across = rise & ~done & (hand[:, 2] > travel - 0.5 * _CLEAR)
    target[across, :2] = cube[across, :2]
    fetch = free & over & ~done
    target[fetch] = cube[fetch]
    grip[~holds & beside] = CLOSE

    strides = np.clip((target - reference) / Stack.hand.stride, -1.0, 1.0)
    return np.concatenate([strides, grip[:, None]], axis=1)
