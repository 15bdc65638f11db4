"""Starts of episodes in which the open hand is around an object, or just above it."""

from collections.abc import Callable

import numpy as np

from physics import World

Array = np.ndarray

NEAR_GRASP_DRAWS = 5
_RANGE = (
    0.03  # m, of the hand's offset from the object: half of it to either side, all of it upwards
)
_GAP = 0.015  # m, largest between a finger and the object


def start_near_grasps(
    world: World,
    mask: Array,
    draws: Array,
    probability: float,
    pads: Callable[[Array, Array], Array],
    half: float,
) -> None:
    """Moves the hand around the first body in some of the worlds that have just been reset.

    Args:
        world: the worlds.
        mask: [count] bool, those that have been reset; n of them.
        draws: [n, NEAR_GRASP_DRAWS] uniform in [0, 1).
        probability: of moving the hand.
        pads: positions [n, 2, 3] m of the fingers from the hand's [n, 3] m and openings [n] m.
        half: m, half the width of the body.
    """
    near = draws[:, 0] < probability
    if not near.any():
        return
    chosen = mask.copy()
    chosen[mask] = near
    middle = world.position[chosen, 0] + _RANGE * (draws[near, 1:4] - (0.5, 0.5, 0.0))
    opening = half + _GAP * draws[near, 4]
    world.set_state(drive_position=pads(middle, opening), worlds=chosen)
