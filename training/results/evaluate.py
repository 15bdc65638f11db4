"""Measures the success rate of a policy, with a confidence interval.

Episode i is the episode of the single environment after `reset(seed=seed + i)`. Each world plays
one episode per round and is then ignored until the next round. So short episodes do not count more
than long ones, and the outcome does not depend on the number of worlds.
"""

import math
import sys
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from training.policies.episodes import play_episodes
from training.policies.policy import Policy
from training.settings.environments import (
    check_episodes_end,
    effective_fidelity,
    make_vector_env,
    registered_arguments,
)
from training.settings.errors import UsageError
from training.settings.seed_ranges import EVALUATION

WORLDS = 1024
NORMAL_QUANTILE = 1.959963984540054
"""Two-sided 95 %."""


@dataclass(frozen=True)
class Evaluation:
    """The outcome of each episode in the order of the seeds, and how they were played."""

    success_at_end: np.ndarray
    """(episodes,) bool: the goal was reached at the end of the episode."""
    success_at_any_time: np.ndarray
    """(episodes,) bool: the goal was reached after at least one step."""
    episode_return: np.ndarray
    """(episodes,) sum of the rewards."""
    length: np.ndarray
    """(episodes,) steps."""
    seconds: float
    """Wall time, in seconds."""
    first_seed: int
    """Seed of the first episode; the following ones count up."""
    fidelity: Any
    """Fidelity of the physics; None for an environment without it."""
    env_kwargs: dict[str, Any]
    """Arguments of the environment, including those that its id sets."""


def evaluate(
    policy: Policy,
    episodes: int = 1000,
    *,
    seed: int = EVALUATION,
    quiet: bool = False,
    **env_kwargs: Any,
) -> Evaluation:
    """Plays the episodes with the seeds seed, seed + 1, ...

    Args:
        policy: The policy.
        episodes: Number of episodes.
        seed: Seed of the first episode.
        quiet: Show no progress.
        env_kwargs: Arguments of the environment that replace those of training.

    Raises:
        UsageError: A number is out of range, or the environment rejects its arguments.
    """
    if episodes < 1:
        raise UsageError(f"number of episodes is {episodes}, should be at least 1")
    if seed < 0:
        raise UsageError(f"seed is {seed}, should be at least 0")
    worlds = min(episodes, WORLDS)
    arguments = {**policy.env_kwargs, **env_kwargs}
    check_episodes_end(arguments)
    envs = make_vector_env(policy.env_id, worlds, **arguments)
    policy.check(envs.single_observation_space)
    start = time.perf_counter()
    rounds = []
    console = Console(quiet=quiet or not sys.stdout.isatty())
    with Progress(transient=True, console=console) as bar:
        task = bar.add_task("evaluating", total=math.ceil(episodes / worlds) * worlds)
        try:
            for first in range(0, episodes, worlds):
                rounds.append(
                    play_episodes(envs, policy.act, seed + first, lambda n: bar.advance(task, n))
                )
        finally:
            envs.close()
    # the last round may play more episodes than needed; worlds are in the order of their seeds
    at_end, at_any_time, episode_return, length = (
        np.concatenate(parts)[:episodes] for parts in zip(*rounds, strict=True)
    )
    return Evaluation(
        success_at_end=at_end,
        success_at_any_time=at_any_time,
        episode_return=episode_return,
        length=length,
        seconds=time.perf_counter() - start,
        first_seed=seed,
        fidelity=effective_fidelity(policy.env_id, arguments),
        env_kwargs={**registered_arguments(policy.env_id), **arguments},
    )


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """The 95 % confidence interval of a probability (Wilson 1927), valid at 0 and 100 % too."""
    z2 = NORMAL_QUANTILE**2
    rate = successes / trials
    centre = (rate + z2 / (2 * trials)) / (1 + z2 / trials)
    deviation = math.sqrt(rate * (1 - rate) / trials + z2 / (4 * trials**2))
    half_width = NORMAL_QUANTILE / (1 + z2 / trials) * deviation
    return max(0.0, centre - half_width), min(1.0, centre + half_width)


def print_evaluation(policy: Policy, result: Evaluation) -> None:
    """Prints how the episodes were played, and the table of the outcome."""
    episodes = len(result.length)
    arguments = {key: value for key, value in result.env_kwargs.items() if key != "fidelity"}
    for name, value in (
        ("environment", policy.env_id),
        ("policy", policy.name),
        ("fidelity", result.fidelity),
        ("arguments", ", ".join(f"{k}: {v}" for k, v in arguments.items()) or "defaults"),
        ("seeds", f"{result.first_seed} to {result.first_seed + episodes - 1}"),
    ):
        print(f"{name:<12} {value}")
    table = Table()
    table.add_column(f"{episodes:,} episodes in {result.seconds:.1f} s")
    table.add_column("value", justify="right")
    table.add_column("95 % interval", justify="right")
    for name, outcome in (
        ("success at the end", result.success_at_end),
        ("success at any time", result.success_at_any_time),
    ):
        low, high = wilson_interval(int(outcome.sum()), len(outcome))
        table.add_row(name, f"{outcome.mean():.1%}", f"{low:.1%} to {high:.1%}")
    table.add_row("mean return", f"{result.episode_return.mean():.3f}", "")
    table.add_row("mean length", f"{result.length.mean():.1f} steps", "")
    Console().print(table)
