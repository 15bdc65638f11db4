"""Writes episodes as a Minari dataset, from which Minari recovers the environment.

A dataset holds the exact specification of its environment, the seed of each episode, the name of
the policy, and reference scores: the mean returns of random actions and of an expert. Observations
and actions are stored bit for bit, so playing an episode's actions after `reset(seed=...)` gives
the same observations again.
"""

import json
import os
import re
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import minari
import numpy as np
from minari.data_collector import EpisodeBuffer
from minari.namespace import create_namespace, list_local_namespaces
from minari.storage import get_dataset_path

from training.datasets.record import Recorded, record_episodes
from training.policies.episodes import play_episodes
from training.policies.policy import Policy, scripted_policy
from training.policies.trained_policy import SHIPPED
from training.settings.environment_ids import dense_id, plain_id
from training.settings.environments import (
    check_episodes_end,
    make_single_env,
    make_vector_env,
    registered_arguments,
)
from training.settings.errors import UsageError
from training.settings.seed_ranges import DATASET
from training.settings.tasks import changed_arguments

Array = np.ndarray

RANDOM = "random"
WORLDS = 1024
REFERENCE_EPISODES = 100
FOLDER = "MINARI_DATASETS_PATH"
"""Environment variable with Minari's folder of datasets."""
# what Minari can read back; it takes a folder with an entry `data` for a dataset
_NAME = re.compile(r"(?:(?!data/)[-\w]{2,}/)*[-\w]+-v\d+", re.ASCII)
_LOCK = threading.Lock()


@dataclass(frozen=True)
class Written:
    """A dataset that was written.

    Attributes:
        dataset_id: its name in Minari.
        path: its folder.
        episodes: their number.
        steps: of all episodes.
        success: fraction of the episodes whose goal was met at the end.
        mean_return: mean sum of rewards.
        low_score: mean return of random actions.
        high_score: that of the expert; None if there is none.
        seconds: s that all of it took.
    """

    dataset_id: str
    path: Path
    episodes: int
    steps: int
    success: float
    mean_return: float
    low_score: float
    high_score: float | None
    seconds: float

    def __str__(self) -> str:
        """What was written, and how to read it."""
        high = "none" if self.high_score is None else f"{self.high_score:.2f}"
        return (
            f"{self.dataset_id}: {self.episodes:,} episodes, {self.steps:,} steps, "
            f"{self.success:.1%} solved, in {self.seconds:.1f} s\n"
            f"mean return {self.mean_return:.2f}; "
            f"reference scores, of {REFERENCE_EPISODES} episodes: "
            f"random actions {self.low_score:.2f}, expert {high}\n"
            f"in {self.path}\n"
            f'to read it: minari.load_dataset("{self.dataset_id}")'
        )


def random_policy(env_id: str, seed: int = 0, **env_kwargs: Any) -> Policy:
    """Actions that are uniform in the action space."""
    with closing(make_single_env(env_id, **env_kwargs)) as env:
        low, high = env.action_space.low, env.action_space.high  # type: ignore[attr-defined]
    draw = np.random.default_rng(seed)

    def act(observation: dict[str, Array]) -> Array:
        count = len(next(iter(observation.values())))
        return np.asarray(draw.uniform(low, high, (count, *low.shape)))

    return Policy(act, env_id, RANDOM, env_kwargs)


def default_id(
    env_id: str, policy: str, arguments: dict[str, Any], disturbance: tuple[float, float]
) -> str:
    """The name of a dataset, as rigid-envs/push-dense/scripted-v0 or .../scripted-noise-0-06-v0.

    Args:
        env_id: Environment id.
        policy: Name of the policy.
        arguments: Those of the environment; the name has those that make another task.
        disturbance: Noise and slowdown of the actions.
    """
    dense = {**registered_arguments(env_id), **arguments}.get("reward_type") == "dense"
    name = (dense_id if dense else plain_id)(env_id).rpartition("/")[2].rpartition("-v")[0]
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", name).lower()
    algorithm = SHIPPED if policy.startswith(f"{SHIPPED}-") else policy.partition(" ")[0]
    algorithm = re.sub(r"[^-\w]+", "-", algorithm).strip("-").lower()
    for key in changed_arguments(env_id, arguments):
        shown = re.sub(r"[^A-Za-z0-9]+", "-", json.dumps(arguments[key], default=str)).strip("-")
        algorithm += f"-{key}-{shown}"
    for word, value in zip(("noise", "slowdown"), disturbance, strict=True):
        algorithm += re.sub(r"[^\w]+", "-", f"-{word}-{float(value)!r}") if value else ""
    return f"rigid-envs/{words}/{algorithm}-v0"


