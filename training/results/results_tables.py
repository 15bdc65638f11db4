"""Tables of recorded results: of README.md, and of twins."""

import statistics
from collections.abc import Callable, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import gymnasium as gym

from training.results.result import Result
from training.settings.environment_ids import dense_id, plain_id
from training.settings.tasks import changed_arguments

IMAGES = Path("docs/results")
README_IMAGE_WIDTH = 200
"""Of an image in the README, in pixels."""


def by_kind(results: Sequence[Result]) -> list[list[Result]]:
    """Groups the results that differ only in their seed."""
    return [list(group) for _, group in groupby(results, key=lambda result: result.kind)]


def image_paths(kind: str) -> tuple[Path, Path]:
    """Paths in the repository of the learning curve and the video of a kind."""
    return IMAGES / f"{kind}.png", IMAGES / f"{kind}.gif"


def readme_table(results: Sequence[Result]) -> str:
    """The table in the README: sizes, and results by algorithm, of environments as registered."""
    results = [one for one in results if not changed_arguments(one.env_id, one.arguments)]
    algorithms = list(dict.fromkeys(one.algorithm for one in results))
    columns = ["environment", "", "observation", "action", "steps per episode"]
    for algorithm in algorithms:
        columns += [f"{algorithm.upper()}: success", "training time"]
    lines = [" | ".join(columns), " | ".join(["---", "---", *["---:"] * (len(columns) - 2)])]
    environments: dict[str, list[list[Result]]] = {}
    for group in by_kind(results):
        environments.setdefault(_task_key(group[0]), []).append(group)
    for groups in environments.values():
        first = groups[0][0]
        cells = [_names(first), _image(first), *_sizes(first.env_id)]
        by_algorithm = {group[0].algorithm: group for group in groups}
        for algorithm in algorithms:
            cells += _outcome(by_algorithm.get(algorithm, []))
        lines.append(" | ".join(cells))
    return "\n".join([*(f"| {line} |" for line in lines), ""])


def twins_table(results: Sequence[Result]) -> str:
    """The table of twins: training, success here and in their originals."""
    lines = [
        "| twin | algorithm | seeds | steps | training time | success here | in the original "
        "| least there |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for group in by_kind(results):
        cells = [
            group[0].env_id.removeprefix("RigidEnvs/").removesuffix("-v0"),
            group[0].algorithm.upper(),
            str(len(group)),
            f"{statistics.fmean(one.steps for one in group) / 1e6:.2g} M",
            over_seeds(group, lambda one: one.seconds, "{:.0f}", " s"),
            over_seeds(group, lambda one: 100 * one.success_at_end["rate"], "{:.1f}", " %"),
            over_seeds(group, success_in_original, "{:.1f}", " %"),
            f"{min(success_in_original(one) for one in group):.1f} %",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _task_key(one: Result) -> str:
    """A key that is the same for the sparse and the dense id of a task."""
    return str(gym.spec(one.env_id).kwargs.get("task", one.env_id))


def _names(one: Result) -> str:
    """The registered ids of a task, sparse and dense."""
    ids = [name for name in (plain_id(one.env_id), dense_id(one.env_id)) if name in gym.registry]
    return "<br>".join(ids)


def _image(one: Result) -> str:
    video = image_paths(one.kind)[1].as_posix()
    return f'<img src="{video}" width="{README_IMAGE_WIDTH}" alt="{one.env_id}">'


def _sizes(env_id: str) -> list[str]:
    """Sizes of observation and action, and the steps of an episode."""
    env = gym.make(env_id)
    spaces: Any = env.observation_space, env.action_space
    env.close()
    observation, action = spaces[0]["observation"].shape[0], spaces[1].shape[0]
    return [str(observation), str(action), str(gym.spec(env_id).max_episode_steps)]


def _outcome(group: Sequence[Result]) -> list[str]:
    """Success at the end and training time of runs that differ by their seed; of none, dashes."""
    if not group:
        return ["–", "–"]
    success = over_seeds(group, lambda one: 100 * one.success_at_end["rate"], "{:.1f}", " %")
    if statistics.fmean(one.seconds for one in group) < 100:
        return [success, over_seeds(group, lambda one: one.seconds, "{:.0f}", " s")]
    return [success, over_seeds(group, lambda one: one.seconds / 60, "{:.1f}", " min")]


def success_in_original(result: Result) -> float:
    """Success of a twin's policy in its original, %."""
    assert result.original is not None
    return float(100 * result.original["success_at_end"]["rate"])


def over_seeds(
    group: Sequence[Result], value: Callable[[Result], float], form: str, unit: str = ""
) -> str:
    """Mean ± standard deviation over seeds; the value alone for a single seed."""
    values = [value(one) for one in group]
    mean = form.format(statistics.fmean(values))
    if len(values) == 1:
        return f"{mean}{unit}"
    return f"{mean} ± {form.format(statistics.stdev(values))}{unit}"
