"""Checkpoints, each a folder that is written atomically: files of two are never mixed.

    checkpoint_<number>/
        policy.safetensors                 the policy
        model.zip, vecnormalize.pkl   the policy in Stable-Baselines3's own formats
        state.json, tensors.pt, replay.npz   the state that training resumes from, see model_state
        progress.csv                  the learning curve so far

A checkpoint is written to a temporary folder, flushed to the disk and renamed. Only then is the
previous one removed. If the process is killed at any moment, the highest number is valid.
"""

import io
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from training.policies.export import policy_file_of
from training.runs.run_folder import CHECKPOINT, RunFolder, atomic_folder
from training.sb3.demonstration_buffers import DemonstrationBuffer
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
"""Attributes that a policy does not need; with thousands of worlds they are most of the file."""


def save_checkpoint(
    model: BaseAlgorithm,
    folder: RunFolder,
    config: TrainConfig,
    *,
    seconds: float = 0.0,
    seconds_in_envs: float | None = 0.0,
    finished: bool = False,
) -> None:
    """Replaces the checkpoint of a run; if that fails, the previous one remains.

    Args:
        model: The model in training.
        folder: The run.
        config: Its settings.
        seconds: Wall time of training so far, in seconds.
        seconds_in_envs: Part of it that was spent in the environments; None if unknown.
        finished: Whether training is complete, so that it cannot be resumed.

    Raises:
        UsageError: It cannot be written, as on a full disk, or the model has diverged.
    """
    files = {folder.policy.name: policy_file_of(model, config).to_bytes()}
    notes = {"seconds": seconds, "seconds_in_envs": seconds_in_envs, "finished": finished}
    files |= state_files(model, notes)
    model_file = io.BytesIO()
    model.save(model_file, exclude=[*TRANSIENT, *_demonstrations(model)])
    files[folder.model.name] = model_file.getvalue()
    normalization = model.get_vec_normalize_env()
    if normalization is not None:
        files[folder.normalization.name] = pickle.dumps(normalization)

    previous = folder.checkpoints()
    number = max((number for number, _ in previous), default=0) + 1
    try:
        with atomic_folder(folder.path / f"{CHECKPOINT}_{number}") as unfinished:
            for name, data in files.items():
                _write(unfinished / name, lambda file, data=data: file.write(data))  # type: ignore[misc]
            if folder.progress.exists():
                curve = folder.progress.read_bytes()
                _write(unfinished / folder.progress.name, lambda file: file.write(curve))
            if hasattr(model, "replay_buffer"):
                _write(unfinished / REPLAY, lambda file: write_replay(model, file))
    except OSError as error:
        raise UsageError(
            f"cannot write a checkpoint to {folder.path}: {error.strerror or error}; "
            + ("the previous one is intact" if previous else "there is no previous one")
        ) from error
    for _, path in previous:
        shutil.rmtree(path, ignore_errors=True)


def _demonstrations(model: BaseAlgorithm) -> list[str]:
    """Attributes that hold the demonstrations; without them an ordinary buffer is built."""
    if isinstance(getattr(model, "replay_buffer", None), DemonstrationBuffer):
        return ["replay_buffer_class", "replay_buffer_kwargs"]
    return []


class PeriodicCheckpoint(BaseCallback):
    """Saves between updates, when at least `every` steps have passed since the last checkpoint.

    Args:
        every: Environment steps between checkpoints.
        save: Writes a checkpoint.
    """

    def __init__(self, every: int, save: Callable[[], None]):
        super().__init__()
        self.every = every
        self.save = save
        self.next = every

    def _on_training_start(self) -> None:
        self.next = self.model.num_timesteps + self.every

    def _on_rollout_start(self) -> None:
        if self.model.num_timesteps >= self.next:
            self.next = self.model.num_timesteps + self.every
            self.save()

    def _on_step(self) -> bool:
        return True


class CurrentRollout(BaseCallback):
    """Knows the rollout whose steps no update has used. It must be the last of all callbacks."""

    def __init__(self) -> None:
        super().__init__()
        self.start: int | None = None
        """Number of steps at its start; None in an update."""

    def _on_rollout_start(self) -> None:
        self.start = self.model.num_timesteps

    def _on_rollout_end(self) -> None:
        self.start = None

    def _on_step(self) -> bool:
        return True


def _write(path: Path, write: Callable[[BinaryIO], Any]) -> None:
    with path.open("wb") as file:
        write(file)
