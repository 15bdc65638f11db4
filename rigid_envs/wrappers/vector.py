"""Wrappers of vector environments, by the names that single environments' have."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper

from rigid_envs.tasks.rewards import GOALS_OF_TERMS
from rigid_envs.wrappers import potential, rules, staged
from rigid_envs.wrappers.rule import Transition
from rigid_envs.wrappers.wrapping import Wrapping

Array = np.ndarray
Infos = dict[str, Any]


class VectorRewardWrapper(Wrapping, VectorWrapper[Any, Any, Any, Any, Any]):
    """A rule on a vector environment, whatever its autoreset mode; subclasses name the rule.

    Args:
        env: with goals.
        *args: of the rule.
        **kwargs: of the rule.

    Raises:
        TypeError: another kind of environment, or an argument of another type.
        ValueError: an argument out of range; an environment that names no autoreset mode.
    """

    wraps = (VectorEnv, "rigid_envs.wrappers.vector", gym.Env, "rigid_envs.wrappers")
    remembers = ("_memory", "_begun", "_ended")

    def __init__(self, env: VectorEnv, *args: Any, **kwargs: Any) -> None:
        """Checks the environment and the rule's arguments."""
        self._begin(env, "single_observation_space", args, kwargs)
        self._check_actions(env.single_action_space)
        mode = env.metadata.get("autoreset_mode")
        if not isinstance(mode, AutoresetMode):
            raise ValueError(
                'metadata["autoreset_mode"] must be a gymnasium.vector.AutoresetMode, '
                f"got {mode!r}: where an episode ends, the reward depends on it"
            )
        self._mode = mode
        self._ended = np.zeros(env.num_envs, dtype=bool)
        VectorWrapper.__init__(self, env)

    def reset(self, *, seed: Any = None, options: Infos | None = None) -> tuple[Any, Infos]:
        """Starts episodes; their info has none of the rule's terms, as nothing was paid."""
        mask = (options or {}).get("reset_mask")
        mask = np.ones(self.num_envs, dtype=bool) if mask is None else np.array(mask)
        observation, infos = self.env.reset(seed=seed, options=options)
        self._check_terms(infos)
        fresh = self.rule.remember(observation, np.full(self._actions_shape, np.nan))
        if fresh is not None and self._memory is not None:
            fresh[~mask] = self._memory[~mask]
        self._memory = fresh
        self._ended &= ~mask
        self._begun = True
        return observation, infos

    def step(self, actions: Any) -> tuple[Any, Array, Array, Array, Infos]:
        """A step of the wrapped environment, paid by the rule."""
        self._check_begun()
        observation, reward, terminated, truncated, infos = self.env.step(actions)
        self._check_terms(infos)
        ended = np.logical_or(terminated, truncated)
        none = np.zeros_like(ended)
        # worlds for which this step was the reset, and those that were reset after it
        begun = self._ended if self._mode is AutoresetMode.NEXT_STEP else none
        replaced = ended if self._mode is AutoresetMode.SAME_STEP else none
        done = self._actions(actions, self.env.action_space)

        last, read = observation, infos
        if replaced.any():
            last = _last(observation, infos, replaced)
            read = {name: _final(infos, name, replaced) for name in self.rule.reads}
        paid, told = self._pay(reward, Transition(last, done, np.asarray(terminated)), read)
        paid = np.where(begun, reward, paid)
        self._memory = self.rule.remember(
            observation, np.where((begun | replaced)[:, None], np.nan, done)
        )
        self._ended = ended
        return observation, paid, terminated, truncated, _told(infos, told, begun, replaced)

    @property
    def _actions_shape(self) -> tuple[int, ...]:
        shape = self.env.single_action_space.shape
        return (self.num_envs, *(shape if shape is not None and self.rule.acts else (0,)))


def _last(observation: Any, infos: Infos, replaced: Array) -> dict[str, Array]:
    """Observations after the step, of the episodes that it belongs to."""
    last = {name: np.array(values) for name, values in observation.items()}
    for i in np.flatnonzero(replaced):
        for name, value in infos["final_obs"][i].items():
            last[name][i] = value
    return last


def _final(infos: Infos, name: str, replaced: Array) -> Array:
    """A term [count] after the step, of the episodes that it belongs to."""
    return np.where(replaced, infos["final_info"][name], infos[name])


def _told(infos: Infos, told: dict[str, Array], begun: Array, replaced: Array) -> Infos:
    """Infos with the rule's terms, by Gymnasium's masks: of no world that has just been reset."""
    infos = dict(infos)
    within = ~(begun | replaced)
    parts = [(infos, within)]
    if replaced.any():
        infos["final_info"] = dict(infos["final_info"])
        parts.append((infos["final_info"], replaced))
    for part, mask in parts:
        if mask.any():
            for name, values in told.items():
                if name == GOALS_OF_TERMS and name in part:
                    continue  # of worlds that were reset too, which it would take out
                rows = mask.reshape(-1, *(1,) * (values.ndim - 1))
                part[name] = np.where(rows, values, np.zeros_like(values))
                part[f"_{name}"] = mask.copy()
    return infos


class StagedReward(VectorRewardWrapper):
    """`staged.StagedReward` on a vector environment."""

    rule_type = staged.StagedReward


class PotentialShaping(VectorRewardWrapper):
    """`potential.PotentialShaping` on a vector environment."""

    rule_type = potential.PotentialShaping


class ActionPenalty(VectorRewardWrapper):
    """`rules.ActionPenalty` on a vector environment."""

    rule_type = rules.ActionPenalty


class SmoothnessPenalty(VectorRewardWrapper):
    """`rules.SmoothnessPenalty` on a vector environment."""

    rule_type = rules.SmoothnessPenalty


class SuccessBonus(VectorRewardWrapper):
    """`rules.SuccessBonus` on a vector environment."""

    rule_type = rules.SuccessBonus


class TimePenalty(VectorRewardWrapper):
    """`rules.TimePenalty` on a vector environment."""

    rule_type = rules.TimePenalty


class ScaleReward(VectorRewardWrapper):
    """`rules.ScaleReward` on a vector environment."""

    rule_type = rules.ScaleReward


class ClipReward(VectorRewardWrapper):
    """`rules.ClipReward` on a vector environment."""

    rule_type = rules.ClipReward
