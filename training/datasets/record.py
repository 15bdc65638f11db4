"""Plays episodes in a vector environment and keeps every step."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from gymnasium.vector import VectorEnv

Array = np.ndarray


class Recorded(NamedTuple):
    """One episode of T steps.

    Attributes:
        seed: `reset(seed=seed)` of the single environment starts it.
        observations: for each key, [T + 1, ...].
        actions: [T, action_dim], as the environment took them.
        intended: [T, action_dim], what the policy chose, before it was disturbed.
        rewards: [T].
        terminated: [T] bool.
        truncated: [T] bool.
        success: [T + 1] bool, whether the goal is met.
    """

    seed: int
    observations: dict[str, Array]
    actions: Array
    intended: Array
    rewards: Array
    terminated: Array
    truncated: Array
    success: Array


def record_episodes(
    envs: VectorEnv,
    act: Callable[[dict[str, Array]], Array],
    seed: int,
    disturb: Callable[[Array], Array] = lambda action: action,
) -> list[Recorded]:
    """Plays until the first episode of every world has ended, and returns it.

    Args:
        envs: vector environment with autoreset mode SAME_STEP.
        act: takes observations, a dict of [n, ...] arrays; returns actions [n, action_dim].
        seed: of the episode of the first world; the following ones count up.
        disturb: what becomes of actions [n, action_dim] that the policy chose.
    """
    count, space = envs.num_envs, envs.action_space
    dtype = getattr(envs.single_action_space, "dtype", np.float32)

    def bounded(action: Array) -> Array:
        return np.clip(np.asarray(action, dtype=dtype), space.low, space.high)  # type: ignore[attr-defined]

    observation, info = envs.reset(seed=seed)
    observations = [_copied(observation)]
    success = [np.array(info["is_success"], dtype=bool)]
    steps: list[tuple[Array, ...]] = []
    length = np.zeros(count, dtype=int)
    while (length == 0).any():
        intended = bounded(act(observation))
        action = bounded(disturb(intended))
        observation, reward, terminated, truncated, info = envs.step(action)
        shown, solved = _copied(observation), np.array(info["is_success"], dtype=bool)
        ended = terminated | truncated
        if ended.any():  # what was returned already belongs to the next episode
            for w in np.flatnonzero(ended):
                for key, values in info["final_obs"][w].items():
                    shown[key][w] = values
            solved[ended] = info["final_info"]["is_success"][ended]
        observations.append(shown)
        success.append(solved)
        steps.append((action, intended, reward.copy(), terminated.copy(), truncated.copy()))
        length[ended & (length == 0)] = len(steps)
    actions, intents, rewards, terminated, truncated = map(np.stack, zip(*steps, strict=True))
    frames = {key: np.stack([o[key] for o in observations]) for key in observations[0]}
    solved = np.stack(success)
    return [
        Recorded(
            seed + w,
            {key: values[: n + 1, w] for key, values in frames.items()},
            actions[:n, w],
            intents[:n, w],
            rewards[:n, w],
            terminated[:n, w],
            truncated[:n, w],
            solved[: n + 1, w],
        )
        for w, n in enumerate(length.tolist())
    ]


def _copied(observation: dict[str, Array]) -> dict[str, Array]:
    return {key: np.array(values) for key, values in observation.items()}
