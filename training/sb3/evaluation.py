"""Success of the mean action during training, on episodes of its own."""

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from training.policies.episodes import play_episodes
from training.settings.seed_ranges import TRAINING_EVALUATION

RATE = "eval/success_rate"


class SuccessEvaluation(BaseCallback):
    """Plays episodes with the mean action after a rollout, and records the fraction that succeed.

    Training episodes have sampled actions: their success lags behind that of the mean action, by
    which a policy is judged. Every evaluation has other episodes, so that a target is not reached
    by episodes that happen to be easy. Training itself is not affected, bit for bit.

    Args:
        make: Makes the environments, one world for each episode.
        every: Environment steps between two evaluations.
    """

    def __init__(self, make: Callable[[], VectorEnv], every: int):
        super().__init__()
        self.make, self.every = make, every
        self.rate = 0.0
        """Fraction of the episodes of the last evaluation."""
        self.at_step = 0
        """Environment steps of training before it; 0 if there was none yet."""
        self.count = 0
        self._envs: VectorEnv | None = None

    def _on_training_start(self) -> None:
        self.count = self.num_timesteps // self.every

    def _on_rollout_end(self) -> None:
        if self.num_timesteps // self.every <= self.count:
            return
        self.count = self.num_timesteps // self.every
        if self._envs is None:
            self._envs = self.make()
        seed = TRAINING_EVALUATION + self.count * self._envs.num_envs
        episodes = play_episodes(self._envs, self._act, seed)
        self.at_step = self.num_timesteps
        self.rate = float(episodes.success_at_end.mean())
        self.logger.record(RATE, self.rate)

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        if isinstance(self.model, OffPolicyAlgorithm) and RATE in self.logger.name_to_value:
            self.model.dump_logs()  # it ends before it writes the last evaluation
        if self._envs is not None:
            self._envs.close()
            self._envs = None

    def _act(self, observation: dict[str, np.ndarray]) -> np.ndarray:
        model: Any = self.model
        statistics = model.get_vec_normalize_env()
        if statistics is not None:
            observation = statistics.normalize_obs(observation)
        return np.asarray(model.predict(observation, deterministic=True)[0])
