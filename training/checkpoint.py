"""Checkpoints: the policy and the statistics of its observations, whole or not at all."""

import pickle

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from training.config import TrainConfig
from training.export import write_policy
from training.run_folder import RunFolder, written_whole

TRANSIENT = [
    "_last_obs",
    "_last_original_obs",
    "_last_episode_starts",
    "ep_info_buffer",
    "ep_success_buffer",
]
"""What a policy does not need: thousands of worlds make it the greater part of the file."""


def save_checkpoint(model: BaseAlgorithm, folder: RunFolder, config: TrainConfig) -> None:
    """Replaces the folder's checkpoint; if that fails, the one before stays."""
    write_policy(folder.policy, model, config)
    normalization = model.get_vec_normalize_env()
    if normalization is not None:
        with written_whole(folder.normalization) as file:
            pickle.dump(normalization, file)
    with written_whole(folder.model) as file:
        model.save(file, exclude=TRANSIENT)


class PeriodicCheckpoint(BaseCallback):
    """Saves between updates, whenever at least `every` steps have passed since the last time."""

    def __init__(self, folder: RunFolder, config: TrainConfig, every: int):
        super().__init__()
        self.folder = folder
        self.config = config
        self.every = every
        self.next = every

    def _on_rollout_start(self) -> None:
        if self.num_timesteps >= self.next:
            self.next = self.num_timesteps + self.every
            save_checkpoint(self.model, self.folder, self.config)

    def _on_step(self) -> bool:
        return True
