"""What a node does for a training run: trains in a temporary folder, and sends each checkpoint."""

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from training.cluster.mailbox import Caller
from training.cluster.run_files import Files, read_files, write_files
from training.runs.run_folder import CHECKPOINT, RunFolder
from training.sb3.train import resume, train
from training.settings.config import TrainConfig
from training.settings.environments import environment_threads


@dataclass(frozen=True)
class RunOrder:
    """A run to train, or to resume from its last checkpoint."""

    config: TrainConfig
    """The settings."""
    files: Files
    """Files of the run folder; without a checkpoint, a new run starts."""
    command: tuple[str, ...]
    """Program and arguments of the driver, for run.json."""
    device: str
    """Torch device of the networks."""
    num_threads: int
    """Threads of torch, and of the environments."""
    save_every: int | None
    """Steps between checkpoints; None for a tenth of the run."""


def train_run(order: RunOrder, driver: Caller) -> dict[str, bytes]:
    """Trains, and returns the files of the finished run; a Ray task.

    After each checkpoint it calls the driver with the files of the run, and continues when the
    driver has stored them.

    Raises:
        UsageError: As `train` and `resume`.
        RuntimeError: The driver has given the run to another task.
    """
    sys.argv = list(order.command)

    def send(folder: RunFolder) -> None:
        if not driver(read_files(folder)):
            raise RuntimeError("the driver has given this run to another task")

    machine: dict[str, Any] = {
        "device": order.device,
        "num_threads": order.num_threads,
        "save_every": order.save_every,
    }
    with (
        tempfile.TemporaryDirectory(prefix="rigid-envs-") as temporary,
        environment_threads(order.num_threads),
    ):
        if any(name.startswith(f"{CHECKPOINT}_") for name in order.files):
            folder = RunFolder(Path(temporary) / "run")
            write_files(folder, order.files)
            resume(folder, quiet=True, after_checkpoint=send, **machine)
        else:
            folder = train(
                order.config, Path(temporary), quiet=True, after_checkpoint=send, **machine
            ).folder
        return read_files(folder)
