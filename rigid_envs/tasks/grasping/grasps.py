"""Starts of episodes with the open hand around an object, and reward terms of a grasp.

Fingers close along y.
"""

from collections.abc import Callable

import numpy as np

from physics import World
from rigid_envs.tasks.rewards import distance

Array = np.ndarray

NEAR_GRASP_DRAWS = 5
# m, of the hand's offset from the object: half of it to either side, all of it upwards
_RANGE = 0.03
_GAP = 0.015  # m, largest between a finger and the object
_NEAR = 0.02  # m, of the hand from an object that it holds
# m, how far a finger that holds an object may be from its face: pressed into it, and away from it
_DEEP, _AWAY = 0.005, 0.0025


def start_near_grasps(
    world: World,
    mask: Array,
    draws: Array,
    probability: float,
    pads: Callable[[Array, Array], Array],
    half: float,
    body: Array | int = 0,
    closed: float = 0.0,
) -> tuple[Array, Array]:
    """Moves the open hand around a body, or just above it, in some worlds that were just reset.

    Args:
        world: the worlds.
        mask: [count] bool, those that have been reset; n of them.
        draws: [n, NEAR_GRASP_DRAWS] uniform in [0, 1).
        probability: of moving the hand.
        pads: positions [k, 2, 3] m of the fingers from the hand's [k, 3] m and how far each finger
            is open, [k] m.
        half: m, half the width of the body.
        body: [n] its index.
        closed: part of these starts in which the fingers already touch the body.

    Returns:
        Which worlds' hands were moved, [count] bool, and to where, [k, 3] m.
    """
    near = draws[:, 0] < probability
    chosen = mask.copy()
    chosen[mask] = near
    if not near.any():
        return chosen, np.zeros((0, 3))
    middle = world.position[np.flatnonzero(chosen), np.broadcast_to(body, len(draws))[near]]
    middle = middle + _RANGE * (draws[near, 1:4] - (0.5, 0.5, 0.0))
    gap = _GAP * np.maximum(draws[near, 4] - closed, 0.0) / (1.0 - closed)
    world.set_state(drive_position=pads(middle, half + gap), worlds=chosen)
    return chosen, middle


def grasp_terms(
    hand: Array, opening: Array, position: Array, half: Array | float
) -> dict[str, Array]:
    """Terms of the object to grasp.

    Args:
        hand: [count, 3] m, position of the hand.
        opening: [count] m, how far each finger is open.
        position: [count, 3] m, of the object.
        half: m, half its width, or [count].

    Returns:
        `reach`: minus the distance in m from the hand to the object. `grasp`: 1 where the fingers
        are closed on it.
    """
    away = distance(hand, position)
    gap = opening - half
    closed = (away < _NEAR) & (gap > -_DEEP) & (gap < _AWAY)
    return {"reach": -away, "grasp": closed.astype(float)}
