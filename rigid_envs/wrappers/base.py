"""What the wrappers of single and of vector environments have in common."""

import inspect
from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv, VectorRewardWrapper, VectorWrapper
from gymnasium.wrappers.vector import NormalizeReward as VectorNormalizeReward

from rigid_envs.tasks.rewards import STEP_GOALS, Reward, describe_info, info_values, join_goals
from rigid_envs.wrappers.rule import Goals, Rule, Terms, Transition

Array = np.ndarray

# Gymnasium's own reward wrappers: they have no compute_reward
_GYMNASIUM_REWARD_WRAPPERS = (
    gym.RewardWrapper,
    gym.wrappers.NormalizeReward,
    VectorRewardWrapper,
    VectorNormalizeReward,
)


class RuleWrapper:
    """Applies a rule to the reward of an environment.

    Subclasses set `rule_type`. Their constructor takes `env` and the arguments of the rule.
    """

    rule_type: ClassVar[type[Rule]]
    __signature__: ClassVar[inspect.Signature]
    # base class of the environments to wrap, module of these wrappers; then those of the other kind
    wraps: ClassVar[tuple[type, str, type, str]]
    # attributes that change from step to step
    state_fields: ClassVar[tuple[str, ...]] = ("_memory", "_was_reset")
    env: Any

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Shows the arguments and the docstring of the rule as those of the wrapper."""
        super().__init_subclass__(**kwargs)
        if "rule_type" in cls.__dict__:
            env = inspect.Parameter("env", inspect.Parameter.POSITIONAL_OR_KEYWORD)
            parameters = inspect.signature(cls.rule_type).parameters.values()
            cls.__signature__ = inspect.Signature([env, *parameters])
            cls.__doc__ = f"{cls.__doc__}\n\n{inspect.getdoc(cls.rule_type)}"

    def _build_rule(self, env: Any, space: str, args: Any, kwargs: Any) -> None:
        """Builds the rule and checks the environment to wrap."""
        name = type(self).__name__
        kind, here, other, there = self.wraps
        if not isinstance(env, kind):
            hint = f"; use {there}.{name}" if isinstance(env, other) else ""
            raise TypeError(
                f"{here}.{name} wraps a gymnasium {kind.__name__}, got {_describe(env)}{hint}"
            )
        observed = getattr(env, space)
        has_goals = isinstance(observed, spaces.Dict) and all(
            goal in observed.spaces for goal in ("achieved_goal", "desired_goal")
        )
        if not has_goals or not any(
            hasattr(layer, "compute_reward") or hasattr(layer, "call") for layer in layers(env)
        ):
            raise TypeError(
                f"{name} wraps environments with goals: their observation contains achieved_goal "
                f"and desired_goal, and they have compute_reward. Got {_describe(env)}, which "
                f"observes {observed}. For environments without goals, see "
                "gymnasium.wrappers.TransformReward"
            )
        rule = self.rule = self.rule_type(*args, **kwargs)
        self._reward = _reward_of(env) if rule.needs_success else None
        if rule.needs_success and self._reward is None:
            raise TypeError(
                f"{name} needs the environment's definition of success: its attribute `reward` "
                f"must be a rigid_envs.tasks.rewards.Reward, which {_describe(env)} does not have"
            )
        # a second wrapper with the same rule appends a number to the names of its terms
        same = sum(
            isinstance(layer, RuleWrapper) and layer.rule_type is self.rule_type
            for layer in layers(env)
        )
        self._suffix = f"_{same + 1}" if same else ""
        self._memory: Any = None
        self._was_reset = False

    def _clip_actions(self, actions: Any, space: Any) -> Array:
        """Actions [..., k] clipped to the space; [..., 0] if the rule does not need them."""
        if not self.rule.needs_action:
            return np.zeros((*np.shape(actions)[:-1], 0))
        return np.clip(np.asarray(actions, dtype=np.float64), space.low, space.high)

    def _check_action_space(self, space: Any) -> None:
        if not self.rule.needs_action:
            return
        if not isinstance(space, spaces.Box):
            raise TypeError(
                f"{type(self).__name__} wraps environments whose action space is a Box, got {space}"
            )
        self.rule.check_actions(space.shape[-1] if space.shape else 1)

    def _check_was_reset(self) -> None:
        if not self._was_reset:
            raise gym.error.ResetNeeded(
                f"reset() of {type(self).__name__} must be called before step()"
            )

    def _check_info(self, info: Mapping[str, Any]) -> None:
        """Checks that the info has what the rule reads, and nothing that it would overwrite."""
        known = [name for name in info if not name.startswith("_")]
        for name in self.rule.info_terms:
            if name not in info:
                raise ValueError(
                    f"{type(self).__name__} needs the term {name!r} in info, which has {known}"
                )
        for name in self.rule.stored_terms:
            if name + self._suffix in info:
                raise ValueError(
                    f"{type(self).__name__} cannot add {name + self._suffix!r} to info, which "
                    "already has this entry: wrap the single environments or their vector, not both"
                )

    def _apply_rule(
        self, reward: Any, step: Transition, info: Mapping[str, Any]
    ) -> tuple[Array, dict[str, Array]]:
        """The new reward [...] of a step, and the entries to add to its info."""
        rule, observation = self.rule, step.observation
        stored = rule.step_terms(self._memory, step)
        read = {name: np.asarray(info[name]) for name in rule.info_terms}
        goals = Goals(observation["achieved_goal"], observation["desired_goal"], self._reward)
        reward = np.asarray(reward, dtype=np.float64)
        reward, raw = rule.apply(reward, goals, {**read, **stored})
        added = {name + self._suffix: value for name, value in {**stored, **raw}.items()}
        if rule.depends_on_goal:
            added[STEP_GOALS] = join_goals(goals.achieved, goals.desired)
        return reward, added

    def compute_reward(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """The reward that a step with these goals returns.

        Args:
            achieved_goal: [..., goal].
            desired_goal: [..., goal].
            info: the info of the step: a dict, or a sequence of dicts for a batch. It is ignored if
                the reward follows from the goals.

        Returns:
            Rewards [...]; a NumPy float for a single pair.

        Raises:
            ValueError: the reward does not follow from these goals and this info.
        """
        reward = _goal_method(self.env, "compute_reward")(achieved_goal, desired_goal, info)
        achieved, desired = np.asarray(achieved_goal), np.asarray(desired_goal)
        terms = self._terms_from(info, join_goals(achieved, desired))
        goals = Goals(achieved, desired, self._reward)
        reward, _ = self.rule.apply(np.asarray(reward), goals, terms)
        return np.float64(reward) if achieved.ndim == 1 else reward

    def compute_terminated(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """`compute_terminated` of the wrapped environment: wrappers do not change it."""
        return _goal_method(self.env, "compute_terminated")(achieved_goal, desired_goal, info)

    def compute_truncated(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """`compute_truncated` of the wrapped environment: wrappers do not change it."""
        return _goal_method(self.env, "compute_truncated")(achieved_goal, desired_goal, info)

    def _terms_from(self, info: Any, goals: Array) -> Terms:
        """Info terms and stored terms from the info of a step, for goals [..., 2 goal]."""
        rule, name = self.rule, type(self).__name__
        keys = {term: term for term in rule.info_terms}
        keys |= {term: term + self._suffix for term in rule.stored_terms}
        if not keys:
            return {}
        wanted = [*keys.values(), *([STEP_GOALS] if rule.depends_on_goal else [])]
        try:
            found = {key: info_values(info, key) for key in wanted}
        except (KeyError, TypeError):
            raise ValueError(
                f"{name}.compute_reward needs {wanted} in info, the info of the step; got "
                f"{describe_info(info)}. {rule.her_advice}"
            ) from None
        if rule.depends_on_goal and not np.array_equal(found[STEP_GOALS], goals):
            raise ValueError(
                f"{name}.compute_reward accepts only the goals of the step: {list(keys.values())} "
                f"in info are valid for no other goals. {rule.her_advice}"
            )
        return {term: found[key] for term, key in keys.items()}

    def get_state(self) -> dict[str, Any]:
        """The complete state of the episode, of this wrapper and of the wrapped environment."""
        own = {name: deepcopy(getattr(self, name)) for name in self.state_fields}
        return {"wrapped": _method(self.env, "get_state")(), **own}

    def set_state(self, state: Any) -> None:
        """Restores a state from `get_state`; the episode then continues bitwise identically.

        Raises:
            ValueError: not such a state, or one that the wrapped environment does not accept.
        """
        if not isinstance(state, dict) or set(state) != {"wrapped", *self.state_fields}:
            raise ValueError(
                f"state must come from get_state of {type(self).__name__}, got "
                f"{describe_info(state)}"
            )
        _method(self.env, "set_state")(state["wrapped"])
        for name in self.state_fields:
            setattr(self, name, deepcopy(state[name]))


def layers(env: Any) -> list[Any]:
    """The wrappers of an environment from the outside in, then the environment."""
    found = [env]
    while isinstance(found[-1], gym.Wrapper | VectorWrapper):
        found.append(found[-1].env)
    return found


def _method(env: Any, name: str) -> Callable[..., Any]:
    """The method of the outermost layer that has it."""
    for layer in layers(env):
        if hasattr(layer, name):
            return getattr(layer, name)
    raise AttributeError(f"{_describe(env)} has no method {name!r}")


def _goal_method(env: Any, name: str) -> Callable[[Array, Array, Any], Any]:
    """A method on goals, such as `compute_reward`, of the outermost layer that has it."""
    for layer in layers(env):
        if hasattr(layer, name):
            return getattr(layer, name)
        if name == "compute_reward" and isinstance(layer, _GYMNASIUM_REWARD_WRAPPERS):
            raise ValueError(
                f"compute_reward cannot account for Gymnasium's {type(layer).__name__}; use a "
                "wrapper of rigid_envs.wrappers instead"
            )
        if hasattr(layer, "call"):  # Gymnasium's vector of single environments
            return lambda *goals: layer.call(name, *goals)[0]
    raise AttributeError(f"{_describe(env)} has no method {name!r}")


def _reward_of(env: Any) -> Reward | None:
    """The task's reward, if the environment has one."""
    for layer in layers(env):
        reward = getattr(layer, "reward", None)
        if reward is None and hasattr(layer, "call"):
            try:
                reward = layer.get_attr("reward")[0]
            except AttributeError:
                reward = None
        if isinstance(reward, Reward):
            return reward
    return None


def _describe(env: Any) -> str:
    """Class and id of an environment, for error messages."""
    spec = getattr(env, "spec", None) if isinstance(env, gym.Env | VectorEnv) else None
    named = f" ({spec.id})" if spec is not None else ""
    return f"{type(getattr(env, 'unwrapped', env)).__name__}{named}"
