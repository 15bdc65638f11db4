"""The interface of a policy, trained or scripted, for evaluation and video."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

from gymnasium import spaces

from training.scripted import Controller, controller_for
from training.settings.errors import UsageError

SCRIPTED = "scripted"


@dataclass(frozen=True)
class Policy:
    """A function from observations to actions, and the environment that it is for."""

    act: Controller
    """Takes observations, a dict of (n, ...) arrays; returns actions (n, action_dim)."""
    env_id: str
    """Environment id."""
    name: str
    """Name in tables and titles."""
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    """Arguments of the environment that the policy was trained or written for."""
    folder: Path | None = None
    """Folder that holds the policy; None for a scripted one."""
    shapes: Mapping[str, tuple[int, ...]] | None = None
    """Of one world's observations that it requires, by key; None if that isn't known."""

    def check(self, space: spaces.Space[Any]) -> None:
        """Raises UsageError for an environment with other observations, before it is reset.

        Args:
            space: Of one world's observations.
        """
        if self.shapes is None:
            return
        parts = dict(space.spaces) if isinstance(space, spaces.Dict) else {}
        if "state" in parts and "state" not in self.shapes and len(self.shapes["observation"]) == 1:
            parts["observation"] = parts["state"]  # as `of_state`
        check_shapes(self.shapes, {name: part.shape or () for name, part in parts.items()})


def check_shapes(
    required: Mapping[str, tuple[int, ...]], given: Mapping[str, tuple[int, ...]]
) -> None:
    """Raises UsageError if an observation lacks one of the required shapes."""
    found = {name: given[name] for name in required if name in given}
    if found != required:
        raise UsageError(
            f"the policy requires observations of shapes {dict(required)}, but the environment "
            f"has {found}; does it have the same task and arguments as in training?"
        )


def scripted_policy(env_id: str, **env_kwargs: Any) -> Policy:
    """The scripted controller of an environment.

    Args:
        env_id: Environment id.
        env_kwargs: Arguments of the environment. Those that the controller has parameters for are
            passed to it as well, as `obstacles` of Push, which is not observed.

    Raises:
        UsageError: The id is unknown, its task has no controller, or the state is not observed.
    """
    controller = controller_for(env_id)
    if env_kwargs.get("obs_type") in ("pixels", "flat"):
        raise UsageError(
            f"obs_type is {env_kwargs['obs_type']!r}, should be 'state' or 'pixels+state': a "
            "scripted controller acts from the state, by name"
        )
    parameters = signature(controller).parameters
    passed = {name: value for name, value in env_kwargs.items() if name in parameters}
    return Policy(of_state(partial(controller, **passed)), env_id, SCRIPTED, env_kwargs)


def of_state(act: Controller) -> Controller:
    """A policy of the state that also acts where the state is observed beside pixels."""

    def acting(observation: dict[str, Any]) -> Any:
        if "state" in observation:
            observation = {**observation, "observation": observation["state"]}
        return act(observation)

    return acting
