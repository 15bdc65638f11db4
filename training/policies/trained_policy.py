"""Trained policies by path: a run folder, a policy file, or a pickle that the user vouches for."""

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from training.policies.policy import Policy
from training.policies.policy_file import SUFFIX, read_policy
from training.runs.run_folder import RunFolder
from training.settings.config import ALGORITHMS
from training.settings.errors import UsageError, nearest

NO_REPLAY: dict[str, Any] = {
    "replay_buffer_class": None,
    "replay_buffer_kwargs": {},
    "buffer_size": 1,
}
"""Acting needs no replay buffer, and one for hindsight could not be made without environments."""


def trained_policy(
    path: Path,
    *,
    algo: str | None = None,
    env_id: str | None = None,
    deterministic: bool = True,
    device: str = "cpu",
    trust_pickle: bool = False,
) -> Policy:
    """The policy of a run folder, of a policy file or of a model.zip.

    A run folder is read by its policy file, so that nothing is unpickled. Only a model.zip, and
    drawing actions, for which a policy file lacks the spread, take Stable-Baselines3's own files.
    Loading those can run any code that is in them.

    Args:
        path: A run folder, a .policy file, or a model.zip; statistics and settings of the latter
            are looked for beside it.
        algo: Algorithm; needed only for a model.zip outside a run folder.
        env_id: Environment id; needed only there, elsewhere it replaces the one of training.
        deterministic: Act by the mean instead of drawing.
        device: Torch device of a model.zip.
        trust_pickle: Whether Stable-Baselines3's own files may be unpickled.

    Raises:
        UsageError: There is no such policy, the file is damaged or of another algorithm, or it
            would have to be unpickled without leave.
    """
    if algo is not None and algo not in ALGORITHMS:
        raise UsageError(f"unknown algorithm {algo!r}; did you mean {nearest(algo, ALGORITHMS)!r}?")
    if not path.exists():
        raise UsageError(f"{path} does not exist, should be a run folder or a {SUFFIX} file")
    if path.is_dir():
        folder = RunFolder(path)
        config = folder.config()
        if algo not in (None, config.algo):
            raise UsageError(f"{path} is a run of {config.algo}, not of {algo!r}")
        if deterministic and (folder.policy.exists() or not trust_pickle):
            if not folder.policy.exists():
                raise UsageError(
                    f"{path} holds no checkpoint yet: {folder.policy.name} is missing"
                    + (_leave(folder.model) if folder.model.exists() else "")
                )
            found = read_policy(folder.policy, algo=config.algo, env_id=env_id or config.env_id)
            # those that training finished on
            return replace(found, name=f"{config.algo} ({path})", folder=path)
        return _unpickled(folder.model, algo, env_id, deterministic, device, trust_pickle)
    if path.suffix not in (SUFFIX, ".zip"):
        raise UsageError(f"{path} is no policy, should be a run folder, {SUFFIX} file or model.zip")
    if path.suffix != SUFFIX:
        return _unpickled(path, algo, env_id, deterministic, device, trust_pickle)
    if not deterministic:
        raise UsageError(f"{path} acts by its mean only: drawing actions takes the run folder")
    return read_policy(path, algo=algo, env_id=env_id)


def _leave(file: Path) -> str:
    return (
        f"; loading {file.name} unpickles, which can run any code in it: "
        "add --trust-pickle if you made it"
    )


def _unpickled(
    file: Path,
    algo: str | None,
    env_id: str | None,
    deterministic: bool,
    device: str,
    trust_pickle: bool,
) -> Policy:
    """The policy in Stable-Baselines3's own files; arguments and errors as of `trained_policy`."""
    # a model.zip lies in a checkpoint, and that in its run folder
    in_run = (file.parent.parent / "run.json").exists()
    folder = RunFolder(file.parent.parent if in_run else file.parent)
    if not file.exists():
        raise UsageError(f"{folder.path} holds no checkpoint yet: {file.name} is missing")
    if not trust_pickle:
        raise UsageError(f"{file} is no {SUFFIX} file{_leave(file)}")
    env_kwargs: dict[str, Any] = {}
    if (folder.path / "run.json").exists():
        config = folder.config()
        if algo not in (None, config.algo):
            raise UsageError(f"{file} is of a run of {config.algo}, not of {algo!r}")
        algo, env_id, env_kwargs = config.algo, env_id or config.env_id, config.last_env_kwargs
    if algo is None or env_id is None:
        raise UsageError(f"{file} lies in no run folder: say --algo and --env")

    # first: should training replace the checkpoint meanwhile, the model is missing, which is told
    normalization = _load_normalization(file.parent / folder.normalization.name)
    model = _load_model(file, algo, device)

    def act(observation: dict[str, np.ndarray]) -> np.ndarray:
        if normalization is not None:
            observation = normalization.normalize_obs(observation)
        actions, _ = model.predict(observation, deterministic=deterministic)
        return actions

    return Policy(act, env_id, f"{algo} ({file})", env_kwargs, folder.path)


def _load_model(file: Path, algo: str, device: str) -> Any:
    from training.policies.algorithms import (
        ALGORITHM_CLASSES,  # here, for a policy file needs no torch
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
