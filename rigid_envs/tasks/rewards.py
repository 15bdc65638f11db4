"""Rewards: one function of goals and named raw terms, for a step and for relabelling."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rigid_envs.tasks.goals import distance

Array = np.ndarray

REWARD_TYPES = ("sparse", "dense")
# terms that follow from the goals
OF_GOALS = ("success", "distance", "time")
# in the info: the goals that the terms beside it were made for
GOALS_OF_TERMS = "goals_of_terms"


@dataclass(frozen=True)
class Reward:
    """Sparse and dense reward of a goal-conditioned task.

    Sparse: 0 where the goals are within the threshold, else -1.
    Dense: the sum of weight times raw term. Three terms follow from the goals: "success", 1 where
    solved, "distance", m apart with a minus, and "time", always 1; the others are the task's.

    Args:
        threshold: m, largest distance that counts as solved.
        weights: of the raw terms, by name.
        hurry: weight of "time" where success ends an episode: as much below 0 as the others can
            pay together short of success, or it would pay to put the end off. Elsewhere it would
            be a constant that a learner's value function has to find again and again.
    """

    threshold: float
    weights: Mapping[str, float]
    hurry: float = 0.0

    def ending(self) -> "Reward":
        """The reward where success ends an episode."""
        weights = {**self.weights, "time": self.weights.get("time", 0.0) + self.hurry}
        return replace(self, weights=weights, hurry=0.0) if self.hurry else self

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
                doesn't look at it, nor does a dense one whose terms all follow from the goals.

        Raises:
            ValueError: goals of different shape; a dense reward whose terms aren't in the info, or
                are of other goals.
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
            reward = self.dense(success, apart, self._terms(info, achieved, desired))
        return float(reward) if achieved.ndim == 1 else reward

    @property
    def of_task(self) -> list[str]:
        """Names of the weighted terms that don't follow from the goals."""
        return [name for name in self.weights if name not in OF_GOALS]

    def _terms(self, info: Any, achieved: Array, desired: Array) -> dict[str, Array]:
        """The task's terms from the info of the step that ended with these goals."""
        names = self.of_task
        if not names:
            return {}
        try:
            found = {name: column(info, name) for name in (*names, GOALS_OF_TERMS)}
        except (KeyError, TypeError):
            raise ValueError(
                f"the dense reward needs the terms {names} of the step's info, and "
                f"{GOALS_OF_TERMS!r} beside them, got "
                f'{info!r}; relabelled goals (HER) need reward_type="sparse"'
            ) from None
        if not np.array_equal(found.pop(GOALS_OF_TERMS), goals_of_terms(achieved, desired)):
            raise ValueError(
                f"the dense reward of other goals than the step's can't be told: the terms {names} "
                "of the info hold for the achieved and desired goal that the step returned alone; "
                'relabelled goals (HER) need reward_type="sparse"'
            )
        return found


def goals_of_terms(achieved: Array, desired: Array) -> Array:
    """What the info says of the goals [..., goal] that its terms are of: [..., 2 goal]."""
    return np.concatenate([achieved, desired], axis=-1)


def column(info: Any, name: str) -> Array:
    """An entry [...] of an info, or of each of a sequence of infos.

    Raises:
        KeyError, TypeError: there is none.
    """
    if isinstance(info, Mapping):
        return np.asarray(info[name])
    return np.array([one[name] for one in info])
