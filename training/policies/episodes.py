"""Plays one episode in each world of a vector environment."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from gymnasium.vector import VectorEnv

Array = np.ndarray


class Episodes(NamedTuple):
    """The outcome of one episode in each world.

    Attributes:
        success_at_end: (worlds,) bool, the goal was reached at the end of the episode.
        success_at_any_time: (worlds,) bool, the goal was reached after at least one step.
        episode_return: (worlds,) sum of the rewards.
        length: (worlds,) steps.
    """

    success_at_end: Array
    success_at_any_time: Array
    episode_return: Array
    length: Array


def play_episodes(
    envs: VectorEnv,
    act: Callable[[dict[str, Array]], Array],
    seed: int,
    advance: Callable[[int], None] = lambda _: None,
) -> Episodes:
    """Plays until the first episode of every world has ended; worlds that end early are ignored.

    Args:
        envs: Vector environment with autoreset mode SAME_STEP.
        act: Takes observations, a dict of (n, k) arrays; returns actions (n, action_dim).
        seed: Of the episode of the first world; the following ones count up.
        advance: Called after each step with the number of episodes that ended.
    """
    success_at_end = np.zeros(envs.num_envs, dtype=bool)
    success_at_any_time = np.zeros(envs.num_envs, dtype=bool)
    episode_return = np.zeros(envs.num_envs)
    length = np.zeros(envs.num_envs, dtype=int)
    playing = np.ones(envs.num_envs, dtype=bool)
    observation, _ = envs.reset(seed=seed)
    while playing.any():
        observation, rewards, terminated, truncated, infos = envs.step(act(observation))
        ended = playing & (terminated | truncated)
        success = np.array(infos["is_success"], dtype=bool)
        if ended.any():  # infos["is_success"] already belongs to their next episode
            success[ended] = infos["final_info"]["is_success"][ended]
        episode_return[playing] += rewards[playing]
        length[playing] += 1
        success_at_any_time |= playing & success
        success_at_end |= ended & success
        playing &= ~ended
        advance(int(ended.sum()))
    return Episodes(success_at_end, success_at_any_time, episode_return, length)
