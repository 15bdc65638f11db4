"""Loads trained policies from a run folder, a policy file, or a pickle that the user trusts."""

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from training.policies.policy import SCRIPTED, Policy, of_state
from training.policies.policy_file import SUFFIX, read_policy
from training.runs.run_folder import RunFolder
from training.settings.algorithms import ALGORITHMS
from training.settings.data_folders import data_folder
from training.settings.environment_ids import plain_id
from training.settings.environments import registered_arguments
from training.settings.errors import UsageError, check_exists, one_of
from training.settings.tasks import check_same_task

WITHOUT_REPLAY_BUFFER: dict[str, Any] = {
    "replay_buffer_class": None,
    "replay_buffer_kwargs": {},
    "buffer_size": 1,
}
"""Acting needs no replay buffer, and HerReplayBuffer cannot be built without environments."""


SHIPPED = "trained"
"""In place of a path: the policy of an environment that comes with the package."""


def shipped_policy(env_id: str) -> Policy:
    """The policy of an environment that comes with the package; it is trained with PPO.

    Raises:
        UsageError: There is none.
    """
    folders = data_folder("shipped", "results") / "ppo"
    plain = plain_id(env_id)
    path = folders / f"{plain.replace('/', '-')}_seed0" / f"policy{SUFFIX}"
    if not path.is_file():
        files = folders.glob(f"*-v[0-9]_seed0/*{SUFFIX}")
        known = sorted(file.parent.name.removesuffix("_seed0") for file in files)
        raise UsageError(
            f"no trained policy of {env_id!r} comes with the package; there are "
            f"{', '.join(name.replace('-', '/', 1) for name in known)}"
        )
    name = f"{SHIPPED}-{plain.rpartition('/')[2]}"
    return replace(read_policy(path, env_id=env_id), name=name, folder=None)


def trained_policy(
    path: Path | str,
    *,
    algo: str | None = None,
    env_id: str | None = None,
    deterministic: bool = True,
    device: str = "cpu",
    trust_pickle: bool = False,
) -> Policy:
    """The policy of a run folder, of a policy file or of a model.zip.

    From a run folder the policy file is read, so nothing is unpickled. Stable-Baselines3's own
    files are read only for a model.zip, and to sample actions, because a policy file does not store
    the standard deviation. Loading them can run any code that they contain.

    Args:
        path: A run folder, a .safetensors file or the folder of one, or a model.zip with
            statistics and settings in the same folder.
        algo: Algorithm; required only for a model.zip outside a run folder.
        env_id: Environment id; required only for a model.zip outside a run folder, otherwise it
            replaces the one of training.
        deterministic: Use the mean action instead of a sample.
        device: Torch device of a model.zip.
        trust_pickle: Whether Stable-Baselines3's own files may be unpickled.

    Raises:
        UsageError: There is no such policy, the file is damaged or of another algorithm, or it
            would have to be unpickled without `trust_pickle`.
    """
    if algo is not None and algo not in ALGORITHMS:
        raise UsageError(f"unknown algorithm {algo!r}; {one_of(algo, ALGORITHMS)}")
    path = Path(path)
    check_exists(path, f'a run folder, a {SUFFIX} file, a model.zip, "{SHIPPED}" or "{SCRIPTED}"')
    exported = path / f"policy{SUFFIX}"
    if exported.is_file() and not (path / "run.json").exists():  # as the folders in results/
        path = exported
    if path.is_dir():
        folder = RunFolder(path)
        config = folder.config()
        if algo not in (None, config.algo):
            raise UsageError(f"{path} was trained with {config.algo}, not with {algo!r}")
        if deterministic and (folder.policy.exists() or not trust_pickle):
            if not folder.policy.exists():
                raise UsageError(
                    f"{path} has no checkpoint yet: {folder.policy.name} is missing"
                    + (_trust_hint(folder.model) if folder.model.exists() else "")
                )
            found = read_policy(folder.policy, algo=config.algo, env_id=env_id)
            return replace(found, name=f"{config.algo} ({path})", folder=path)
        return _unpickled(folder.model, algo, env_id, deterministic, device, trust_pickle)
    if path.suffix not in (SUFFIX, ".zip"):
        raise UsageError(
            f"{path} is not a policy; it should be a run folder, a {SUFFIX} file or a model.zip"
        )
    if path.suffix != SUFFIX:
        return _unpickled(path, algo, env_id, deterministic, device, trust_pickle)
    if not deterministic:
        raise UsageError(
            f"{path} stores only the mean action; to sample actions, give the run folder"
        )
    return read_policy(path, algo=algo, env_id=env_id)


def _trust_hint(file: Path) -> str:
    return (
        f"; {file.name} is a pickle, and loading it can run any code: "
        "add --trust-pickle if you trust its author"
    )


def _unpickled(
    file: Path,
    algo: str | None,
    env_id: str | None,
    deterministic: bool,
    device: str,
    trust_pickle: bool,
) -> Policy:
    """The policy of Stable-Baselines3's own files; arguments and errors as for `trained_policy`."""
    # in a run folder, model.zip is in the folder of a checkpoint
    in_run = (file.parent.parent / "run.json").exists()
    folder = RunFolder(file.parent.parent if in_run else file.parent)
    if not file.exists():
        raise UsageError(f"{folder.path} has no checkpoint yet: {file.name} is missing")
    if not trust_pickle:
        raise UsageError(f"{file} is not a {SUFFIX} file{_trust_hint(file)}")
    env_kwargs: dict[str, Any] = {}
    if (folder.path / "run.json").exists():
        config = folder.config()
        if algo not in (None, config.algo):
            raise UsageError(f"{file} was trained with {config.algo}, not with {algo!r}")
        algo, env_kwargs = config.algo, config.final_env_kwargs
        if env_id not in (None, config.env_id):
            check_same_task(config.env_id, env_id, str(file))
            env_kwargs = {**env_kwargs, **registered_arguments(env_id)}
        env_id = env_id or config.env_id
    if algo is None or env_id is None:
        raise UsageError(f"{file} is not in a run folder: give --algo and --env")

    # first: if training replaces the checkpoint meanwhile, the missing model is reported
    normalization = _load_normalization(file.parent / folder.normalization.name)
    model = _load_model(file, algo, device)

    def act(observation: dict[str, np.ndarray]) -> np.ndarray:
        if normalization is not None:
            observation = normalization.normalize_obs(observation)
        actions, _ = model.predict(observation, deterministic=deterministic)
        return actions

    observed = model.observation_space
    own = isinstance(observed, spaces.Dict) and "state" in observed.spaces
    shapes = None
    if isinstance(observed, spaces.Dict):
        shapes = {name: part.shape or () for name, part in observed.spaces.items()}
    name = f"{algo} ({file})"
    return Policy(act if own else of_state(act), env_id, name, env_kwargs, folder.path, shapes)


def _load_model(file: Path, algo: str, device: str) -> Any:
    from training.policies.algorithms import (
        ALGORITHM_CLASSES,  # imported here: reading a policy file needs no torch
    )

    try:
        return ALGORITHM_CLASSES[algo].load(
            file, device=device, custom_objects=WITHOUT_REPLAY_BUFFER
        )
    except Exception as error:  # a damaged file can raise any exception
        raise UsageError(f"{file} cannot be read as a {algo} policy: {error}") from error


def _load_normalization(file: Path) -> Any:
    if not file.exists():
        return None
    try:
        with file.open("rb") as stream:
            return pickle.load(stream)
    except Exception as error:
        raise UsageError(f"{file} cannot be read: {error}") from error
