"""A policy to evaluate or film: a trained one or a scripted one, behind one signature."""

from dataclasses import dataclass, field
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

from training.scripted import CONTROLLERS, Controller
from training.settings.errors import UsageError, nearest

SCRIPTED = "scripted"


@dataclass(frozen=True)
class Policy:
    """What acts, and on what."""

    act: Controller
    """Takes observations, a dict of (n, k) arrays, returns actions (n, action_dim)."""
    env_id: str
    """Environment that it acts on."""
    name: str
    """What to call it in tables and titles."""
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    """Arguments of the environment that it was trained on, or written for."""
    folder: Path | None = None
    """Where it is kept; None for a scripted one."""


def scripted_policy(env_id: str, **env_kwargs: Any) -> Policy:
    """The scripted controller of an environment.

    Args:
        env_id: Environment.
        env_kwargs: Its arguments; a controller with parameters of the same name is told them, as
            Push's is of `obstacles`, which no observation shows.

    Raises:
        UsageError: It has none.
    """
    if env_id not in CONTROLLERS:
        hint = f"; did you mean {nearest(env_id, CONTROLLERS)!r}?" if CONTROLLERS else ""
        raise UsageError(f"no scripted controller for environment {env_id!r}{hint}")
    controller = CONTROLLERS[env_id]
    told = {k: v for k, v in env_kwargs.items() if k in signature(controller).parameters}
    return Policy(partial(controller, **told), env_id, SCRIPTED, env_kwargs)
