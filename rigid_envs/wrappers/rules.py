"""Rules with short formulas: penalties on actions and time, a bonus, scaling and bounding."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from physics.scene.validation import instance, integer, number, positive
from rigid_envs.wrappers.rule import Goals, Observation, Rule, Terms, Transition

Array = np.ndarray

_KEEP_INFOS = (
    "With HER, the replay buffer has to keep the infos: HerReplayBuffer(copy_info_dict=True), and "
    "an environment that returns the infos of all steps. Otherwise, remove the wrapper"
)


@dataclass(frozen=True)
class ActionPenalty(Rule):
    """Subtracts a penalty for large actions.

    r' = r - weight `|a|^2`, with the action clipped to its space. Info: `action_square`, `|a|^2`.

    Args:
        weight: at least 0.
        components: of the action, counted from 0, that `|a|^2` sums over; None for all. Leave out
            components for which 0 does not mean rest, such as the grip of Stack's hand.
    """

    weight: float
    components: list[int] | tuple[int, ...] | None = None

    needs_action = True
    stored_terms = ("action_square",)
    her_advice = _KEEP_INFOS

    def __post_init__(self) -> None:
        """Checks the arguments."""
        object.__setattr__(self, "weight", number("weight", self.weight, low=0.0))
        if self.components is not None:
            given = instance("components", self.components, list, tuple)
            chosen = [integer(f"components[{i}]", x, low=0) for i, x in enumerate(given)]
            if not chosen or len(set(chosen)) < len(chosen):
                raise ValueError(f"components must name at least one, and none twice, got {given}")
            object.__setattr__(self, "components", tuple(chosen))

    def check_actions(self, size: int) -> None:
        """Raises ValueError if actions have no such components."""
        if self.components is not None and max(self.components) >= size:
            raise ValueError(
                f"components must be below {size}, the size of an action, got {self.components}"
            )

    def step_terms(self, memory: Any, step: Transition) -> Terms:
        """`|a|^2`."""
        square = step.action**2
        if self.components is not None:
            square = square[..., list(self.components)]
        return {"action_square": np.sum(square, axis=-1)}

    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return reward - self.weight * terms["action_square"], {}


@dataclass(frozen=True)
class SmoothnessPenalty(Rule):
    """Subtracts a penalty for changes of the action from step to step.

    r' = r - weight `|a - a_before|^2`, and r' = r in the first step of an episode. Info:
    `action_change`, `|a - a_before|^2`.

    Args:
        weight: at least 0.
    """

    weight: float

    needs_action = True
    stored_terms = ("action_change",)
    her_advice = _KEEP_INFOS

    def __post_init__(self) -> None:
        """Checks the arguments."""
        object.__setattr__(self, "weight", number("weight", self.weight, low=0.0))

    def memory(self, observation: Observation, action: Array) -> Array:
        """The action."""
        return action

    def step_terms(self, memory: Any, step: Transition) -> Terms:
        """`|a - a_before|^2`."""
        change = np.sum((step.action - memory) ** 2, axis=-1)
        return {"action_change": np.where(np.isnan(change), 0.0, change)}

    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return reward - self.weight * terms["action_change"], {}


@dataclass(frozen=True)
class SuccessBonus(Rule):
    """Adds a bonus in each step in which the task is solved.

    r' = r + bonus [solved]. Info: `bonus_paid`, whether the bonus was added.

    Args:
        bonus: at least 0.
    """

    bonus: float

    needs_success = True

    def __post_init__(self) -> None:
        """Checks the arguments."""
        object.__setattr__(self, "bonus", number("bonus", self.bonus, low=0.0))

    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        success = goals.success()
        return reward + self.bonus * success, {"bonus_paid": success}


@dataclass(frozen=True)
class TimePenalty(Rule):
    """Subtracts a penalty in each step in which the task is not solved.

    r' = r - penalty [not solved]. Episodes continue after success unless `terminate_on_success` is
    set, so a penalty in solved steps too would be the same for every policy. Info: `time_charged`,
    whether the penalty was subtracted.

    Args:
        penalty: at least 0.
    """

    penalty: float

    needs_success = True

    def __post_init__(self) -> None:
        """Checks the arguments."""
        object.__setattr__(self, "penalty", number("penalty", self.penalty, low=0.0))

    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
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
        """Checks the arguments."""
        object.__setattr__(self, "scale", positive("scale", self.scale))

    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return self.scale * reward, {"unscaled_reward": reward}


@dataclass(frozen=True)
class BoundReward(Rule):
    """Limits the reward to a range.

    r' = min(max(r, low), high). Info: `unbounded_reward`, r. Unlike Gymnasium's ClipReward, it also
    limits the rewards of `compute_reward`.

    Args:
        low: smallest reward.
        high: largest reward, above `low`.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        """Checks the arguments."""
        object.__setattr__(self, "low", number("low", self.low))
        object.__setattr__(self, "high", number("high", self.high))
        if self.low >= self.high:
            raise ValueError(f"high must be above low, {self.low!r}, got {self.high!r}")

    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return np.clip(reward, self.low, self.high), {"unbounded_reward": reward}
