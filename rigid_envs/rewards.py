"""Rewards: one function of goals and named raw terms, for a step and for relabelling."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid_envs.goals import distance

Array = np.ndarray

REWARD_TYPES = ("sparse", "dense")
# terms that follow from the goals
OF_GOALS = ("success", "distance", "time")


@dataclass(frozen=True)
class Reward:
    """Sparse and dense reward of a goal-conditioned task.

    Sparse: 0 where the goals are within the threshold, else -1.
    Dense: the sum of weight times raw term. Three terms follow from the goals: "success", 1 where
    solved, "distance", m apart with a minus, and "time", always 1; the others are the task's.

    Args:
        threshold: m, largest distance that counts as solved.
        weights: of the raw terms, by name.
    """

    threshold: float
    weights: Mapping[str, float]

    def success(self, apart: Any) -> Any:
        """Whether goals at these distances [...] m agree."""
        return apart <= self.threshold

    def sparse(self, success: Any) -> Any:
        """-1 or 0, [...]; a function of the goals alone."""
        return success - 1.0

    def dense(self, success: Any, apart: Any, terms: Mapping[str, Array]) -> Any:
        """The shaped reward, [...]."""
        known = {"success": success, "distance": -apart, "time": 1.0}
        reward = np.zeros_like(apart)
        for name, weight in self.weights.items():
            reward = reward + weight * (known[name] if name in known else terms[name])
        return reward

    def compute(self, kind: str, achieved: Array, desired: Array, info: Any) -> Any:
        """The reward of goals [..., goal], as environments and HER ask for it.

        Args:
            kind: "sparse" or "dense".
            achieved: [..., goal].
            desired: [..., goal].
            info: of the step: a dict, or a sequence of dicts for a batch; the sparse reward
                doesn't look at it.

        Raises:
            ValueError: goals of different shape; a dense reward whose terms aren't in the info.
        """
        achieved, desired = np.asarray(achieved), np.asarray(desired)
        if achieved.shape != desired.shape:
            raise ValueError(
                f"achieved_goal and desired_goal must have the same shape, got {achieved.shape} "
                f"and {desired.shape}"
            )
        apart = np.asarray(distance(achieved, desired))
        success = self.success(apart)
        if kind == "sparse":
            reward = self.sparse(success)
        else:
            reward = self.dense(success, apart, self._terms(info))
        return float(reward) if achieved.ndim == 1 else reward

    def _terms(self, info: Any) -> dict[str, Array]:
        names = [name for name in self.weights if name not in OF_GOALS]
        try:
            if isinstance(info, Mapping):
                return {name: np.asarray(info[name]) for name in names}
            return {name: np.array([one[name] for one in info]) for name in names}
        except (KeyError, TypeError):
            raise ValueError(
                f"the dense reward needs the terms {names} of the step's info, got "
                f'{info!r}; relabelled goals (HER) need reward_type="sparse"'
            ) from None
