"""What the wrappers of both kinds share: what they may wrap, and the reward of relabelled goals."""

import inspect
from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv, VectorRewardWrapper, VectorWrapper
from gymnasium.wrappers.vector import NormalizeReward as VectorNormalizeReward

from rigid_envs.tasks.rewards import GOALS_OF_TERMS, Reward, column, goals_of_terms
from rigid_envs.wrappers.rule import Goals, Rule, Terms, Transition

Array = np.ndarray

# of Gymnasium; they change rewards and say nothing of goals
_BLIND = (
    gym.RewardWrapper,
    gym.wrappers.NormalizeReward,
    VectorRewardWrapper,
    VectorNormalizeReward,
)


class Wrapping:
    """A rule on an environment.

    Subclasses name a rule in `rule_type`; the rule's arguments follow `env` in their constructor.
    """

    rule_type: ClassVar[type[Rule]]
    __signature__: ClassVar[inspect.Signature]
    # kind of environment, and where the wrappers of the other kind are
    wraps: ClassVar[tuple[type, str, type, str]]
    # what changes from step to step
    remembers: ClassVar[tuple[str, ...]] = ("_memory", "_begun")
    env: Any

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Shows the rule's arguments and docstring as the wrapper's."""
        super().__init_subclass__(**kwargs)
        if "rule_type" in cls.__dict__:
            env = inspect.Parameter("env", inspect.Parameter.POSITIONAL_OR_KEYWORD)
            of_rule = inspect.signature(cls.rule_type).parameters.values()
            cls.__signature__ = inspect.Signature([env, *of_rule])
            cls.__doc__ = f"{cls.__doc__}\n\n{inspect.getdoc(cls.rule_type)}"

    def _begin(self, env: Any, space: str, args: Any, kwargs: Any) -> None:
        """Makes the rule and checks what is to be wrapped."""
        name = type(self).__name__
        kind, here, other, there = self.wraps
        if not isinstance(env, kind):
            hint = f"; use {there}.{name}" if isinstance(env, other) else ""
            raise TypeError(
                f"{here}.{name} wraps a gymnasium {kind.__name__}, got {_shown(env)}{hint}"
            )
        observed = getattr(env, space)
        has_goals = isinstance(observed, spaces.Dict) and all(
            goal in observed.spaces for goal in ("achieved_goal", "desired_goal")
        )
        if not has_goals or not any(
            hasattr(layer, "compute_reward") or hasattr(layer, "call") for layer in layers(env)
        ):
            raise TypeError(
                f"{name} wraps environments with goals, whose observations hold achieved_goal and "
                f"desired_goal and which have compute_reward; got {_shown(env)}, which observes "
                f"{observed}. Without goals, see gymnasium.wrappers.TransformReward"
            )
        rule = self.rule = self.rule_type(*args, **kwargs)
        self._reward = _reward_of(env) if rule.judges else None
        if rule.judges and self._reward is None:
            raise TypeError(
                f"{name} asks the environment when a goal is reached: its attribute `reward` must "
                f"be a rigid_envs.tasks.rewards.Reward, which {_shown(env)} has not"
            )
        # a second wrapper of the same rule numbers its terms, lest it overwrite the first's
        same = sum(
            isinstance(layer, Wrapping) and layer.rule_type is self.rule_type
            for layer in layers(env)
        )
        self._suffix = f"_{same + 1}" if same else ""
        self._memory: Any = None
        self._begun = False

    def _actions(self, actions: Any, space: Any) -> Array:
        """Actions [..., k] as they are carried out; none where the rule doesn't look at them."""
        if not self.rule.acts:
            return np.zeros((*np.shape(actions)[:-1], 0))
        return np.clip(np.asarray(actions, dtype=np.float64), space.low, space.high)

    def _check_actions(self, space: Any) -> None:
        if self.rule.acts and not isinstance(space, spaces.Box):
            raise TypeError(
                f"{type(self).__name__} wraps environments whose actions are a Box, got {space}"
            )

    def _check_begun(self) -> None:
        if not self._begun:
            raise gym.error.ResetNeeded(
                f"reset() of {type(self).__name__} must be called before step()"
            )

    def _check_terms(self, info: Mapping[str, Any]) -> None:
        """Whether the info holds what the rule reads and nothing that it would overwrite."""
        known = [name for name in info if not name.startswith("_")]
        for name in self.rule.reads:
            if name not in info:
                raise ValueError(
                    f"{type(self).__name__} reads the term {name!r} of the info, which has {known}"
                )
        for name in self.rule.kept:
            if name + self._suffix in info:
                raise ValueError(
                    f"{type(self).__name__} can't tell {name + self._suffix!r} in the info, which "
                    f"has it already; wrap single or vector environments, not both"
                )

    def _pay(
        self, reward: Any, step: Transition, info: Mapping[str, Any]
    ) -> tuple[Array, dict[str, Array]]:
        """The new reward [...] of a step, and what to add to its info."""
        rule, observation = self.rule, step.observation
        history = rule.history(self._memory, step)
        read = {name: np.asarray(info[name]) for name in rule.reads}
        goals = Goals(observation["achieved_goal"], observation["desired_goal"], self._reward)
        paid, told = rule.pay(np.asarray(reward, dtype=np.float64), goals, {**read, **history})
        own = {name + self._suffix: value for name, value in {**history, **told}.items()}
        if rule.of_goal:
            own[GOALS_OF_TERMS] = goals_of_terms(goals.achieved, goals.desired)
        return paid, own

    def compute_reward(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """The reward of goals [..., goal]: what a step pays that ends with them.

        Args:
            achieved_goal: [..., goal].
            desired_goal: [..., goal].
            info: of the step: a dict, or a sequence of dicts for a batch; looked at only where
                the goals don't tell the reward.

        Raises:
            ValueError: the reward doesn't follow from these goals and this info.
        """
        reward = _compute_reward_of(self.env)(achieved_goal, desired_goal, info)
        achieved, desired = np.asarray(achieved_goal), np.asarray(desired_goal)
        terms = self._recall(info, goals_of_terms(achieved, desired))
        paid, _ = self.rule.pay(np.asarray(reward), Goals(achieved, desired, self._reward), terms)
        return float(paid) if achieved.ndim == 1 else paid

    def _recall(self, info: Any, goals: Array) -> Terms:
        """The terms that goals [..., 2 goal] can't tell, from the info of a step."""
        rule, name = self.rule, type(self).__name__
        keys = {term: term for term in rule.reads}
        keys |= {term: term + self._suffix for term in rule.kept}
        if not keys:
            return {}
        wanted = [*keys.values(), *([GOALS_OF_TERMS] if rule.of_goal else [])]
        try:
            found = {key: column(info, key) for key in wanted}
        except (KeyError, TypeError):
            raise ValueError(
                f"{name}.compute_reward needs {wanted} of the step's info, got "
                f"{_names(info)}. {_sentence(rule.advice)}"
            ) from None
        if rule.of_goal and not np.array_equal(found[GOALS_OF_TERMS], goals):
            raise ValueError(
                f"{name}.compute_reward can't move the goal: {list(keys.values())} of the info "
                f"hold for the step's own goals alone. {_sentence(rule.advice)}"
            )
        return {term: found[key] for term, key in keys.items()}

    def get_state(self) -> dict[str, Any]:
        """Everything that the episode holds, here and in the wrapped environment."""
        own = {name: deepcopy(getattr(self, name)) for name in self.remembers}
        return {"wrapped": _method(self.env, "get_state")(), **own}

    def set_state(self, state: Any) -> None:
        """Takes the episode back to what `get_state` gave, to the last bit.

        Raises:
            ValueError: not such a state, or one that the environment refuses.
        """
        if not isinstance(state, dict) or set(state) != {"wrapped", *self.remembers}:
            raise ValueError(
                f"state must come from get_state of {type(self).__name__}, got {_names(state)}"
            )
        _method(self.env, "set_state")(state["wrapped"])
        for name in self.remembers:
            setattr(self, name, deepcopy(state[name]))


def layers(env: Any) -> list[Any]:
    """The environment and its wrappers, from the outside in."""
    found = [env]
    while isinstance(found[-1], gym.Wrapper | VectorWrapper):
        found.append(found[-1].env)
    return found


def _method(env: Any, name: str) -> Callable[..., Any]:
    """The method of the outermost layer that has it."""
    for layer in layers(env):
        if hasattr(layer, name):
            return getattr(layer, name)
    raise AttributeError(f"{_shown(env)} has no method {name!r}")


def _compute_reward_of(env: Any) -> Callable[[Array, Array, Any], Any]:
    for layer in layers(env):
        if hasattr(layer, "compute_reward"):
            return layer.compute_reward
        if isinstance(layer, _BLIND):
            raise ValueError(
                f"compute_reward doesn't know what {type(layer).__name__} of Gymnasium does to the "
                "reward; for goals, take a wrapper of rigid_envs.wrappers in its place"
            )
        if hasattr(layer, "call"):  # Gymnasium's vector of single environments
            return lambda *goals: layer.call("compute_reward", *goals)[0]
    raise AttributeError(f"{_shown(env)} has no compute_reward")


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


def _names(info: Any) -> str:
    """What an info or a state holds, in few words."""
    if isinstance(info, Mapping):
        return f"a dict with {sorted(map(str, info))}"
    if isinstance(info, list | tuple | np.ndarray) and len(info):
        return f"{len(info)} infos, of which the first is {_names(info[0])}"
    return repr(info)


def _sentence(advice: str) -> str:
    return advice[:1].upper() + advice[1:]


def _shown(env: Any) -> str:
    spec = getattr(env, "spec", None) if isinstance(env, gym.Env | VectorEnv) else None
    named = f" ({spec.id})" if spec is not None else ""
    return f"{type(getattr(env, 'unwrapped', env)).__name__}{named}"
