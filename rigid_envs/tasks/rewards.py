"""Rewards: one function of goals and named raw terms, for steps and for relabelled goals."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rigid_envs.tasks.goals import Measure, distance, points

Array = np.ndarray

REWARD_TYPES = ("sparse", "dense")
# terms that need no info: the first two follow from the goals, "time" is always 1
GOAL_TERMS = ("success", "distance", "time")
# entry of the info: the goals for which the raw terms of the same info were computed
STEP_GOALS = "step_goals"


@dataclass(frozen=True)
class Reward:
    """Sparse and dense reward of a goal-conditioned task.

    Sparse: 0 where the goal distance is at most the threshold, else -1.
    Dense: the sum of weight times raw term. Three terms exist in every task: "success", 1 where the
    task is solved; "distance", minus the goal distance; and "time", always 1. The task
    computes the others.

    Args:
        threshold: largest goal distance at which the task counts as solved, in m with the default
            measure.
        weights: weight of each raw term of the dense reward, by name.
        time_penalty: subtracted from the dense reward in each step if success terminates the
            episode. It must be at least what the other terms can pay in one step before success:
            otherwise, delaying success would pay. It is not used if episodes continue after
            success: there it would only add a constant, which the value function would have to
            learn.
        measure: of the goal distance; by default the distance of points in m.
    """

    threshold: float
    weights: Mapping[str, float]
    time_penalty: float = 0.0
    measure: Measure = points

    def distance(self, achieved: Any, desired: Any) -> Any:
        """The goal distance [...] of goals [..., goal]."""
        return distance(achieved, desired, self.measure)

    def with_time_penalty(self) -> "Reward":
        """The reward to use if success terminates the episode."""
        if not self.time_penalty:
            return self
        time = self.weights.get("time", 0.0) - self.time_penalty
        return replace(self, weights={**self.weights, "time": time}, time_penalty=0.0)

    def success(self, goal_distance: Any) -> Any:
        """Whether [...] the task is solved at these goal distances [...]."""
        return goal_distance <= self.threshold

    def sparse(self, success: Any) -> Any:
        """The sparse reward [...]: -1 or 0."""
        return success - 1.0

    def dense(self, success: Any, goal_distance: Any, terms: Mapping[str, Array]) -> Any:
        """The dense reward [...]."""
        reward: Any = None
        for name, weight in self.weights.items():
            if name == "distance":
                term = -weight * goal_distance
            elif name == "time":
                term = np.full_like(goal_distance, weight)
            else:
                term = weight * (success if name == "success" else terms[name])
            term = np.asarray(term, dtype=np.float64)  # sums are of doubles, whatever a term is
            reward = term if reward is None else reward + term
        return np.zeros_like(goal_distance) if reward is None else reward

    def compute(self, reward_type: str, achieved: Array, desired: Array, info: Any) -> Any:
        """The reward of pairs of goals, as `compute_reward` of the environments returns it.

        Args:
            reward_type: "sparse" or "dense".
            achieved: [..., goal].
            desired: [..., goal].
            info: the info of the step: a dict, or a sequence of dicts for a batch. The sparse
                reward ignores it.

        Returns:
            Rewards [...]; a NumPy float, which is a float, for a single pair.

        Raises:
            ValueError: the shapes of the goals differ; the dense reward finds no terms in the info,
                or terms that were computed for other goals.
        """
        achieved, desired = np.asarray(achieved), np.asarray(desired)
        if achieved.shape != desired.shape:
            raise ValueError(
                f"achieved_goal and desired_goal must have the same shape, got {achieved.shape} "
                f"and {desired.shape}"
            )
        goal_distance = np.asarray(self.distance(achieved, desired))
        success = self.success(goal_distance)
        if reward_type == "sparse":
            reward = self.sparse(success)
        else:
            reward = self.dense(success, goal_distance, self._terms(info, achieved, desired))
        return np.float64(reward) if achieved.ndim == 1 else reward

    @property
    def task_terms(self) -> list[str]:
        """Names of the weighted terms that the task computes."""
        return [name for name in self.weights if name not in GOAL_TERMS]

    def _terms(self, info: Any, achieved: Array, desired: Array) -> dict[str, Array]:
        """The task's terms from the info of the step that returned these goals."""
        names = self.task_terms
        if not names:
            return {}
        try:
            found = {name: info_values(info, name) for name in (*names, STEP_GOALS)}
        except (KeyError, TypeError):
            raise ValueError(
                f"the dense reward needs {[*names, STEP_GOALS]} in info: pass the info of the step "
                f"that returned the goals. Got {describe_info(info)}. To relabel goals (HER), use "
                'reward_type="sparse"'
            ) from None
        if not np.array_equal(found.pop(STEP_GOALS), join_goals(achieved, desired)):
            raise ValueError(
                "the dense reward cannot be computed for other goals than those of the step: "
                f"{names} in info are valid only for the goals that the step returned. To relabel "
                'goals (HER), use reward_type="sparse"'
            )
        return found


def join_goals(achieved: Array, desired: Array) -> Array:
    """The entry `STEP_GOALS` of an info: [..., 2 goal] from goals [..., goal]."""
    return np.concatenate([achieved, desired], axis=-1)


def info_values(info: Any, name: str) -> Array:
    """Values [...] of an entry of an info, or of a sequence of infos.

    Raises:
        KeyError, TypeError: there is no such entry.
    """
    if isinstance(info, Mapping):
        return np.asarray(info[name])
    return np.array([one[name] for one in info])


def describe_info(info: Any) -> str:
    """What an info or a state contains, for error messages."""
    if isinstance(info, Mapping):
        return f"a dict with {sorted(map(str, info))}"
    if isinstance(info, list | tuple | np.ndarray) and len(info):
        return f"{len(info)} infos, the first of which is {describe_info(info[0])}"
    return f"{info!r:.200}"
