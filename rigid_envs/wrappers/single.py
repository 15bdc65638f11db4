"""Wrappers of single environments; those of vector environments are in `vector`."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import VectorEnv

from rigid_envs.wrappers import potential, rules, staged
from rigid_envs.wrappers.rule import Transition
from rigid_envs.wrappers.wrapping import Wrapping

Array = np.ndarray


class RewardWrapper(Wrapping, gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """A rule on one environment; its subclasses name the rule.

    Args:
        env: with goals.
        *args: of the rule.
        **kwargs: of the rule.

    Raises:
        TypeError: another kind of environment, or an argument of another type.
        ValueError: an argument out of range.
    """

    wraps = (gym.Env, "rigid_envs.wrappers", VectorEnv, "rigid_envs.wrappers.vector")

    def __init__(self, env: gym.Env, *args: Any, **kwargs: Any) -> None:
        """Checks the environment and the rule's arguments."""
        self._begin(env, "observation_space", args, kwargs)
        self._check_actions(env.action_space)
        RecordConstructorArgs.__init__(self, **vars(self.rule))
        gym.Wrapper.__init__(self, env)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Starts an episode; its info has none of the rule's terms, as nothing was paid."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._check_terms(info)
        self._memory = self.rule.remember(observation, np.full(self._action_shape, np.nan))
        self._begun = True
        return observation, info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """A step of the wrapped environment, paid by the rule."""
        self._check_begun()
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._check_terms(info)
        done = self._actions(action, self.env.action_space)
        step = Transition(observation, done, np.asarray(terminated))
        paid, told = self._pay(reward, step, info)
        self._memory = self.rule.remember(observation, done)
        own = {name: value.item() if value.ndim == 0 else value for name, value in told.items()}
        return observation, float(paid), terminated, truncated, {**info, **own}

    @property
    def _action_shape(self) -> tuple[int, ...]:
        shape = self.env.action_space.shape
        return shape if shape is not None and self.rule.acts else (0,)


class StagedReward(RewardWrapper):
    """`staged.StagedReward` on one environment."""

    rule_type = staged.StagedReward


class PotentialShaping(RewardWrapper):
    """`potential.PotentialShaping` on one environment."""

    rule_type = potential.PotentialShaping


class ActionPenalty(RewardWrapper):
    """`rules.ActionPenalty` on one environment."""

    rule_type = rules.ActionPenalty


class SmoothnessPenalty(RewardWrapper):
    """`rules.SmoothnessPenalty` on one environment."""

    rule_type = rules.SmoothnessPenalty


class SuccessBonus(RewardWrapper):
    """`rules.SuccessBonus` on one environment."""

    rule_type = rules.SuccessBonus


class TimePenalty(RewardWrapper):
    """`rules.TimePenalty` on one environment."""

    rule_type = rules.TimePenalty


class ScaleReward(RewardWrapper):
    """`rules.ScaleReward` on one environment."""

    rule_type = rules.ScaleReward


class ClipReward(RewardWrapper):
    """`rules.ClipReward` on one environment."""

    rule_type = rules.ClipReward
