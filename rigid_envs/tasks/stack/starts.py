"""How episodes of Stack start: cells of a grid, a part of the tower, and the hand at a cube."""

from typing import NamedTuple

import numpy as np

from rigid_envs.tasks.grasping.hand import Hand
from rigid_envs.tasks.stack.tower import HALF

Array = np.ndarray

# cubes and tower stand on different cells of a 3 x 3 grid about the origin
CELL = 0.12  # m, width of a cell
JITTER = 0.01  # m, largest offset from the middle of a cell along x and y
CELL_CENTERS = CELL * np.array([[x, y] for x in (-1, 0, 1) for y in (-1, 0, 1)])
# m, largest offset along x and y, and largest height above its goal, of a cube that is held at the
# start
HELD_OFFSET, HELD_HEIGHT = 0.05, 0.08


def random_cells(draws: Array, number: int) -> Array:
    """Positions [n, number, 2] m near the centres of different cells.

    Args:
        draws: [n, 9 + 2 number] random numbers: one for each cell, two for each offset.
        number: how many positions.
    """
    cells = len(CELL_CENTERS)
    order = np.argsort(draws[:, :cells], axis=1)[:, :number]
    offset = draws[:, cells:].reshape(len(draws), number, 2)
    return CELL_CENTERS[order] + JITTER * (2.0 * offset - 1.0)


def built(draws: Array, probability: float, blocks: int) -> Array:
    """How many cubes [n] stand in the tower at the start.

    Args:
        draws: [n] random numbers.
        probability: fraction of episodes with a part of the tower: at least one cube and at most
            all but one, each number equally likely.
        blocks: number of cubes.
    """
    # positive in the chosen fraction of episodes, where it is uniform in (0, 1]
    progress = 1.0 - draws / probability
    return np.maximum(np.ceil(progress * (blocks - 1)), 0.0).astype(int)


class Grasp(NamedTuple):
    """A cube between closed fingers, see `Hand.settled_grasp`.

    Attributes:
        pads: [1, 2, 3] m.
        cube: [1, 1, 3] m.
    """

    pads: Array
    cube: Array


def hand_at_cube(
    hand: Hand, grasp: Grasp, cube: Array, goal: Array, size: Array, largest_size: Array,
    draws: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Positions of the cubes [n, 3] m and pads [n, 2, 3] m where the hand starts at a cube.

    In half of the episodes the cube lies between the open fingers. In the others, the closed
    fingers hold it near its goal.

    Args:
        hand: the gripper.
        grasp: a held cube of size 1.
        cube: [n, 3] m, where the cube is.
        goal: [n, 3] m, where it belongs.
        size: [n], factor of its width.
        largest_size: [n], that of the largest cube.
        draws: [n, 4] random numbers.
    """
    held = draws[:, 0] < 0.5
    open_pads = hand.pad_positions(np.maximum(cube, hand.low))
    held_cube = _held_position(hand, goal, size, largest_size, draws[:, 1:])
    closed_pads = held_cube[:, None] + grasp.pads - grasp.cube
    closed_pads[:, :, 1] += HALF * (size - 1.0)[:, None] * (-1.0, 1.0)
    return (
        np.where(held[:, None], held_cube, cube),
        np.where(held[:, None, None], closed_pads, open_pads),
    )


def _held_position(
    hand: Hand, goal: Array, size: Array, largest_size: Array, draws: Array
) -> Array:
    """Positions [n, 3] m of held cubes: near their goal, clear of all other cubes.

    Cubes in the cells around the goal have at most the size `largest_size` [n]. Cube and pads have
    to stay clear of them. The pads reach further along y than the cube, and further down than a
    small cube.
    """
    room = CELL - 2.0 * JITTER - HALF * (size + largest_size)
    room = np.stack([room, room - 2.0 * hand.PAD], axis=1)
    offset = np.empty_like(goal)
    offset[:, :2] = np.minimum(np.maximum(room, 0.0), HELD_OFFSET) * (2.0 * draws[:, :2] - 1.0)
    offset[:, 2] = np.maximum(hand.PAD - HALF * size, 0.0) + HELD_HEIGHT * draws[:, 2]
    return np.maximum(goal + offset, hand.low)
