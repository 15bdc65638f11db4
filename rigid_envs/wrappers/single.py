"""Reward wrappers for single environments; those for vector environments are in `vector`."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import VectorEnv

from rigid_envs.wrappers import potential, rules, staged
from rigid_envs.wrappers.base import RuleWrapper
from rigid_envs.wrappers.rule import Transition

Array = np.ndarray


class RewardWrapper(RuleWrapper, gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Applies a rule to one environment. Subclasses set the rule.

    Args:
        env: an environment with goals.
        *args: arguments of the rule.
        **kwargs: arguments of the rule.

    Raises:
        TypeError: another kind of environment, or an argument of another type.
        ValueError: an argument is out of range.
    """

    wraps = (gym.Env, "rigid_envs.wrappers", VectorEnv, "rigid_envs.wrappers.vector")

    def __init__(self, env: gym.Env, *args: Any, **kwargs: Any) -> None:
        """Checks the environment and the arguments of the rule."""
        self._build_rule(env, "observation_space", args, kwargs)
        self._check_action_space(env.action_space)
        RecordConstructorArgs.__init__(self, **vars(self.rule))
        gym.Wrapper.__init__(self, env)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Starts an episode. Its info has no terms of the rule, since there is no reward yet."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._check_info(info)
        self._memory = self.rule.memory(observation, np.full(self._action_shape, np.nan))
        self._was_reset = True
        return observation, info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """A step of the wrapped environment, with the reward of the rule."""
        self._check_was_reset()
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._check_info(info)
        clipped = self._clip_actions(action, self.env.action_space)
        step = Transition(observation, clipped, np.asarray(terminated))
        new_reward, terms = self._apply_rule(reward, step, info)
        self._memory = self.rule.memory(observation, clipped)
        added = {name: value.item() if value.ndim == 0 else value for name, value in terms.items()}
        return observation, float(new_reward), terminated, truncated, {**info, **added}

    @property
    def _action_shape(self) -> tuple[int, ...]:
        shape = self.env.action_space.shape
        return shape if shape is not None and self.rule.needs_action else (0,)


class StagedReward(RewardWrapper):
    """`staged.StagedReward` for single environments."""

    rule_type = staged.StagedReward


class PotentialShaping(RewardWrapper):
    """`potential.PotentialShaping` for single environments."""

    rule_type = potential.PotentialShaping


class ActionPenalty(RewardWrapper):
    """`rules.ActionPenalty` for single environments."""

    rule_type = rules.ActionPenalty


class SmoothnessPenalty(RewardWrapper):
    """`rules.SmoothnessPenalty` for single environments."""

    rule_type = rules.SmoothnessPenalty


class SuccessBonus(RewardWrapper):
    """`rules.SuccessBonus` for single environments."""

    rule_type = rules.SuccessBonus


class TimePenalty(RewardWrapper):
    """`rules.TimePenalty` for single environments."""

    rule_type = rules.TimePenalty


class ScaleReward(RewardWrapper):
    """`rules.ScaleReward` for single environments."""

    rule_type = rules.ScaleReward


class BoundReward(RewardWrapper):
    """`rules.BoundReward` for single environments."""

    rule_type = rules.BoundReward
