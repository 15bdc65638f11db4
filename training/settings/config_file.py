"""Reads training settings from YAML files keyed by environment id, and from KEY:VALUE words.

rl-baselines3-zoo passes unknown settings to Stable-Baselines3, which rejects them. Therefore a file
may hold this project's own settings in top-level sections, each keyed by environment id, which the
zoo ignores.
"""

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import gymnasium as gym
import yaml

import rigid_envs  # noqa: F401  (registers the ids)
from training.settings.algorithms import ALGORITHMS
from training.settings.config import TrainConfig
from training.settings.data_folders import data_folder
from training.settings.environment_ids import plain_id
from training.settings.errors import UsageError, check_exists, nearest, one_of

CONFIG_FOLDER = data_folder("configs", "configs")
"""The packaged settings."""
SECTIONS = (
    "eval_env_kwargs", "eval_freq", "n_eval_episodes", "target_success_rate",
    "finetune_timesteps", "finetune_env_kwargs", "cloning_steps", "cloning_weight",
)  # fmt: skip
"""This project's own settings that may be top-level sections of a file."""
DEFAULT = "default"
"""Entry of a file that holds for registered environments without one of their own."""


def load_config(algo: str, env_id: str, path: Path | None = None) -> TrainConfig:
    """Reads the settings of an algorithm for an environment.

    A dense id such as RigidEnvs/PushDense-v0 has the settings of RigidEnvs/Push-v0, if those train
    with `reward_type: dense` and the file has no settings of its own for the dense id. A registered
    environment without settings has those of the entry `default`, if there is one.

    Args:
        algo: "ppo" or "sac".
        env_id: Environment id, a key of the file.
        path: A YAML file; by default the packaged configs/<algo>.yaml.

    Raises:
        UsageError: The algorithm, the environment, a key or a value is invalid.
    """
    if algo not in ALGORITHMS:
        raise UsageError(f"unknown algorithm {algo!r}; {one_of(algo, ALGORITHMS)}")
    source = str(path) if path is not None else f"configs/{algo}.yaml"
    entries = _read_yaml(path if path is not None else CONFIG_FOLDER / f"{algo}.yaml", source)
    key = _entry_of(env_id, entries)
    sections = {name: entries.pop(name, {}) for name in SECTIONS}
    default = entries.pop(DEFAULT, None)
    if default is not None and key not in entries and env_id in gym.registry:
        entries[key] = default
    _check_entries(entries, env_id, source)
    _check_sections(sections, entries, source)
    if key not in entries:
        names = [str(name) for name in entries]
        raise UsageError(
            f"{source}: no settings for environment {env_id!r}"
            + (
                "; "
                if env_id in gym.registry
                else f", which isn't registered; did you mean {nearest(env_id, names)!r}? "
            )
            + f"there are those of {', '.join(names)}; "
            + ("HER needs the sparse reward; " if algo == "sac" and "Dense" in env_id else "")
            + "to use your own settings: --config FILE"
        )
    settings = entries[key]
    if not isinstance(settings, dict):
        raise UsageError(f"{source}: {key} is {settings!r}, should be a mapping of settings")
    for name, values in sections.items():
        if key in values:
            if name in settings:
                raise UsageError(f"{source}: {key}: {name} is given twice, should be given once")
            settings = {**settings, name: values[key]}
    return ALGORITHMS[algo].from_mapping(env_id, settings, source)


def packaged_environments(algo: str) -> list[str]:
    """Ids of the environments that an algorithm's packaged file has settings for, sparse or dense.

    Of ids with the same settings, which are aliases in the file, the first one.
    """
    source = f"configs/{algo}.yaml"
    entries = _read_yaml(CONFIG_FOLDER / f"{algo}.yaml", source)
    return [
        name
        for name in entries
        if name not in (*SECTIONS, DEFAULT) and (name == _entry_of(name, entries))
    ]


def parse_settings(words: Sequence[str], source: str) -> dict[str, Any]:
    """Reads settings given as KEY:VALUE; each value is YAML.

    Raises:
        UsageError: A word has no key or no colon, or its value is not YAML.
    """
    settings = {}
    for word in words:
        key, colon, value = word.partition(":")
        if not key or not colon:
            last = source == "--env-kwargs" and "=" not in word
            hint = f"; a run or policy goes before {source}" if last else ""
            raise UsageError(f"{source}: {word!r} should be KEY:VALUE{hint}")
        try:
            settings[key] = yaml.safe_load(value)
        except yaml.YAMLError:
            raise UsageError(f"{source}: {key} is {value!r}, should be a YAML value") from None
    return settings


def _entry_of(env_id: str, entries: dict[Any, Any]) -> str:
    """The key of the settings for an environment: its id, or the plain id of a dense one.

    An alias, `RigidEnvs/PushDense-v0: *Push`, is the same object as what it stands for, so that the
    sections of the plain id hold for it, too.
    """
    plain = entries.get(plain_id(env_id))
    if entries.get(env_id, plain) is not plain or not isinstance(plain, dict):
        return env_id
    arguments = plain.get("env_kwargs")
    dense = isinstance(arguments, dict) and arguments.get("reward_type") == "dense"
    return plain_id(env_id) if dense else env_id


def _check_entries(entries: dict[Any, Any], env_id: str, source: str) -> None:
    """Raises UsageError for a top-level key that is neither an environment nor a section."""
    for name, value in entries.items():
        similar = get_close_matches(str(name), SECTIONS, 1)
        if similar or not (isinstance(value, dict) or name == env_id):
            raise UsageError(
                f"{source}: {name!r} is neither an environment id nor one of {', '.join(SECTIONS)}"
                + (f"; did you mean {similar[0]!r}?" if similar else "")
            )
    if not entries:
        raise UsageError(f"{source}: should be a mapping from environment ids to settings")


def _check_sections(sections: dict[str, Any], entries: dict[Any, Any], source: str) -> None:
    """Raises UsageError for a section that is not keyed by environments of the file."""
    for name, values in sections.items():
        if not isinstance(values, dict):
            raise UsageError(f"{source}: {name} is {values!r}, should be keyed by environment id")
        for env_id in values:
            if env_id not in entries:
                known = [str(entry) for entry in entries]
                raise UsageError(
                    f"{source}: {name}: no settings for environment {env_id!r}; "
                    f"did you mean {nearest(str(env_id), known)!r}?"
                )


def _read_yaml(file: Path, source: str) -> dict[Any, Any]:
    check_exists(file, "a YAML file of settings")
    try:
        entries = yaml.safe_load(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"{source}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UsageError(f"{source}: not a text file in UTF-8") from None
    except yaml.YAMLError as error:
        raise UsageError(f"{source}: not valid YAML: {' '.join(str(error).split())}") from None
    if not isinstance(entries, dict) or not entries:
        raise UsageError(f"{source}: should be a mapping from environment ids to settings")
    return entries
