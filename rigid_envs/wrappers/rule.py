"""The base class of reward rules: what a wrapper does to rewards, as functions of arrays.

A rule works for one world, for many worlds and for the batches of `compute_reward`: all arrays may
have any leading axes [...]. A single environment has none, a vector environment has one.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rigid_envs.tasks.rewards import Reward

Array = np.ndarray
Observation = Mapping[str, Array]
Terms = dict[str, Array]


@dataclass(frozen=True)
class Goals:
    """A pair of goals.

    Args:
        achieved: [..., goal].
        desired: [..., goal].
        reward: the task's reward, whose threshold defines success; None if the rule does not need
            it.
    """

    achieved: Array
    desired: Array
    reward: Reward | None

    def distance(self) -> Array:
        """Goal distance [...]."""
        assert self.reward is not None  # only rules with `needs_success` call this
        return np.asarray(self.reward.distance(self.achieved, self.desired))

    def success(self) -> Array:
        """Whether [...] the task is solved."""
        assert self.reward is not None
        return np.asarray(self.reward.success(self.distance()))


@dataclass(frozen=True)
class Transition:
    """The end of one step of an episode.

    Args:
        observation: {key: [..., k]} after the step. If the episode ended and the environment was
            reset in the same step, this is the last observation of the old episode.
        action: [..., k], clipped to the action space.
        terminated: [...] whether the episode terminated in this step.
    """

    observation: Observation
    action: Array
    terminated: Array


class Rule(ABC):
    """How a wrapper changes the reward.

    `apply` is the formula. Steps and `compute_reward` both call it, so they cannot disagree. What
    the formula needs besides the goals is computed by `step_terms` and stored in the step's info,
    where `compute_reward` finds it.

    Attributes:
        needs_success: whether the formula uses success, and so the task's threshold.
        needs_action: whether the formula uses the action.
        stored_terms: names of the terms that `step_terms` returns.
        her_advice: what to do if the reward of relabelled goals cannot be computed.
    """

    needs_success: ClassVar[bool] = False
    needs_action: ClassVar[bool] = False
    stored_terms: ClassVar[tuple[str, ...]] = ()
    her_advice: ClassVar[str] = ""

    @property
    def info_terms(self) -> tuple[str, ...]:
        """Names of the terms that the rule reads from the info of the wrapped environment."""
        return ()

    @property
    def depends_on_goal(self) -> bool:
        """Whether the stored terms or the info terms are valid only for the goals of the step."""
        return False

    def check_actions(self, size: int) -> None:  # noqa: B027  (most rules have nothing to check)
        """Raises ValueError if the rule's arguments contradict actions of `size` components."""

    def memory(self, observation: Observation, action: Array) -> Array | None:
        """What the next step needs of this one, [..., k] or [...]; at a reset, `action` is NaN."""
        return None

    def step_terms(self, memory: Any, step: Transition) -> Terms:
        """Raw terms [...] that depend on more than the goals after the step."""
        return {}

    @abstractmethod
    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """The new reward [...], and raw terms [...] for the info.

        Args:
            reward: [...] reward of the wrapped environment.
            goals: goals after the step.
            terms: info terms and stored terms, [...] each.
        """
