"""What a wrapper does to rewards, as pure functions of arrays: one rule for one world and for many.

Every array has any leading axes: none for a single environment, one for a vector environment, and
whatever compute_reward is asked for.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rigid_envs.tasks.goals import distance
from rigid_envs.tasks.rewards import Reward

Array = np.ndarray
Observation = Mapping[str, Array]
Terms = dict[str, Array]


@dataclass(frozen=True)
class Goals:
    """A pair of goals, and what follows from it.

    Args:
        achieved: [..., goal].
        desired: [..., goal].
        reward: of the task, which tells when goals agree.
    """

    achieved: Array
    desired: Array
    reward: Reward | None

    def distance(self) -> Array:
        """[...] m apart."""
        return np.asarray(distance(self.achieved, self.desired))

    def success(self) -> Array:
        """Whether [...] the task is solved."""
        assert self.reward is not None  # asked for only by rules that judge
        return np.asarray(self.reward.success(self.distance()))


@dataclass(frozen=True)
class Transition:
    """A step of an episode.

    Args:
        observation: after it, {key: [..., k]}; of the episode that it belongs to, even if it ended.
        action: [..., k] as it was carried out, within the action space.
        terminated: [...] whether the episode ended there for good.
    """

    observation: Observation
    action: Array
    terminated: Array


class Rule(ABC):
    """How a wrapper changes the reward.

    `pay` is the formula: steps and compute_reward both call it, so they can't disagree. What it
    needs and goals can't tell is worked out by `history` and stands in the step's info, whence
    compute_reward takes it.

    Attributes:
        judges: whether it asks if goals agree.
        acts: whether it looks at actions.
        kept: names of what `history` gives.
        advice: what to do with HER where it can't be relabelled.
    """

    judges: ClassVar[bool] = False
    acts: ClassVar[bool] = False
    kept: ClassVar[tuple[str, ...]] = ()
    advice: ClassVar[str] = ""

    @property
    def reads(self) -> tuple[str, ...]:
        """Terms that it takes from the wrapped environment's info."""
        return ()

    @property
    def of_goal(self) -> bool:
        """Whether a term from the info holds for no other goals than the step's."""
        return False

    def remember(self, observation: Observation, action: Array) -> Array | None:
        """What [..., k] or [...] the next step needs of this one; at a start, actions are NaN."""
        return None

    def history(self, memory: Any, step: Transition) -> Terms:
        """Raw terms [...] that depend on more than the goals after the step."""
        return {}

    @abstractmethod
    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """The new reward, and raw terms that follow from goals and the old reward, all [...]."""
