"""The base class of twins: tasks with the interface of another suite's environment.

A twin has the spaces, units, order of observations, starts, goals, rewards and lengths of episodes
of its original, so a policy trained in one acts in the other. All lengths are in the original's
world frame.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from physics import Readout, World
from physics.scene.validation import instance
from rigid_envs.tasks.goals import Measure, points
from rigid_envs.tasks.rewards import Reward
from rigid_envs.tasks.task import Bounds, Task

Array = np.ndarray


class Twin(Task):
    """A task that another suite defines.

    Its dense reward is that of the original, minus the goal distance. Learners that don't relabel
    goals need more: with `shaped=True` the dense reward also guides the tool.

    Args:
        shaped: whether the dense reward has the weights of `shaping`.

    Attributes:
        original: id of the environment that it is a twin of.
        ends_on_success: whether success terminates an episode of the original.
        threshold: largest goal distance in m at which the task counts as solved.
        shaping: weights of the dense reward with `shaped=True`.
    """

    bounds_end_episodes = False
    original: ClassVar[str]
    ends_on_success: ClassVar[bool] = False
    threshold: ClassVar[float] = 0.05
    shaping: ClassVar[Mapping[str, float]] = {"distance": 1.0}

    def __init__(self, shaped: bool = False) -> None:
        """Chooses the weights of the dense reward."""
        self.shaped: bool = instance("shaped", shaped, bool)
        weights = self.shaping if self.shaped else {"distance": 1.0}
        self.reward = Reward(self.threshold, weights, measure=self.measure())

    def measure(self) -> Measure:
        """Of the goal distance; that of points in m."""
        return points

    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """Those of `guidance` with `shaped=True`, else none: the rest follows from the goals."""
        if not self.shaped:
            return {}
        return self.guidance(world, now, achieved, desired, goal_distance)

    def guidance(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """The terms of `shaping` that don't follow from the goals, as `terms` returns them."""
        return {}


def behind(achieved: Array, desired: Array, gap: float) -> Array:
    """The points [n, 3] m `gap` m behind objects [n, 3] m as seen from their goals [n, 3] m.

    They are at the height of the objects.
    """
    from_goal = (achieved - desired) * np.array([1.0, 1.0, 0.0])
    length = np.sqrt(np.sum(from_goal**2, axis=1, keepdims=True))
    return np.asarray(achieved + gap / np.maximum(length, 1e-6) * from_goal)


def components(limit: float, *names: str) -> Bounds:
    """Bounds of components that lie within ±limit, in the unit that the original has."""
    return tuple((name, "", -limit, limit) for name in names)


def along_axes(*names: str) -> tuple[str, ...]:
    """Each name with x, y and z after it."""
    return tuple(f"{name} {axis}" for name in names for axis in "xyz")
