"""A controller for PickAndPlace."""

import numpy as np

from rigid_envs.tasks.grasping.hand import Hand
from rigid_envs.tasks.grasping.pick_and_place import HALF, PickAndPlace

Array = np.ndarray

# m, opening beyond the cube's width below which the fingers hold it
_HOLDS = 0.006
# m, horizontal offset at which the hand comes down, and from which it rises; its slope
_FUNNEL, _SLOPE, _CLEAR = 0.008, 2.0, 0.06
_AROUND = 0.012  # m, offset from the cube along each axis at which the fingers close
_FOOT = 0.003  # m, least height of the pads above the ground
OPEN, CLOSE = 1.0, -1.0
_CUBE = len(Hand.bounds)


def pick_and_place(observation: dict[str, Array]) -> Array:
    """Lowers the open hand around the cube, closes it, and carries the cube to the goal.

    Args:
        observation: Of PickAndPlace.

    Returns:
        [n, 4] actions within ±1.
    """
    values = observation["observation"].astype(float)
    hand, reference, opening = values[:, 0:3], values[:, 8:11], values[:, 6]
    cube, goal = values[:, _CUBE : _CUBE + 3], observation["desired_goal"].astype(float)
    grasp = cube.copy()  # where the hand grasps: lower pads would touch the ground
    grasp[:, 2] = np.maximum(grasp[:, 2], Hand.PAD + _FOOT)
    away = grasp - hand
    around = np.all(np.abs(away) < _AROUND, axis=1)
    holds = around & (opening < 2.0 * HALF + _HOLDS)
    across = np.hypot(away[:, 0], away[:, 1])
    target = grasp.copy()
    target[:, 2] += np.clip(_SLOPE * (across - _FUNNEL), 0.0, _CLEAR)
    # a held cube hangs below the reference, so the offset to the goal is added to that
    target = np.where(holds[:, None], reference + goal - cube, target)
    actions = np.empty((len(values), 4))
    actions[:, :3] = (target - reference) / PickAndPlace.hand.stride
    actions[:, 3] = np.where(around, CLOSE, OPEN)
    return np.clip(actions, -1.0, 1.0)
