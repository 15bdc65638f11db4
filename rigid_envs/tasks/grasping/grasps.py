"""Starts of episodes with the open hand around an object, and reward terms of a grasp.

Fingers close along y.
"""

from collections.abc import Callable

import numpy as np

from physics import World
from rigid_envs.tasks.rewards import distance

Array = np.ndarray

NEAR_GRASP_DRAWS = 5
# m, largest offset of the hand from the object: to either side along x, and upwards
_ASIDE, _UP = 0.015, 0.03
_GAP = 0.015  # m, largest between a finger and the object
_NEAR = 0.02  # m, of the hand from an object that it holds
# m, how far a finger that holds an object may be from its face: pressed into it, and away from it
_DEEP, _AWAY = 0.005, 0.0025


def start_near_grasps(
    world: World,
    mask: Array,
    draws: Array,
    probability: Array | float,
    pads: Callable[[Array, Array], Array],
    half: Array | float,
    body: Array | int = 0,
    closed: float = 0.0,
    lowest: float = 0.0,
) -> tuple[Array, Array]:
    """Moves the open hand around a body, or just above it, in some worlds that were just reset.

    The body stands upright, with its sides along x and y. No finger is in it.

    Args:
        world: the worlds.
        mask: [count] bool, those that have been reset; n of them.
        draws: [n, NEAR_GRASP_DRAWS] uniform in [0, 1).
        probability: of moving the hand, [n] or one number.
        pads: positions [k, 2, 3] m of the fingers from the hand's [k, 3] m and how far each finger
            is open, [k] m.
        half: m, half the width of the body, [n] or one number.
        body: [n] its index.
        closed: part of these starts in which the fingers already touch the body.
        lowest: m, least height of the hand.

    Returns:
        Which worlds' hands were moved, [count] bool, and to where, [k, 3] m.
    """
    near = draws[:, 0] < probability
    chosen = mask.copy()
    chosen[mask] = near
    if not near.any():
        return chosen, np.zeros((0, 3))
    middle = world.position[np.flatnonzero(chosen), np.broadcast_to(body, len(draws))[near]]
    gap = _GAP * np.maximum(draws[near, 4] - closed, 0.0) / (1.0 - closed)
    aside, along, up = draws[near, 1:4].T
    middle[:, 0] += _ASIDE * (2.0 * aside - 1.0)
    middle[:, 1] += gap * (2.0 * along - 1.0)
    middle[:, 2] = np.maximum(middle[:, 2] + _UP * up, lowest)
    opening = np.broadcast_to(half, len(draws))[near] + gap
    world.set_state(drive_position=pads(middle, opening), drive_velocity=0.0, worlds=chosen)
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
