"""Shaping by a potential, which changes no best policy."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics.scene.validation import array, number
from rigid_envs.tasks.goals import distance
from rigid_envs.wrappers.rule import Goals, Observation, Rule, Terms, Transition

Array = np.ndarray
Potential = Callable[[Observation], Any]


@dataclass(frozen=True)
class PotentialShaping(Rule):
    """Pays for what a potential gains: the best policy stays the best.

    r' = r + F, F = gamma Phi(s') - Phi(s); Phi(s') is 0 where the episode terminated, and counts
    where it was truncated. Over an episode the discounted sum of F is
    gamma^T Phi(s_T) - Phi(s_0), whatever was done. Info: `shaping`, F.

    Source: Ng, Harada & Russell, Policy invariance under reward transformations, ICML 1999.

    Args:
        potential: Phi: takes observations {key: [..., k]} and gives [...]; `goal_potential`, or a
            function of yours.
        gamma: the learner's discount factor.
    """

    potential: Potential
    gamma: float

    kept = ("shaping",)
    advice = (
        "HER doesn't tell the state before the step, whose potential for another goal would be "
        "needed: leave PotentialShaping out, since without it the same policies are best"
    )

    def __post_init__(self) -> None:
        """Checks the fields."""
        if not callable(self.potential):
            raise TypeError(f"potential must be callable, got {self.potential!r}")
        object.__setattr__(self, "gamma", number("gamma", self.gamma, low=0.0, high=1.0))

    @property
    def of_goal(self) -> bool:
        """A potential may depend on the goal."""
        return True

    def remember(self, observation: Observation, action: Array) -> Array:
        """Phi(s)."""
        value = self.potential(observation)
        return array(
            "potential(observation)", value, observation["achieved_goal"].shape[:-1]
        ).copy()

    def history(self, memory: Any, step: Transition) -> Terms:
        """F."""
        after = self.remember(step.observation, step.action)
        return {"shaping": self.gamma * np.where(step.terminated, 0.0, after) - memory}

    def pay(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return reward + terms["shaping"], {}


def goal_potential(observation: Observation) -> Array:
    """A potential for every task: minus the distance [...] m of achieved and desired goal."""
    return -np.asarray(distance(observation["achieved_goal"], observation["desired_goal"]))
