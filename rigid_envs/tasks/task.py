"""The base class of tasks: everything that one task has and another has not.

The engine (`physics`), the episodes (`rigid_envs.episodes`) and Gymnasium's interface are the same
for all tasks.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from physics import Readout, Scene, SimulationDiverged, World
from physics.scene.validation import number
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.view import Goal, Marker
from rigid_envs.tasks.rewards import Reward

Array = np.ndarray
Point = tuple[float, float, float]
Bounds = tuple[tuple[str, str, float, float], ...]
"""(name, unit, low, high) of each component of an array."""


class Task(ABC):
    """A goal-conditioned task in `count` worlds at once.

    A task is a class of NumPy functions. All arrays have a leading world axis, so the same class
    runs one world and thousands of worlds. The arguments of a task's constructor, such as a number
    of blocks, are also arguments of `gym.make` and `gym.make_vec`.

    Attributes:
        frame: duration of one environment step in s.
        max_episode_steps: number of steps after which an episode is truncated.
        actions: names of the action's components. Each component lies within [-1, 1].
        bounds: (name, unit, low, high) of each component of the observation, in order.
        goal_bounds: (name, unit, low, high) of each component of a goal.
        parts: equal parts of a step; between two of them `proceed` may command the drives again.
        draw_count: how many random numbers the start of an episode needs.
        reward: the success threshold and the weights of the dense reward.
        camera: the camera of rendered frames. It should see the whole workspace.
        workspace: (low, high) in m of a box around starts and goals, which the cameras "front",
            "side", "back" and "top" show; None if they see them from as far as `camera`.
        video_camera: the name of the camera of recorded videos: "follow" where a body is small
            compared with its path. If None, it looks from the side of `camera`, so near that it
            just sees the whole episode, see `RigidEnv.camera_for`.
        dtype: of observations and goals: np.float32 or np.float64.
        bounds_end_episodes: whether an observation beyond its bounds is clipped and truncates the
            episode.
        size_range: smallest and largest factor of body sizes that `start` supports when each world
            has its own sizes; None if the task supports only the sizes of its scene.
    """

    frame: ClassVar[float] = 1.0 / 25.0
    dtype: ClassVar[type[np.floating]] = np.float32
    bounds_end_episodes: ClassVar[bool] = True
    parts: ClassVar[int] = 1
    max_episode_steps: int = 50
    actions: tuple[str, ...]
    bounds: Bounds
    goal_bounds: Bounds
    draw_count: int
    reward: Reward
    camera: Camera = Camera()
    workspace: tuple[Point, Point] | None = None
    video_camera: str | None = None
    size_range: tuple[float, float] | None = None

    @property
    def distance_threshold(self) -> float:
        """Largest goal distance at which the task counts as solved; it can be set."""
        return self.reward.threshold

    @distance_threshold.setter
    def distance_threshold(self, threshold: float) -> None:
        value = number("distance_threshold", threshold, low=0.0)
        self.reward = replace(self.reward, threshold=value)

    @property
    def guide_bounds(self) -> Bounds:
        """(name, unit, low, high) of each component that `guide` writes."""
        return tuple(
            (f"{name} difference", unit, low - high, high - low)
            for name, unit, low, high in self.goal_bounds
        )

    @abstractmethod
    def scene(self) -> Scene:
        """The bodies, statics and drives of each world."""

    @abstractmethod
    def start(self, world: World, mask: Array, draws: Array) -> Array:
        """Sets the initial state of an episode in the worlds of the mask.

        Args:
            world: the worlds to write to.
            mask: [count] bool; n of its entries are true.
            draws: [n, draw_count] random numbers, uniform in [0, 1).

        Returns:
            Desired goals [n, goal].
        """

    @abstractmethod
    def act(self, world: World, now: Readout, actions: Array) -> None:
        """Commands the drives for one step, given actions [count, actions] within [-1, 1]."""

    def proceed(self, world: World, part: int) -> None:  # noqa: B027  (most steps have one part)
        """Commands the drives for a part of a step, from part 1 on."""

    def advance(
        self, world: World, now: Readout, actions: Array, worlds: Array | None = None
    ) -> None:
        """Advances worlds by one step.

        Args:
            world: the worlds.
            now: their poses and velocities.
            actions: [count, actions] within [-1, 1].
            worlds: mask [count] of the worlds to advance; all if None.

        Raises:
            SimulationDiverged: a world has diverged. The others have advanced.
        """
        self.act(world, now, actions)
        error = None
        for part in range(self.parts):
            if part > 0:
                self.proceed(world, part)
            try:
                world.advance(self.frame / self.parts, worlds)
            except SimulationDiverged as diverged:
                error = error or diverged
        if error is not None:
            raise error

    @abstractmethod
    def observe(self, world: World, now: Readout, out: Array) -> None:
        """Writes observations [count, observation] to `out`."""

    @abstractmethod
    def achieved(self, world: World, now: Readout) -> Array:
        """Achieved goals [count, goal]."""

    @abstractmethod
    def terms(
        self, world: World, now: Readout, achieved: Array, desired: Array, goal_distance: Array
    ) -> dict[str, Array]:
        """Raw reward terms [count] that do not follow from the goals [count, goal] alone.

        Args:
            world: the worlds.
            now: current poses and velocities.
            achieved: [count, goal].
            desired: [count, goal].
            goal_distance: [count] m, distance between the two goals.

        Returns:
            A dict with at least every term in `reward.weights` that does not follow from the goals.
        """

    def guide(
        self, world: World, now: Readout, achieved: Array, desired: Array, out: Array
    ) -> None:
        """Writes the task guide [count, guide] to `out`; by default, desired minus achieved goal.

        The policy observes it with `observe_task_guide=True`.
        """
        out[...] = desired - achieved

    def markers(self, world: World, index: int, goal: Array) -> Sequence[Marker]:
        """What marks the goal [goal] in a rendered frame of world `index`; by default, a disc."""
        return [Goal(goal[:3], self.reward.threshold)]
