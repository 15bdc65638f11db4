"""The cubes of Stack, their tower, and which cube is to be placed next."""

from typing import NamedTuple

import numpy as np

from rigid_envs.tasks.rewards import distance

Array = np.ndarray

HALF = 0.02  # m, half the width of a cube
MASS = 0.1  # kg
THRESHOLD = 0.02  # m


def tower(place: Array, size: Array) -> Array:
    """Positions [n, blocks, 3] m of stacked cubes.

    Args:
        place: [n, 2] m, where the tower stands.
        size: [n, blocks] factors of the cubes' widths, from the bottom.
    """
    positions = np.empty((*size.shape, 3))
    positions[:, :, :2] = place[:, None]
    positions[:, :, 2] = HALF * (2.0 * np.cumsum(size, axis=1) - size)
    return positions


class NextCube(NamedTuple):
    """The cube to place next in each world: the lowest that is not placed, or the last cube.

    Attributes:
        placed: [count] number of cubes, counted from the bottom, that are at their goal and not
            held.
        position: [count, 3] m, where the cube is.
        goal: [count, 3] m, where it belongs.
        held: [count] whether both fingers press on it from its sides.
        largest_distance: [count] m, of any cube from its goal.
    """

    placed: Array
    position: Array
    goal: Array
    held: Array
    largest_distance: Array


def next_cube(achieved: Array, desired: Array, hand: Array, finger_forces: Array) -> NextCube:
    """The cube to place next.

    Args:
        achieved: [count, 3 blocks + 1], achieved goals.
        desired: [count, 3 blocks + 1], desired goals.
        hand: [count, 3] m, position of the hand.
        finger_forces: [blocks, 2, count] N, normal forces between each cube and each finger.
    """
    n = len(finger_forces)
    # [blocks, 3, count]: NumPy is faster where the worlds come last, as in a readout
    cubes, places = (goals[:, :-1].T.reshape(n, 3, -1) for goals in (achieved, desired))
    distances = np.array([distance(a.T, b.T) for a, b in zip(cubes, places, strict=True)])
    at_goal = distances <= THRESHOLD
    # fingers that press on a cube from above do not hold it: closed fingers, or fingers around a
    # cube that stands on it
    same_height = np.abs(cubes[:, 2] - hand[:, 2]) < HALF
    held = same_height & (finger_forces.min(axis=1) > 0.0)
    placed, stands = np.zeros(len(achieved), dtype=int), True
    for i in range(n):
        stands = stands & at_goal[i] & ~held[i]
        placed += stands

    def of_next(values: Array) -> Array:  # of the last cube where all are placed
        chosen = values[0]
        for i in range(1, n):
            chosen = np.where(placed >= i, values[i], chosen)
        return chosen

    position, goal = (of_next(points).T.astype(float) for points in (cubes, places))
    return NextCube(placed, position, goal, of_next(held), distances.max(axis=0))
