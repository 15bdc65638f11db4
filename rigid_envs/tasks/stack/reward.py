"""The dense reward of Stack: terms of the cube that is placed next, and of a finished tower."""

import numpy as np

from rigid_envs.tasks.rewards import distance
from rigid_envs.tasks.stack.tower import HALF, THRESHOLD, NextCube

Array = np.ndarray

# of the terms of the reward, and of the next cube's terms within `stage`
WEIGHTS = {"success": 1.0, "stage": 1.0, "retreat": 0.3, "precision": 0.5}
STAGE_WEIGHTS = {"reach": 0.15, "grasp": 0.1, "place": 0.4, "release": 0.35}
# `place` of a cube that is not held, relative to that of one that is: cubes are to be carried, as a
# cube that is pushed along the ground cannot be placed on another (chosen by a few trials)
PUSHED = 0.2
RETREAT = 0.1  # m above the place of the top cube at which `retreat` is 1
DECAY_LENGTH = 0.15  # m of path after which `reach` and `place` fall to 1/e
# Paths lead over other cubes, at the height of their end plus PASS_HEIGHT (m). The extra height
# falls to 0 while the horizontal distance to the end falls from HALF + DESCENT to HALF (m). Rising
# counts CLIMB_FACTOR times, since a hand or a cube that moves low runs into other cubes
PASS_HEIGHT, DESCENT, CLIMB_FACTOR = 0.05, 0.04, 3.0


def reward_terms(cube: NextCube, blocks: int, hand: Array, opened: Array) -> dict[str, Array]:
    """Terms [count]; all but `placed` lie within 0 and 1.

    Args:
        cube: the cube to place next.
        blocks: number of cubes.
        hand: [count, 3] m, position of the hand.
        opened: [count] commanded opening of the fingers, as a fraction of the largest one.

    Returns:
        `placed`: number of cubes that stand in the tower and are not held.
        `reach`, `grasp`, `place`, `release`: terms of the next cube.
        `stage`: all of these in one number.
        `retreat`: rises with the hand above a finished tower.
        `precision`: higher the nearer the cubes of a finished tower are to their places.
    """
    all_placed = cube.placed == blocks
    at_goal = distance(cube.position, cube.goal) <= THRESHOLD
    # fingers around a cube are rewarded for starting to close, and for pressing firmly: a cube
    # that is held loosely slips when it is lifted
    around = np.all(np.abs(hand - cube.position) < HALF, axis=1)
    grip = np.where(
        cube.held, np.maximum(1.0 - opened, 0.5), around * np.minimum(1.0 - opened, 0.5)
    )
    terms = {
        "reach": proximity(path_length(hand, cube.position)),
        # 1 at the goal too, so that letting go of the cube there costs nothing
        "grasp": np.where(at_goal, 1.0, grip),
        "place": proximity(path_length(cube.position, cube.goal))
        * np.where(cube.held | at_goal, 1.0, PUSHED),
        # rises as soon as the action commands a weaker grip, before the fingers move; a grip that
        # still holds a cube of 4 cm earns less than half of it
        "release": at_goal * opened,
    }
    # `release` is kept where all are placed, so that opening the fingers still pays: they are then
    # clear of the tower
    terms = {
        name: term if name == "release" else np.where(all_placed, 1.0, term)
        for name, term in terms.items()
    }
    stage = sum(weight * terms[name] for name, weight in STAGE_WEIGHTS.items())
    above = hand[:, 2] - cube.goal[:, 2]
    return {
        "placed": cube.placed.astype(float),
        **terms,
        "stage": (np.minimum(cube.placed, blocks - 1) + stage) / blocks,
        "retreat": all_placed * np.clip(above / RETREAT, 0.0, 1.0),
        "precision": all_placed * np.maximum(1.0 - cube.largest_distance / THRESHOLD, 0.0),
    }


def path_length(start: Array, end: Array) -> Array:
    """Length [n] m of a path that leads up, across and down, from start to end, both [n, 3] m.

    The path passes over other cubes. With the length of a straight path instead, the reward would
    lead the hand into cubes that are in between, or keep it down next to the tower.
    """
    x, y, _ = (end - start).T
    across = np.sqrt(x**2 + y**2)
    clearance = PASS_HEIGHT * np.minimum(np.maximum((across - HALF) / DESCENT, 0.0), 1.0)
    level = np.maximum(start[:, 2], end[:, 2] + clearance)
    return CLIMB_FACTOR * (level - start[:, 2]) + across + np.abs(level - end[:, 2])


def proximity(length: Array) -> Array:
    """1 at a path length of 0 m; falls by 1/e with every `DECAY_LENGTH`."""
    return np.exp(-length / DECAY_LENGTH)
