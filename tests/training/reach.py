"""A point that must reach a goal: a small and fast vector environment for tests.

It has the interface of the real environments, but returns its own buffers and overwrites them at
each step, so that tests detect a missing copy.
"""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

STEP = 0.25
THRESHOLD = 0.2


class ReachVectorEnv(VectorEnv):
    """Move by up to 0.25 a step in the plane; the goal lies within ±1 and at least 0.4 away.

    World i ends its episodes after `max_episode_steps - stagger * (i % 3)` steps.
    """

    def __init__(
        self,
        num_envs: int = 1,
        task: str = "reach",
        reward_type: str = "sparse",
        fidelity: str = "balanced",
        render_mode: str | None = None,
        autoreset_mode: AutoresetMode = AutoresetMode.SAME_STEP,
        max_episode_steps: int = 10,
        terminate_on_success: bool = False,
        stagger: int = 0,
    ):
        if reward_type not in ("sparse", "dense"):
            raise ValueError(f"reward_type is {reward_type!r}, should be sparse or dense")
        self.metadata = {
            "autoreset_mode": autoreset_mode,
            "render_modes": ["rgb_array"],
            "render_fps": 25,
        }
        self.render_mode = render_mode
        self.num_envs = num_envs
        self.reward_type = reward_type
        self.fidelity = fidelity
        self.terminate_on_success = terminate_on_success
        vector = spaces.Box(-10.0, 10.0, (2,), np.float32)
        self.single_observation_space = spaces.Dict(
            observation=vector, achieved_goal=vector, desired_goal=vector
        )
        self.single_action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.last_step = max_episode_steps - stagger * (np.arange(num_envs) % 3)
        self.steps = np.zeros(num_envs, dtype=int)
        self.episodes = np.zeros(num_envs, dtype=int)
        self.seeds = np.zeros(num_envs, dtype=int)
        self.buffer = {key: np.zeros((num_envs, 2), np.float32) for key in vector_keys}
        self.final_buffer = {key: np.zeros((num_envs, 2), np.float32) for key in vector_keys}
        self.rewards = np.zeros(num_envs, np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        first = seed if seed is not None else int(self.np_random.integers(2**31))
        self.seeds = first + np.arange(self.num_envs)
        self.episodes[:] = 0
        self.received_options = options
        self._start(np.arange(self.num_envs))
        return self.buffer, {"is_success": self._success(), "episode_index": self.episodes.copy()}

    def step(self, actions: np.ndarray):
        if not np.isfinite(actions).all():
            raise ValueError(f"actions is {actions}, should be finite")
        moved = self.buffer["achieved_goal"] + STEP * np.clip(actions, -1, 1).astype(np.float32)
        self.buffer["observation"][:] = moved
        self.buffer["achieved_goal"][:] = moved
        self.steps += 1
        success = self._success()
        distance = np.linalg.norm(moved - self.buffer["desired_goal"], axis=1)
        self.rewards[:] = -distance if self.reward_type == "dense" else success - 1.0
        terminated = success & self.terminate_on_success
        truncated = self.steps >= self.last_step
        infos: dict[str, Any] = {"is_success": success, "episode_index": self.episodes.copy()}
        ended = terminated | truncated
        if ended.any():
            final_obs = np.full(self.num_envs, None, dtype=object)
            for key, value in self.buffer.items():
                self.final_buffer[key][:] = value
            for world in np.flatnonzero(ended):
                final_obs[world] = {key: v[world] for key, v in self.final_buffer.items()}
            final_info = {"is_success": success.copy(), "distance": distance, "_distance": ended}
            self.episodes[ended] += 1
            self._start(np.flatnonzero(ended))
            infos = {"is_success": self._success(), "episode_index": self.episodes.copy()}
            infos |= {"final_obs": final_obs, "_final_obs": ended}
            infos |= {"final_info": final_info, "_final_info": ended}
        return self.buffer, self.rewards, terminated, truncated, infos

    def compute_reward(self, achieved: np.ndarray, desired: np.ndarray, info: Any) -> np.ndarray:
        distance = np.linalg.norm(np.asarray(achieved) - np.asarray(desired), axis=-1)
        return (distance < THRESHOLD).astype(np.float32) - np.float32(1)

    def render(self):
        if self.render_mode != "rgb_array":
            return None
        return tuple(np.full((48, 64, 3), 200, np.uint8) for _ in range(self.num_envs))

    def _start(self, worlds: np.ndarray) -> None:
        for world in worlds:
            random = np.random.default_rng([self.seeds[world], self.episodes[world]])
            angle, radius = random.uniform(0, 2 * np.pi), random.uniform(0.4, 1.0)
            goal = radius * np.array([np.cos(angle), np.sin(angle)])
            self.buffer["desired_goal"][world] = goal
        self.buffer["observation"][worlds] = 0
        self.buffer["achieved_goal"][worlds] = 0
        self.steps[worlds] = 0

    def _success(self) -> np.ndarray:
        offset = self.buffer["achieved_goal"] - self.buffer["desired_goal"]
        return np.linalg.norm(offset, axis=1) < THRESHOLD


class ReachEnv(gym.Env):
    """The same as a single environment: a batch of one."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 25}

    def __init__(self, render_mode: str | None = None, **kwargs: Any):
        self.render_mode = render_mode
        self.worlds = ReachVectorEnv(1, render_mode=render_mode, **kwargs)
        self.observation_space = self.worlds.single_observation_space
        self.action_space = self.worlds.single_action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        super().reset(seed=seed)
        observation, _ = self.worlds.reset(seed=seed, options=options)
        return {key: v[0].copy() for key, v in observation.items()}, {"is_success": False}

    def step(self, action: np.ndarray):
        observation, rewards, terminated, truncated, infos = self.worlds.step(action[None])
        ended = terminated[0] or truncated[0]
        success = infos["final_info" if ended else "is_success"]
        success = bool(success["is_success"][0] if ended else success[0])
        last = infos["final_obs"][0] if ended else {key: v[0] for key, v in observation.items()}
        return (
            {key: v.copy() for key, v in last.items()},
            float(rewards[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            {"is_success": success},
        )

    def compute_reward(self, achieved: np.ndarray, desired: np.ndarray, info: Any) -> np.ndarray:
        return self.worlds.compute_reward(achieved, desired, info)

    def render(self):
        frames = self.worlds.render()
        return frames if frames is None else frames[0]


vector_keys = ("observation", "achieved_goal", "desired_goal")


def straight_to_the_goal(observation: dict[str, np.ndarray]) -> np.ndarray:
    """A controller that solves every episode."""
    offset = observation["desired_goal"] - observation["achieved_goal"]
    return np.clip(offset / STEP, -1, 1)