def write_dataset(
    policy: Policy,
    episodes: int,
    dataset_id: str | None = None,
    *,
    seed: int = DATASET,
    action_noise: float = 0.0,
    slowdown: float = 0.0,
    replace_existing: bool = False,
    **env_kwargs: Any,
) -> Written:
    """Plays the episodes with the seeds seed, seed + 1, ... and writes them to Minari's folder.

    Args:
        policy: what acts.
        episodes: their number.
        dataset_id: (namespace/)name-v0; by default of policy, noise, slowdown and environment,
            with the arguments that make another task.
        seed: of the first episode.
        action_noise: standard deviation of normal noise on the actions, whose bounds are 1. What
            is recorded as actions is what the environment took, clipped to its bounds; so the
            episodes also show how the policy corrects errors. `infos["intended_action"]` holds
            what the policy chose, which is what to imitate (Laskey et al., DART: noise injection
            for robust imitation learning, CoRL 2017).
        slowdown: each step's movement, but not a grip, is multiplied by a number drawn from
            1 - slowdown to 1, before the noise. So the episodes also show what to do where the hand
            is slow or at rest.
        replace_existing: whether a dataset of this name may be replaced.
        env_kwargs: arguments of the environment that replace those of the policy.

    Raises:
        UsageError: a dataset of this name exists, the name or a number is invalid, the folder can't
            be written, or the environment rejects its arguments.
    """
    start = time.perf_counter()
    if episodes < 1:
        raise UsageError(f"number of episodes is {episodes}, should be at least 1")
    if not 0.0 <= action_noise < np.inf:
        raise UsageError(f"action_noise is {action_noise}, should be a number of at least 0")
    if not 0.0 <= slowdown <= 1.0:
        raise UsageError(f"slowdown is {slowdown}, should be a number from 0 to 1")
    arguments, disturbance = {**policy.env_kwargs, **env_kwargs}, (action_noise, slowdown)
    check_episodes_end(arguments)
    with closing(make_single_env(policy.env_id, **arguments)) as env:  # reports invalid arguments
        policy.check(env.observation_space)
    name = dataset_id or default_id(policy.env_id, policy.name, arguments, disturbance)
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"name of the dataset is {name!r}, should be like rigid-envs/push/scripted-v0: parts "
            "of at least two letters, digits, - or _, and a version"
        )
    _check_free(name, replace_existing)
    recorded = _play(policy, episodes, seed, disturbance, arguments)
    low, high = _scores(policy, arguments)
    path = _placed(
        name, replace_existing,
        lambda: _write(name, policy, disturbance, arguments, recorded, low, high),
    )  # fmt: skip
    returns = [float(one.rewards.sum(dtype=float)) for one in recorded]
    return Written(
        name, path, episodes, sum(len(one.rewards) for one in recorded),
        float(np.mean([one.success[-1] for one in recorded])), float(np.mean(returns)),
        low, high, time.perf_counter() - start,
    )  # fmt: skip


def _play(
    policy: Policy,
    episodes: int,
    seed: int,
    disturbance: tuple[float, float],
    arguments: dict[str, Any],
) -> list[Recorded]:
    worlds, draw = min(episodes, WORLDS), np.random.default_rng(seed)
    noise, slowdown = disturbance

    def disturb(actions: Array) -> Array:
        slowed = 1.0 - slowdown * draw.random((len(actions), 1))
        moved = np.where(moves, slowed * actions, actions)
        return moved + noise * draw.standard_normal(actions.shape)

    recorded: list[Recorded] = []
    with closing(make_vector_env(policy.env_id, worlds, **arguments)) as envs:
        moves = np.array([name != "grip" for name in envs.task.actions])  # type: ignore[attr-defined]
        for first in range(0, episodes, worlds):
            recorded += record_episodes(envs, policy.act, seed + first, disturb)
    return recorded[:episodes]


def _scores(policy: Policy, arguments: dict[str, Any]) -> tuple[float, float | None]:
    """Mean returns of random actions, and of the policy; of the scripted one if it is random.

    There is no expert where a scripted controller is missing, or does not see the state.
    """
    low = _mean_return(random_policy(policy.env_id, **arguments))
    expert = policy
    if policy.name == RANDOM:
        try:
            expert = scripted_policy(policy.env_id, **arguments)
        except UsageError:
            return low, None
    return low, _mean_return(replace(expert, env_kwargs=arguments))


