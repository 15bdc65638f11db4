"""What a task is: everything about an environment but the engine, the episode and Gymnasium."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from physics import Readout, Scene, World
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Sign
from rigid_envs.tasks.rewards import Reward

Array = np.ndarray


class Task(ABC):
    """A goal-conditioned task on many worlds at once; arrays have a leading world axis.

    Attributes:
        frame: s of one environment step.
        actions: names of the action's components, each within [-1, 1].
        bounds: name, unit, low and high of every component of the observation, in order.
        goal_bounds: likewise of a goal.
        guides: likewise of what `guide` writes; by default the way from achieved to desired goal.
        draws: random numbers that one episode's start takes.
        reward: how goals and reward terms make a reward.
        camera: that sees all of the task.
        sizes: least and largest factor of its bodies' sizes that `start` takes in worlds whose
            bodies have sizes of their own; None if they must be as in the scene.

    What an instance needs to know beyond its class, as a number of blocks, are arguments of its
    constructor, which gym.make hands on.
    """

    frame: ClassVar[float] = 1.0 / 25.0
    actions: tuple[str, ...]
    bounds: tuple[tuple[str, str, float, float], ...]
    goal_bounds: tuple[tuple[str, str, float, float], ...]
    draws: int
    reward: Reward
    camera: Camera = Camera()
    sizes: tuple[float, float] | None = None

    @property
    def guides(self) -> tuple[tuple[str, str, float, float], ...]:
        """Name, unit, low and high of every component that `guide` writes."""
        return tuple((f"{name} to go", unit, a - b, b - a) for name, unit, a, b in self.goal_bounds)

    @abstractmethod
    def scene(self) -> Scene:
        """What is in each world."""

    @abstractmethod
    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Puts the worlds of the mask [count] into the start of an episode.

        Args:
            world: to write to.
            mask: [count] bool.
            draws: [chosen, draws] uniform in [0, 1[.

        Returns:
            [chosen, goal] desired goals.
        """

    @abstractmethod
    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Commands the drives by actions [count, actions] within [-1, 1]."""

    @abstractmethod
    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Writes observations [count, observation]."""

    @abstractmethod
    def achieved(self, world: World, now: Readout) -> Array:
        """Achieved goals [count, goal]."""

    @abstractmethod
    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, apart: Array
    ) -> dict[str, Array]:
        """Raw reward terms [count] that can't be had from the goals [count, goal] alone.

        `apart` [count] m is the distance of the goals, which every reward needs anyway.
        """

    def guide(
        self, world: World, now: Readout, achieved: Array, desired: Array, out: Array
    ) -> None:
        """Writes what is left to do [count, guides], of goals [count, goal]."""
        out[...] = desired - achieved

    def signs(self, world: World, index: int, goal: Array) -> Sequence[Sign]:
        """What marks the goal [goal] in a picture of world `index`; by default, a place."""
        return [Goal(goal[:3], self.reward.threshold)]
