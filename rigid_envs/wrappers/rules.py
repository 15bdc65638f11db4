"""The short rules: penalties on actions, a bonus, a charge, scale and clip."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from physics.scene.validation import number, positive
from rigid_envs.wrappers.rule import Goals, Observation, Rule, Terms, Transition

Array = np.ndarray

_KEEP_INFOS = (
    "give the step's infos, which a replay buffer has to keep (HerReplayBuffer("
    "copy_info_dict=True) on an environment that tells them every step), or leave the wrapper out"
)


@dataclass(frozen=True)
class ActionPenalty(Rule):
    """Charges for large actions.

    r' = r - weight `|a|^2`, of the action within its space. Info: `action_square`, `|a|^2`.

    Args:
        weight: at least 0.
    """

    weight: float

    acts = True
    kept = ("action_square",)
    advice = _KEEP_INFOS

    def __post_init__(self) -> None:
        """Checks the field."""
        object.__setattr__(self, "weight", number("weight", self.weight, low=0.0))

    def history(self, memory: Any, step: Transition) -> Terms:
        """|a|^2."""
        return {"action_square": np.sum(step.action**2, axis=-1)}

    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return reward - self.weight * terms["action_square"], {}


@dataclass(frozen=True)
class SmoothnessPenalty(Rule):
    """Charges for actions that differ from the one before.

    r' = r - weight `|a - a_before|^2`, and r in the first step of an episode. Info:
    `action_change`, `|a - a_before|^2`.

    Args:
        weight: at least 0.
    """

    weight: float

    acts = True
    kept = ("action_change",)
    advice = _KEEP_INFOS

    def __post_init__(self) -> None:
        """Checks the field."""
        object.__setattr__(self, "weight", number("weight", self.weight, low=0.0))

    def remember(self, observation: Observation, action: Array) -> Array:
        """The action."""
        return action

    def history(self, memory: Any, step: Transition) -> Terms:
        """|a - a_before|^2."""
        change = np.sum((step.action - memory) ** 2, axis=-1)
        return {"action_change": np.where(np.isnan(change), 0.0, change)}

    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return reward - self.weight * terms["action_change"], {}


@dataclass(frozen=True)
class SuccessBonus(Rule):
    """Pays more in every step that is solved.

    r' = r + bonus [solved]. Info: `bonus_paid`, whether it was.

    Args:
        bonus: at least 0.
    """

    bonus: float

    judges = True

    def __post_init__(self) -> None:
        """Checks the field."""
        object.__setattr__(self, "bonus", number("bonus", self.bonus, low=0.0))

    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        success = goals.success()
        return reward + self.bonus * success, {"bonus_paid": success}


@dataclass(frozen=True)
class TimePenalty(Rule):
    """Charges for every step that isn't solved.

    r' = r - penalty [not solved]. An episode goes on after success, unless terminate_on_success
    is set, so a charge on solved steps too would be the same for every policy. Info:
    `time_charged`, whether it was.

    Args:
        penalty: at least 0.
    """

    penalty: float

    judges = True

    def __post_init__(self) -> None:
        """Checks the field."""
        object.__setattr__(self, "penalty", number("penalty", self.penalty, low=0.0))

    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        unsolved = ~goals.success()
        return reward - self.penalty * unsolved, {"time_charged": unsolved}


@dataclass(frozen=True)
class ScaleReward(Rule):
    """Multiplies the reward.

    r' = scale r. Info: `unscaled_reward`, r.

    Args:
        scale: above 0.
    """

    scale: float

    def __post_init__(self) -> None:
        """Checks the field."""
        object.__setattr__(self, "scale", positive("scale", self.scale))

    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return self.scale * reward, {"unscaled_reward": reward}


@dataclass(frozen=True)
class ClipReward(Rule):
    """Clips the reward.

    r' = min(max(r, low), high). Info: `unclipped_reward`, r.

    Args:
        low: the least that is paid.
        high: the most that is paid, above `low`.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        """Checks the fields."""
        object.__setattr__(self, "low", number("low", self.low))
        object.__setattr__(self, "high", number("high", self.high))
        if self.low >= self.high:
            raise ValueError(f"high must be above low, {self.low!r}, got {self.high!r}")

    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return np.clip(reward, self.low, self.high), {"unclipped_reward": reward}
