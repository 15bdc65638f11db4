"""The fine-tuning stage: the last part of a run, with other arguments of the environment."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.her import HerReplayBuffer

from training.sb3.model_state import resumption_seed
from training.sb3.vec_env import RigidVecEnv


class FineTuning(BaseCallback):
    """Replaces the environments between two updates.

    Networks, statistics and replay buffer are kept. The success rate is measured again from zero
    episodes, so that early stopping depends on episodes of this stage only.

    Args:
        worlds: The adapter whose environments are replaced.
        make: Makes the new environments.
        from_steps: Number of steps after which the stage starts.
        seed: Seed of its first episodes.
    """

    def __init__(
        self, worlds: RigidVecEnv, make: Callable[[], VectorEnv], from_steps: int, seed: int
    ):
        super().__init__()
        self.worlds, self.make, self.from_steps, self.seed = worlds, make, from_steps, seed
        self.started, self.resumed = False, False

    def _on_training_start(self) -> None:
        self.resumed = self.model.num_timesteps > self.from_steps

    def _on_rollout_start(self) -> None:
        if self.started or self.model.num_timesteps < self.from_steps:
            return
        self.started = True
        self.worlds.replace(self.make())
        model: Any = self.model
        buffer = getattr(model, "replay_buffer", None)
        if isinstance(buffer, HerReplayBuffer):
            with warnings.catch_warnings():  # it warns that the episodes are cut off, as intended
                warnings.simplefilter("ignore")
                buffer.truncate_last_trajectory()
        # a resumed run must not repeat the episodes of the stage's own seed
        self.worlds.seed(resumption_seed(model) if self.resumed else self.seed)
        if not self.resumed:
            model.ep_success_buffer.clear()
            model.ep_info_buffer.clear()
        model._last_obs = model.env.reset()
        model._last_episode_starts = np.ones(self.worlds.num_envs, dtype=bool)
        if model._vec_normalize_env is not None:
            model._last_original_obs = model._vec_normalize_env.get_original_obs()

    def _on_step(self) -> bool:
        return True
