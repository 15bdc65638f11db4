"""Checkpoints: folders that appear whole or not at all, so that files of two never mix.

    checkpoint_<number>/
        policy.policy                 what acts
        model.zip, vecnormalize.pkl   the same in Stable-Baselines3's own form
        state.json, tensors.pt, replay.npz   what training goes on from, see model_state.py
        progress.csv                  the learning curve so far

A checkpoint is written aside, brought to the disk and renamed; only then the one before is
removed. The highest number counts, whenever the process may have been killed.
"""

import io
import os
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from training.policies.export import policy_file_of
from training.runs.run_folder import CHECKPOINT, RunFolder
from training.sb3.model_state import REPLAY, state_files, write_replay
from training.settings.config import TrainConfig
from training.settings.errors import UsageError

TRANSIENT = [
    "_last_obs",
    "_last_original_obs",
    "_last_episode_starts",
    "ep_info_buffer",
    "ep_success_buffer",
]
"""What a policy does not need: thousands of worlds make it the greater part of the file."""


def save_checkpoint(
    model: BaseAlgorithm,
    folder: RunFolder,
    config: TrainConfig,
    *,
    seconds: float = 0.0,
    seconds_in_envs: float | None = 0.0,
    finished: bool = False,
) -> None:
    """Replaces the folder's checkpoint; if that fails, the one before stays.

    Args:
        model: What trains.
        folder: The run.
        config: Its settings.
        seconds: Wall time of training so far, in seconds.
        seconds_in_envs: How much of it was spent in the environments; None if that is not known.
        finished: Whether training is over, so that it can't be resumed.

    Raises:
        UsageError: It cannot be written, as on a full disk, or the model has diverged.
    """
    files = {folder.policy.name: policy_file_of(model, config).to_bytes()}
    notes = {"seconds": seconds, "seconds_in_envs": seconds_in_envs, "finished": finished}
    files |= state_files(model, notes)
    model_file = io.BytesIO()
    model.save(model_file, exclude=TRANSIENT)
    files[folder.model.name] = model_file.getvalue()
    normalization = model.get_vec_normalize_env()
    if normalization is not None:
        files[folder.normalization.name] = pickle.dumps(normalization)

    before = folder.checkpoints()
    number = max((number for number, _ in before), default=0) + 1
    unfinished = folder.path / f"{CHECKPOINT}.tmp"
    try:
        shutil.rmtree(unfinished, ignore_errors=True)  # of a process that was killed
        unfinished.mkdir()
        for name, data in files.items():
            _write(unfinished / name, lambda file, data=data: file.write(data))  # type: ignore[misc]
        if folder.progress.exists():
            curve = folder.progress.read_bytes()
            _write(unfinished / folder.progress.name, lambda file: file.write(curve))
        if hasattr(model, "replay_buffer"):
            _write(unfinished / REPLAY, lambda file: write_replay(model, file))
        _sync(unfinished)
        os.replace(unfinished, folder.path / f"{CHECKPOINT}_{number}")
        _sync(folder.path)
    except OSError as error:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise UsageError(
            f"no checkpoint could be written to {folder.path}: {error.strerror or error}; "
            + ("the one before is whole" if before else "there is none before it")
        ) from error
    for _, path in before:
        shutil.rmtree(path, ignore_errors=True)


class PeriodicCheckpoint(BaseCallback):
    """Saves between updates, whenever at least `every` steps have passed since the last time.

    Args:
        every: Environment steps between checkpoints.
        save: Writes one.
    """

    def __init__(self, every: int, save: Callable[[], None]):
        super().__init__()
        self.every = every
        self.save = save
        self.next = every
        self.rollout_from: int | None = None
        """Steps taken when the rollout began that goes on; None between rollouts."""

    def _on_training_start(self) -> None:
        self.next = self.model.num_timesteps + self.every

    def _on_rollout_start(self) -> None:
        self.rollout_from = self.model.num_timesteps
        if self.model.num_timesteps >= self.next:
            self.next = self.model.num_timesteps + self.every
            self.save()

    def _on_rollout_end(self) -> None:
        self.rollout_from = None

    def _on_step(self) -> bool:
        return True


def _write(path: Path, write: Callable[[BinaryIO], Any]) -> None:
    with path.open("wb") as file:
        write(file)
        file.flush()
        os.fsync(file.fileno())


def _sync(folder: Path) -> None:
    """Brings the names in a folder to the disk; where folders can't be opened, nothing to do."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
