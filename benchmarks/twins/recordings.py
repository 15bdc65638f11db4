"""Recordings of the originals, which stay in the repository."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.twins import scripts
from training.results.originals import Originals

Array = np.ndarray

DATA = Path(__file__).with_name("data")
FIRST_SEED = 500_000
PROCESSES = 2
STARTS = 400  # recorded of each original


class Recording(NamedTuple):
    """Episodes of an original.

    Attributes:
        observations: [steps + 1, episodes, n].
        goals: [episodes, goal], desired.
        actions: [steps, episodes, actions].
    """

    observations: Array
    goals: Array
    actions: Array

    def save(self, name: str) -> None:
        """Writes the recording, in single precision."""
        parts = {key: values.astype(np.float32) for key, values in self._asdict().items()}
        np.savez_compressed(DATA / f"{name}.npz", **parts)

    @classmethod
    def load(cls, name: str) -> "Recording":
        """Reads a recording."""
        with np.load(DATA / f"{name}.npz") as file:
            return cls(*(file[key].astype(float) for key in cls._fields))


class Kind(NamedTuple):
    """How a recording is made.

    Attributes:
        env_id: id of the original.
        episodes: how many.
        steps: of each.
        actor: makes what chooses the actions, from the number of worlds and of components.
    """

    env_id: str
    episodes: int
    steps: int
    actor: Callable[[int, int], scripts.Actor]


FETCH_LOW, FETCH_HIGH = np.array([1.2, 0.6, 0.46]), np.array([1.49, 0.9, 0.69])
PANDA_LOW, PANDA_HIGH = np.array([-0.2, -0.2, 0.05]), np.array([0.2, 0.2, 0.3])
KINDS = {
    "fetch-axes": Kind("FetchReach-v4", 6, 12, scripts.along_axes),
    "fetch-motions": Kind(
        "FetchReach-v4", 20, 49,
        lambda n, size: scripts.wandering(n, size, FETCH_LOW, FETCH_HIGH, 0),
    ),
    "fetch-presses": Kind("FetchReach-v4", 20, 20, scripts.pressing),
    "fetch-grips": Kind("FetchPickAndPlace-v4", 20, 18, scripts.gripping),
    "fetch-pushes": Kind(
        "FetchPush-v4", 50, 49,
        lambda n, size: scripts.pushing(n, size, 3, 0.5, 0.418, 0.075, 0.03, 0),
    ),
    "fetch-slides": Kind("FetchSlide-v4", 100, 49, lambda n, size: scripts.hitting(n, size, 3, 0)),
    "panda-axes": Kind("PandaReach-v3", 6, 12, scripts.along_axes),
    "panda-motions": Kind(
        "PandaReach-v3", 20, 49,
        lambda n, size: scripts.wandering(n, size, PANDA_LOW, PANDA_HIGH, 0),
    ),
    "panda-presses": Kind("PandaReach-v3", 20, 20, scripts.sliding),
    "panda-pushes": Kind(
        "PandaPush-v3", 50, 49,
        lambda n, size: scripts.pushing(n, size, 6, 0.09, 0.012, 0.06, 0.03, 0),
    ),
}  # fmt: skip


def record(kind: Kind, python: Path | None, first_seed: int = FIRST_SEED) -> Recording:
    """Plays the episodes of a kind in the original."""
    with Originals(kind.env_id, kind.episodes, python=python, processes=PROCESSES) as envs:
        size = envs.description["spaces"]["action"]["shape"][0]
        act = kind.actor(kind.episodes, size)
        now = envs.reset(range(first_seed, first_seed + kind.episodes))
        observations, goals, actions = [now["observation"]], now["desired_goal"], []
        for step in range(kind.steps):
            # in single precision, as the originals take them
            actions.append(act(now, step).astype(np.float32).astype(float))
            now = envs.step(actions[-1])
            observations.append(now["observation"])
    return Recording(np.array(observations), goals, np.array(actions))


class Starts(NamedTuple):
    """Starts of episodes of an original, and its spaces.

    Attributes:
        observation: [episodes, n].
        desired_goal: [episodes, goal].
        description: of the worker, see `training.results.original_worker`.
    """

    observation: Array
    desired_goal: Array
    description: dict[str, Any]


def starts(env_id: str, python: Path | None, episodes: int) -> Starts:
    """Resets an original with as many seeds."""
    worlds = 2 * PROCESSES
    with Originals(env_id, worlds, python=python, processes=PROCESSES) as envs:
        seeds = range(FIRST_SEED, FIRST_SEED + episodes, worlds)
        found = [envs.reset(range(first, first + worlds)) for first in seeds]
        description = envs.description
    observation, goal = (
        np.concatenate([one[key] for one in found])[:episodes] for key in Starts._fields[:2]
    )
    return Starts(observation, goal, description)


def save_starts(env_id: str, python: Path | None) -> None:
    """Records some starts, in single precision."""
    found = starts(env_id, python, STARTS)
    np.savez_compressed(
        DATA / f"starts-{env_id}.npz",
        observation=found.observation.astype(np.float32),
        desired_goal=found.desired_goal.astype(np.float32),
        description=json.dumps(found.description),
    )


def load_starts(env_id: str) -> Starts:
    """Reads recorded starts."""
    with np.load(DATA / f"starts-{env_id}.npz") as file:
        return Starts(
            file["observation"].astype(float),
            file["desired_goal"].astype(float),
            json.loads(str(file["description"])),
        )
