"""Reward wrappers for vector environments, with the names of those for single environments."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper

from rigid_envs.tasks.rewards import STEP_GOALS
from rigid_envs.wrappers import potential, rules, staged
from rigid_envs.wrappers.base import RuleWrapper
from rigid_envs.wrappers.rule import Transition

Array = np.ndarray
Infos = dict[str, Any]


class VectorRewardWrapper(RuleWrapper, VectorWrapper):  # generic from Gymnasium 1.3 on
    """Applies a rule to a vector environment of any autoreset mode. Subclasses set the rule.

    Args:
        env: a vector environment with goals.
        *args: arguments of the rule.
        **kwargs: arguments of the rule.

    Raises:
        TypeError: another kind of environment, or an argument of another type.
        ValueError: an argument is out of range, or the environment declares no autoreset mode.
    """

    wraps = (VectorEnv, "rigid_envs.wrappers.vector", gym.Env, "rigid_envs.wrappers")
    state_fields = ("_memory", "_was_reset", "_ended")

    def __init__(self, env: VectorEnv, *args: Any, **kwargs: Any) -> None:
        """Checks the environment and the arguments of the rule."""
        self._build_rule(env, "single_observation_space", args, kwargs)
        self._check_action_space(env.single_action_space)
        mode = env.metadata.get("autoreset_mode")
        if not isinstance(mode, AutoresetMode):
            raise ValueError(
                'metadata["autoreset_mode"] must be a gymnasium.vector.AutoresetMode, since the '
                f"reward at the end of an episode depends on it; got {mode!r}"
            )
        self._mode = mode
        self._ended = np.zeros(env.num_envs, dtype=bool)
        VectorWrapper.__init__(self, env)

    def reset(self, *, seed: Any = None, options: Infos | None = None) -> tuple[Any, Infos]:
        """Starts episodes. Their info has no terms of the rule, since there is no reward yet."""
        mask = (options or {}).get("reset_mask")
        mask = np.ones(self.num_envs, dtype=bool) if mask is None else np.array(mask)
        observation, infos = self.env.reset(seed=seed, options=options)
        self._check_info(infos)
        memory = self.rule.memory(observation, np.full(self._actions_shape, np.nan))
        if memory is not None and self._memory is not None:
            memory[~mask] = self._memory[~mask]
        self._memory = memory
        self._ended &= ~mask
        self._was_reset = True
        return observation, infos

    def step(self, actions: Any) -> tuple[Any, Array, Array, Array, Infos]:
        """A step of the wrapped environment, with the rewards of the rule."""
        self._check_was_reset()
        observation, reward, terminated, truncated, infos = self.env.step(actions)
        self._check_info(infos)
        ended = np.logical_or(terminated, truncated)
        none = np.zeros_like(ended)
        # worlds in which this step was the reset, and worlds that were reset after this step
        started = self._ended if self._mode is AutoresetMode.NEXT_STEP else none
        replaced = ended if self._mode is AutoresetMode.SAME_STEP else none
        clipped = self._clip_actions(actions, self.env.action_space)

        last, read = observation, infos
        if replaced.any():
            last = _last_observation(observation, infos, replaced)
            read = {name: _last_term(infos, name, replaced) for name in self.rule.info_terms}
        step = Transition(last, clipped, np.asarray(terminated))
        new_reward, terms = self._apply_rule(reward, step, read)
        new_reward = np.where(started, reward, new_reward)
        self._memory = self.rule.memory(
            observation, np.where((started | replaced)[:, None], np.nan, clipped)
        )
        self._ended = ended
        infos = _add_terms(infos, terms, started, replaced)
        return observation, new_reward, terminated, truncated, infos

    @property
    def _actions_shape(self) -> tuple[int, ...]:
        shape = self.env.single_action_space.shape
        size = shape if shape is not None and self.rule.needs_action else (0,)
        return (self.num_envs, *size)


def _last_observation(observation: Any, infos: Infos, replaced: Array) -> dict[str, Array]:
    """Observations after the step; of replaced worlds, the last one of the episode that ended."""
    last = {name: np.array(values) for name, values in observation.items()}
    for i in np.flatnonzero(replaced):
        for name, value in infos["final_obs"][i].items():
            last[name][i] = value
    return last


def _last_term(infos: Infos, name: str, replaced: Array) -> Array:
    """A term [count] after the step; of replaced worlds, that of the episode that ended."""
    return np.where(replaced, infos["final_info"][name], infos[name])


def _add_terms(infos: Infos, terms: dict[str, Array], started: Array, replaced: Array) -> Infos:
    """Infos with the terms of the rule, and Gymnasium's masks of the worlds that have them."""
    infos = dict(infos)
    parts = [(infos, ~(started | replaced))]
    if replaced.any():
        infos["final_info"] = dict(infos["final_info"])
        parts.append((infos["final_info"], replaced))
    for part, mask in parts:
        if mask.any():
            for name, values in terms.items():
                if name == STEP_GOALS and name in part:
                    continue  # already there, for worlds that were just reset too
                rows = mask.reshape(-1, *(1,) * (values.ndim - 1))
                part[name] = np.where(rows, values, np.zeros_like(values))
                part[f"_{name}"] = mask.copy()
    return infos


class StagedReward(VectorRewardWrapper):
    """`staged.StagedReward` for vector environments."""

    rule_type = staged.StagedReward


class PotentialShaping(VectorRewardWrapper):
    """`potential.PotentialShaping` for vector environments."""

    rule_type = potential.PotentialShaping


class ActionPenalty(VectorRewardWrapper):
    """`rules.ActionPenalty` for vector environments."""

    rule_type = rules.ActionPenalty


class SmoothnessPenalty(VectorRewardWrapper):
    """`rules.SmoothnessPenalty` for vector environments."""

    rule_type = rules.SmoothnessPenalty


class SuccessBonus(VectorRewardWrapper):
    """`rules.SuccessBonus` for vector environments."""

    rule_type = rules.SuccessBonus


class TimePenalty(VectorRewardWrapper):
    """`rules.TimePenalty` for vector environments."""

    rule_type = rules.TimePenalty


class ScaleReward(VectorRewardWrapper):
    """`rules.ScaleReward` for vector environments."""

    rule_type = rules.ScaleReward


class BoundReward(VectorRewardWrapper):
    """`rules.BoundReward` for vector environments."""

    rule_type = rules.BoundReward
