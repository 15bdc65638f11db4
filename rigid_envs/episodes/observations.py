"""What is observed of the worlds: its space, and its values after each step."""

from typing import Any

import numpy as np
from gymnasium import spaces

from physics import Readout, World
from physics.compiler.jit import columns
from physics.scene.validation import instance
from rigid_envs.episodes.columns import Observed, split
from rigid_envs.episodes.pixels import Pixels
from rigid_envs.episodes.randomization import Randomization
from rigid_envs.episodes.task_checks import check_goals, check_written
from rigid_envs.tasks.goals import Measure
from rigid_envs.tasks.task import Bounds, Task

Array = np.ndarray
Observation = Any
"""Arrays by name; or all of it in one array [..., n], with obs_type="flat"."""


class Observations:
    """Observations of worlds.

    Args:
        task: of the episodes.
        randomization: of their parameters.
        parameters: whether the drawn parameters are appended, see `Randomization`.
        guide: whether the task's guide is appended, see `Task.guide`.
        pixels: what draws the observed pixels; None if only the state is observed.
        keeps_state: whether the state is observed beside pixels.
        flat: whether state and goals are observed as one array.

    Attributes:
        parameters: see above.
        bounds: (name, unit, low, high) of each component of the state.
        space: of one world's observation.

    Raises:
        TypeError, ValueError: `parameters` or `guide` is no bool, or no parameters are drawn.
    """

    def __init__(
        self,
        task: Task,
        randomization: Randomization,
        parameters: bool,
        guide: bool,
        pixels: Pixels | None,
        keeps_state: bool,
        flat: bool,
    ) -> None:
        self._task, self._randomization = task, randomization
        self.parameters: bool = instance("observe_parameters", parameters, bool)
        if self.parameters and not randomization.bounds:
            raise ValueError(
                "observe_parameters needs randomize: its ranges are the bounds of the observed "
                "parameters"
            )
        parameter_bounds = randomization.bounds if self.parameters else ()
        self._guide: bool = instance("observe_task_guide", guide, bool)
        guide_bounds = self._task.guide_bounds if self._guide else ()
        # options append components, so that the indices of the others do not change
        self.bounds: Bounds = (*self._task.bounds, *parameter_bounds, *guide_bounds)
        dtype = self._task.dtype
        low, high = _limits(self.bounds, dtype)
        goal_low, goal_high = _limits(self._task.goal_bounds, dtype)
        self._low, self._high = np.append(low, goal_low), np.append(high, goal_high)
        if not self._task.bounds_end_episodes:
            self._low[:], self._high[:] = -np.inf, np.inf
        observed: dict[str, spaces.Space[Any]] = {
            "observation": spaces.Box(low, high, dtype=dtype),
            "achieved_goal": spaces.Box(goal_low, goal_high, dtype=dtype),
            "desired_goal": spaces.Box(goal_low, goal_high, dtype=dtype),
        }
        self._pixels, self._keeps_state = pixels, keeps_state
        if pixels is not None:
            if keeps_state:
                observed["state"] = observed["observation"]
            observed["observation"] = pixels.space
        self._flat = flat
        self.space: spaces.Space[Any] = spaces.Dict(observed)
        if flat:
            # in this order of names; `gymnasium.spaces.flatten` sorts them
            ends = [(low, high), (goal_low, goal_high), (goal_low, goal_high)]
            lows, highs = (np.concatenate(part) for part in zip(*ends, strict=True))
            self.space = spaces.Box(lows, highs, dtype=dtype)
        self._checked = False

    def observe(
        self, world: World, now: Readout, desired: Array, joins: bool, measure: Measure
    ) -> tuple[Observation, Observed, Array]:
        """Observations of all worlds.

        The first ones are checked: a task must write every component.

        Args:
            world: the worlds.
            now: their state.
            desired: [count, goal], the desired goals.
            joins: whether to write `Observed.goals`.
            measure: of the goal distance.

        Returns:
            The observations, what else `split` tells, and the achieved goals [count, goal].
        """
        task, count = self._task, world.count
        goal_start, task_end = len(self.bounds), len(task.bounds)
        guide_start = goal_start - (len(task.guide_bounds) if self._guide else 0)
        table = columns((len(self._low),), count, task.dtype)
        values = table.T[:count]
        if not self._checked:
            table[...] = np.nan
        task.observe(world, now, values[:, :task_end])
        if not self._checked:
            check_written(task, "observe", task.bounds, values[:, :task_end])
        if self.parameters:
            values[:, task_end:guide_start] = self._randomization.observed
        achieved = values[:, goal_start:]
        achieved[...] = check_goals(task, "achieved", task.achieved(world, now), count)
        if self._guide:
            guide = values[:, guide_start:goal_start]
            task.guide(world, now, achieved, desired, guide)
            if not self._checked:
                check_written(task, "guide", task.guide_bounds, guide)
        self._checked = True
        rows = split(table, self._low, self._high, desired, joins, measure)
        if self._flat:
            parts = (rows.observation, rows.achieved, rows.desired)
            return np.concatenate(parts, axis=1), rows, achieved
        # one row per world, as users expect
        observation = {
            "observation": rows.observation,
            "achieved_goal": rows.achieved,
            "desired_goal": rows.desired,
        }
        if self._pixels:
            if self._keeps_state:
                observation["state"] = rows.observation
            observation["observation"] = self._pixels.observe(world)
        return observation, rows, achieved


def _limits(bounds: Bounds, dtype: Any) -> tuple[Array, Array]:
    """Low and high [n] of bounds."""
    low = np.array([b[2] for b in bounds], dtype=dtype)
    return low, np.array([b[3] for b in bounds], dtype=dtype)
