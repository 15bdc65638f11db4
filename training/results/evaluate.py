"""How often a policy succeeds, with the interval that the number of episodes allows.

Episode i is the one that the single environment plays after `reset(seed=seed + i)`: each world
plays exactly one episode a round and then is ignored, so that short episodes count no more than
long ones and the result does not depend on the number of worlds.
"""

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from training.policies.policy import Policy
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError

FIRST_SEED = 1_000_000
"""Far from the seeds that training uses, which count up from a small number."""
WORLDS = 1024
NORMAL_QUANTILE = 1.959963984540054
"""Two-sided 95 %."""


@dataclass(frozen=True)
class Evaluation:
    """The outcome of each episode, in the order of their seeds."""

    success_at_end: np.ndarray
    """(episodes,) bool: the goal was met when the episode ended."""
    success_at_any_time: np.ndarray
    """(episodes,) bool: the goal was met after some step."""
    episode_return: np.ndarray
    """(episodes,) sum of rewards."""
    length: np.ndarray
    """(episodes,) steps."""
    seconds: float
    """Wall time, in seconds."""


def evaluate(
    policy: Policy,
    episodes: int = 1000,
    *,
    seed: int = FIRST_SEED,
    quiet: bool = False,
    **env_kwargs: Any,
) -> Evaluation:
    """Plays the episodes with seeds seed, seed + 1, ...

    Args:
        policy: What acts.
        episodes: How many.
        seed: Seed of the first.
        quiet: Show no progress.
        env_kwargs: Arguments of the environment, over those that the policy was trained with.

    Raises:
        UsageError: A number is out of range or the environment refuses its arguments.
    """
    if episodes < 1:
        raise UsageError(f"number of episodes is {episodes}, should be at least 1")
    if seed < 0:
        raise UsageError(f"seed is {seed}, should be at least 0")
    worlds = min(episodes, WORLDS)
    envs = make_vector_env(policy.env_id, worlds, **{**policy.env_kwargs, **env_kwargs})
    start = time.perf_counter()
    rounds = []
    console = Console(quiet=quiet or not sys.stdout.isatty())
    with Progress(transient=True, console=console) as bar:
        task = bar.add_task("evaluating", total=math.ceil(episodes / worlds) * worlds)
        try:
            for first in range(0, episodes, worlds):
                rounds.append(
                    _play_round(envs, policy, seed + first, lambda n: bar.advance(task, n))
                )
        finally:
            envs.close()
    # The last round may play more than asked; its worlds are in the order of their seeds.
    at_end, at_any_time, episode_return, length = (
        np.concatenate(parts)[:episodes] for parts in zip(*rounds, strict=True)
    )
    seconds = time.perf_counter() - start
    return Evaluation(at_end, at_any_time, episode_return, length, seconds)


def _play_round(
    envs: VectorEnv, policy: Policy, seed: int, advance: Callable[[int], None]
) -> tuple[np.ndarray, ...]:
    """One episode in each world: the first four fields of Evaluation."""
    success_at_end = np.zeros(envs.num_envs, dtype=bool)
    success_at_any_time = np.zeros(envs.num_envs, dtype=bool)
    episode_return = np.zeros(envs.num_envs)
    length = np.zeros(envs.num_envs, dtype=int)
    playing = np.ones(envs.num_envs, dtype=bool)
    observation, _ = envs.reset(seed=seed)
    while playing.any():
        actions = policy.act(observation)
        observation, rewards, terminated, truncated, infos = envs.step(actions)
        ended = playing & (terminated | truncated)
        success = np.array(infos["is_success"], dtype=bool)
        if ended.any():  # their own is_success is of the new episode already
            success[ended] = infos["final_info"]["is_success"][ended]
        episode_return[playing] += rewards[playing]
        length[playing] += 1
        success_at_any_time |= playing & success
        success_at_end |= ended & success
        playing &= ~ended
        advance(int(ended.sum()))
    return success_at_end, success_at_any_time, episode_return, length


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """The 95 % interval of a success probability (Wilson 1927); honest at 0 and 100 % too."""
    z2 = NORMAL_QUANTILE**2
    share = successes / trials
    centre = (share + z2 / (2 * trials)) / (1 + z2 / trials)
    spread = math.sqrt(share * (1 - share) / trials + z2 / (4 * trials**2))
    half_width = NORMAL_QUANTILE / (1 + z2 / trials) * spread
    return max(0.0, centre - half_width), min(1.0, centre + half_width)


def print_evaluation(policy: Policy, result: Evaluation) -> None:
    """Prints the table of an evaluation."""
    table = Table(title=f"{policy.env_id}, {policy.name}")
    table.add_column(f"{len(result.length):,} episodes in {result.seconds:.1f} s")
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
