"""The last part of a run on other arguments of the environment, as on finer physics."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.her import HerReplayBuffer

from training.sb3.vec_env import RigidVecEnv


class FinishElsewhere(BaseCallback):
    """Puts other worlds in the place of those trained on, between two updates.

    Networks, statistics and replay buffer go on. Success counts anew, so that early stopping is
    judged on the worlds that the run finishes on.

    Args:
        worlds: Whose environments are replaced.
        make: Makes the others.
        from_steps: Steps from which on they are trained on.
        seed: Of their first episodes.
    """

    def __init__(
        self, worlds: RigidVecEnv, make: Callable[[], VectorEnv], from_steps: int, seed: int
    ):
        super().__init__()
        self.worlds, self.make, self.from_steps, self.seed = worlds, make, from_steps, seed
        self.finishing, self.resumed = False, False

    def _on_training_start(self) -> None:
        self.resumed = self.model.num_timesteps > self.from_steps

    def _on_rollout_start(self) -> None:
        if self.finishing or self.model.num_timesteps < self.from_steps:
            return
        self.finishing = True
        self.worlds.replace(self.make())
        model: Any = self.model
        buffer = getattr(model, "replay_buffer", None)
        if isinstance(buffer, HerReplayBuffer):
            with warnings.catch_warnings():  # of what is meant: these episodes are never to end
                warnings.simplefilter("ignore")
                buffer.truncate_last_trajectory()
        if not self.resumed:  # else these episodes would be played again
            self.worlds.seed(self.seed)
            model.ep_success_buffer.clear()
            model.ep_info_buffer.clear()
        model._last_obs = model.env.reset()
        model._last_episode_starts = np.ones(self.worlds.num_envs, dtype=bool)
        if model._vec_normalize_env is not None:
            model._last_original_obs = model._vec_normalize_env.get_original_obs()

    def _on_step(self) -> bool:
        return True
