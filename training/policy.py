"""A policy to evaluate or film: a trained one or a scripted one, behind one signature."""

import pickle
from dataclasses import dataclass, field
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np

from training.errors import UsageError, nearest
from training.run_folder import RunFolder
from training.scripted import CONTROLLERS, Controller

SCRIPTED = "scripted"
NO_REPLAY: dict[str, Any] = {
    "replay_buffer_class": None,
    "replay_buffer_kwargs": {},
    "buffer_size": 1,
}
"""Acting needs no replay buffer, and one for hindsight could not be made without environments."""


@dataclass(frozen=True)
class Policy:
    """What acts, and on what."""

    act: Controller
    """Takes observations `{key: (n, k)}`, returns actions `(n, action_dim)`."""
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


def trained_policy(
    path: Path,
    *,
    algo: str | None = None,
    env_id: str | None = None,
    deterministic: bool = True,
    device: str = "cpu",
) -> Policy:
    """The policy of a run folder, or of a model file.

    Loading unpickles: load only files that you trust.

    Args:
        path: A run folder, or a model.zip; statistics and settings are looked for beside it.
        algo: Algorithm; needed only for a model.zip outside a run folder.
        env_id: Environment id; needed only there, elsewhere it replaces the one of training.
        deterministic: Act by the mean instead of drawing.
        device: Torch device.

    Raises:
        UsageError: There is no such policy, or the file is damaged or of another algorithm.
    """
    folder = RunFolder(path if path.is_dir() else path.parent)
    model_file = folder.model if path.is_dir() else path
    if not path.exists():
        raise UsageError(f"{path} does not exist, should be a run folder or a model.zip")
    if not model_file.exists():
        raise UsageError(f"{folder.path} holds no checkpoint yet: {model_file.name} is missing")

    env_kwargs: dict[str, Any] = {}
    if path.is_dir() or (folder.path / "run.json").exists():
        config = folder.config()
        if algo not in (None, config.algo):
            raise UsageError(f"{path} is a run of {config.algo}, not of {algo!r}")
        algo, env_id, env_kwargs = config.algo, env_id or config.env_id, config.env_kwargs
    if algo is None or env_id is None:
        raise UsageError(f"{path} lies in no run folder: say --algo and --env")

    model = _load_model(model_file, algo, device)
    normalization = _load_normalization(folder.normalization)

    def act(observation: dict[str, np.ndarray]) -> np.ndarray:
        if normalization is not None:
            observation = normalization.normalize_obs(observation)
        actions, _ = model.predict(observation, deterministic=deterministic)
        return actions

    return Policy(act, env_id, f"{algo} ({path})", env_kwargs, folder.path)


def _load_model(file: Path, algo: str, device: str) -> Any:
    from training.train import ALGORITHM_CLASSES  # here, for a scripted policy needs no torch

    if algo not in ALGORITHM_CLASSES:
        raise UsageError(
            f"unknown algorithm {algo!r}; did you mean {nearest(algo, ALGORITHM_CLASSES)!r}?"
        )
    try:
        return ALGORITHM_CLASSES[algo].load(file, device=device, custom_objects=NO_REPLAY)
    except Exception as error:  # whatever a damaged or foreign file makes the reader raise
        raise UsageError(f"{file} cannot be read as a policy of {algo}: {error}") from error


def _load_normalization(file: Path) -> Any:
    if not file.exists():
        return None
    try:
        with file.open("rb") as stream:
            return pickle.load(stream)
    except Exception as error:
        raise UsageError(f"{file} cannot be read: {error}") from error
