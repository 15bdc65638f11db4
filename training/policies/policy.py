"""The interface of a policy, trained or scripted, for evaluation and video."""

from dataclasses import dataclass, field
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

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
