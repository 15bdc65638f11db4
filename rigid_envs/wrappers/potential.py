"""Potential-based shaping, which does not change the optimal policies."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics.scene.validation import array, number
from rigid_envs.tasks.goals import Measure, distance, points
from rigid_envs.wrappers.rule import Goals, Observation, Rule, Terms, Transition

Array = np.ndarray
Potential = Callable[[Observation], Any]


@dataclass(frozen=True)
class PotentialShaping(Rule):
    """Adds the change of a potential; the optimal policies stay the same.

    r' = r + F with F = gamma Phi(s') - Phi(s). Phi(s') counts as 0 where the episode terminated,
    but not where it was truncated. Over an episode of T steps, the discounted sum of F is
    gamma^T Phi(s_T) - Phi(s_0), whatever the policy does. Info: `shaping`, F.

    Source: Ng, Harada & Russell, Policy invariance under reward transformations, ICML 1999.

    Args:
        potential: Phi, a function that takes observations {key: [..., k]} and returns [...]:
            `goal_potential` or your own function.
        gamma: the learner's discount factor.
    """

    potential: Potential
    gamma: float

    stored_terms = ("shaping",)
    her_advice = (
        "HER does not provide the state before the step, whose potential for the new goal would be "
        "needed. Remove PotentialShaping: the optimal policies are the same without it"
    )

    def __post_init__(self) -> None:
        """Checks the arguments."""
        if not callable(self.potential):
            raise TypeError(f"potential must be callable, got {self.potential!r}")
        object.__setattr__(self, "gamma", number("gamma", self.gamma, low=0.0, high=1.0))

    @property
    def depends_on_goal(self) -> bool:
        """A potential may depend on the goal."""
        return True

    def memory(self, observation: Observation, action: Array) -> Array:
        """Phi(s)."""
        value = self.potential(observation)
        return array(
            "potential(observation)", value, observation["achieved_goal"].shape[:-1]
        ).copy()

    def step_terms(self, memory: Any, step: Transition) -> Terms:
        """F."""
        after = self.memory(step.observation, step.action)
        return {"shaping": self.gamma * np.where(step.terminated, 0.0, after) - memory}

    def apply(self, reward: Array, goals: Goals, terms: Terms) -> tuple[Array, Terms]:
        """See the class."""
        return reward + terms["shaping"], {}


def goal_potential(observation: Observation, measure: Measure = points) -> Array:
    """A potential: minus the goal distance [...].

    Args:
        observation: {key: [..., k]}.
        measure: the task's `Reward.measure`; by default the distance of points in m.
    """
    achieved, desired = observation["achieved_goal"], observation["desired_goal"]
    return -np.asarray(distance(achieved, desired, measure))
