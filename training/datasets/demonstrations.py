"""Reads the episodes of a Minari dataset as demonstrations for training."""

import importlib.util
from contextlib import closing
from typing import Any

import numpy as np

from training.datasets.record import Recorded
from training.settings.algorithms import SACConfig
from training.settings.environment_ids import plain_id
from training.settings.environments import make_single_env
from training.settings.errors import UsageError
from training.settings.tasks import changed_arguments, task_defaults

Array = np.ndarray

FREE = {
    "randomize", "max_episode_steps", "terminate_on_success", "partial_tower_start_prob",
    "near_grasp_start_prob", "task", "obs_type", "pixels", "frame_stack", "observe_parameters",
}  # fmt: skip
"""Arguments in which demonstrations may differ: starts, ends, parameters, and what is compared by
the shapes of the observation."""


def read_demonstrations(config: SACConfig) -> list[Recorded]:
    """The episodes of the dataset that the settings name.

    Args:
        config: The settings; `demonstrations` is set.

    Raises:
        UsageError: Minari is not installed; there is no such dataset, or it is damaged; it is of
            another environment, version or reward, or has other observations; or it has too few
            steps.
    """
    name = config.demonstrations
    if any(importlib.util.find_spec(module) is None for module in ("minari", "h5py")):
        raise UsageError(
            "demonstrations require minari and h5py; to install, in a clone: "
            'pip install -c constraints.txt -e ".[data]"'
        )
    import minari
    from minari.storage import get_dataset_path

    if not get_dataset_path(name).exists():
        raise UsageError(
            f"demonstrations is {name!r}, but there is no such dataset; it should be one in "
            "Minari's folder, as `rigid-envs dataset` writes it and `minari list local` shows it"
        )
    try:
        dataset = minari.load_dataset(name)
        episodes = [_recorded(episode) for episode in dataset.iterate_episodes()]
        spec = dataset.spec.env_spec
    except Exception as error:  # Minari and h5py raise exceptions of many types
        reason = " ".join(str(error).split())
        raise UsageError(
            f"demonstrations is {name!r}: {reason:.200}; it should be a dataset in Minari's "
            "folder, as `rigid-envs dataset` writes it and `minari list local` shows it"
        ) from None
    _check(config, spec, episodes)
    return episodes


def _recorded(episode: Any) -> Recorded:
    actions, infos = np.asarray(episode.actions), episode.infos or {}
    intended = infos.get("intended_action")
    return Recorded(
        seed=-1,
        observations={key: np.asarray(values) for key, values in episode.observations.items()},
        actions=actions,
        intended=actions if intended is None else np.asarray(intended)[1:],
        rewards=np.asarray(episode.rewards),
        terminated=np.asarray(episode.terminations, dtype=bool),
        truncated=np.asarray(episode.truncations, dtype=bool),
        success=np.asarray(infos.get("is_success", False), dtype=bool),
    )


def _task_of(spec: Any) -> set[str]:
    """Arguments of an environment that make another task, in which other actions are right."""
    return set(changed_arguments(spec.id, spec.kwargs)) - FREE


def _check(config: SACConfig, spec: Any, episodes: list[Recorded]) -> None:
    """Raises UsageError if the demonstrations do not fit the settings."""
    start = f"demonstrations is {config.demonstrations!r}, a dataset of"
    env_id = spec.id if spec is not None else "an unknown environment"
    if plain_id(env_id) != plain_id(config.env_id):
        raise UsageError(f"{start} {env_id}; it should be of {config.env_id}")
    with closing(make_single_env(config.env_id, **config.env_kwargs)) as env:
        spaces: Any = env.observation_space
        own: Any = env.spec
        action = env.action_space.shape
    reward_type, given = (one.kwargs.get("reward_type", "sparse") for one in (own, spec))
    if given != reward_type:
        raise UsageError(
            f"{start} the {given} reward; training has the {reward_type} one: record it with "
            f"--env-kwargs reward_type:{reward_type}"
        )
    for name in sorted({*_task_of(own), *_task_of(spec)}):
        default = task_defaults(own.id).get(name)
        recorded, wanted = (one.kwargs.get(name, default) for one in (spec, own))
        if recorded != wanted:
            raise UsageError(
                f"{start} {env_id} with {name} {recorded!r}; training has {wanted!r}: record it "
                "with the same --env-kwargs"
            )
    if not episodes:
        raise UsageError(f"{start} no episodes: record some with `rigid-envs dataset`")
    if (size := episodes[0].actions.shape[1:]) != action:
        raise UsageError(f"{start} actions of shape {size}; those of training have {action}")
    found = {key: values.shape[1:] for key, values in episodes[0].observations.items()}
    wanted = {key: space.shape for key, space in spaces.items()}
    if found != wanted:
        raise UsageError(
            f"{start} observations {found}; those of training are {wanted}: record it with the "
            "same --env-kwargs"
        )
    steps = sum(len(episode.rewards) for episode in episodes)
    needed = config.demonstration_batch
    if steps < needed:
        raise UsageError(
            f"{start} {len(episodes)} episodes with {steps} steps in all; it should have at least "
            f"{needed} steps, as each gradient step samples so many: record more episodes"
        )