def _mean_return(policy: Policy) -> float:
    with closing(make_vector_env(policy.env_id, REFERENCE_EPISODES, **policy.env_kwargs)) as envs:
        return float(play_episodes(envs, policy.act, DATASET).episode_return.mean())


def _write(
    name: str,
    policy: Policy,
    disturbance: tuple[float, float],
    arguments: dict[str, Any],
    recorded: Sequence[Recorded],
    low: float,
    high: float | None,
) -> None:
    buffers = [
        EpisodeBuffer(
            id=n, seed=one.seed, observations=one.observations, actions=one.actions,
            rewards=list(one.rewards), terminations=list(one.terminated),
            truncations=list(one.truncated), infos=_infos(one),
        )
        for n, one in enumerate(recorded)
    ]  # fmt: skip
    words = [
        f"{word} {value:g}"
        for word, value in zip(("action noise", "slowdown"), disturbance, strict=True)
        if value
    ]
    actor = f"{policy.name} with {' and '.join(words)}" if words else policy.name
    with closing(make_single_env(policy.env_id, **arguments)) as env, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".* is set to None")
        minari.create_dataset_from_buffers(
            name, buffers, env=env.spec, eval_env=env.spec, algorithm_name=actor,
            observation_space=env.observation_space, action_space=env.action_space,
            ref_min_score=None if high is None else low, ref_max_score=high,
            num_episodes_average_score=REFERENCE_EPISODES,
            description=f"{len(recorded)} episodes of {policy.env_id} by {actor}; each "
            "starts with reset(seed=...) of the seed in its metadata",
            requirements=[f"rigid-envs=={_version()}"], jpeg_encoding=False,
        )  # fmt: skip


def _infos(episode: Recorded) -> dict[str, Array]:
    """What Minari stores beside each observation; the first of a reset, which has no action."""
    intended = np.concatenate([np.full_like(episode.intended[:1], np.nan), episode.intended])
    return {"is_success": episode.success, "intended_action": intended}


def _version() -> str:
    try:
        return metadata.version("rigid-envs")
    except metadata.PackageNotFoundError:
        return "0"


def _check_free(name: str, replace_existing: bool) -> Path:
    """The folder of a new dataset.

    Raises:
        UsageError: it cannot be written, or a dataset of this name exists and must stay.
    """
    try:
        path = Path(get_dataset_path(name))
    except OSError as error:
        raise UsageError(f"the folder of datasets cannot be written: {error}") from None
    if path.exists() and not replace_existing:
        raise UsageError(
            f"a dataset {name!r} exists, in {path}: choose another --dataset-id, or --replace"
        )
    return path


def _placed(name: str, replace_existing: bool, write: Callable[[], None]) -> Path:
    """Writes a dataset in a folder that Minari does not list, then moves it to its place.

    So a dataset that is replaced stays until the new one is complete, and nothing of an incomplete
    one is seen, however this process ends. One that is killed may leave a folder `.unfinished-*`.
    """
    with _LOCK:  # the folder is an environment variable, which threads share
        path, root = Path(get_dataset_path(name)), Path(get_dataset_path())
        try:
            with tempfile.TemporaryDirectory(prefix=".unfinished-", dir=root) as folder:
                with _datasets_in(folder):
                    write()
                namespace = name.rpartition("/")[0]
                if namespace and namespace not in list_local_namespaces():
                    with suppress(ValueError):  # another process was faster
                        create_namespace(namespace)
                path.parent.mkdir(parents=True, exist_ok=True)
                if _check_free(name, replace_existing).exists():
                    _exchange(Path(folder) / name, path, Path(folder) / ".replaced")
                else:
                    (Path(folder) / name).rename(path)
        except OSError as error:
            raise UsageError(f"{path} cannot be written: {error}") from None
    return path


def _exchange(new: Path, path: Path, old: Path) -> None:
    """Moves `new` to `path`, and what was there to `old`; if that fails, it is there again."""
    path.rename(old)
    try:
        new.rename(path)
    except BaseException:
        if not path.exists():
            old.rename(path)
        raise


@contextmanager
def _datasets_in(folder: str) -> Iterator[None]:
    """Minari's folder of datasets is this one meanwhile."""
    before = os.environ.get(FOLDER)
    os.environ[FOLDER] = folder
    try:
        yield
    finally:
        if before is None:
            del os.environ[FOLDER]
        else:
            os.environ[FOLDER] = before
