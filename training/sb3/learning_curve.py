"""Loggers that continue the learning curve of a checkpoint."""

import shutil
import time
from pathlib import Path
from typing import Any

from stable_baselines3.common.logger import CSVOutputFormat, Logger, TensorBoardOutputFormat
from torch.utils.tensorboard.writer import SummaryWriter

from training.runs.run_folder import RunFolder


class ContinuedCSV(CSVOutputFormat):
    """Appends rows to a file that has a header."""

    def __init__(self, file: Path):
        self.file = file.open("r+", encoding="utf-8")
        self.keys = self.file.readline().rstrip("\n").split(",")
        self.file.seek(0, 2)
        self.separator, self.quotechar = ",", '"'


class ContinuedTensorBoard(TensorBoardOutputFormat):
    """Writes a new event file, which replaces events of older files from a step on."""

    def __init__(self, folder: Path, from_step: int):
        # TensorBoard reads files in order of their names, which start with the second of creation
        names = [path.name.split(".") for path in folder.glob("events.out.tfevents.*")]
        while names and int(time.time()) <= max(int(name[3]) for name in names):
            time.sleep(0.05)
        self.writer = SummaryWriter(log_dir=str(folder), purge_step=from_step)
        self._is_closed = False


def continued_logger(folder: RunFolder, checkpoint: Path, state: dict[str, Any]) -> Logger:
    """Restores the learning curve of a checkpoint, and returns loggers that continue it.

    Args:
        folder: The run.
        checkpoint: Its checkpoint; rows that were written after it are removed.
        state: The checkpoint's state, from `model_state.read_state`.
    """
    saved = checkpoint / folder.progress.name
    csv: CSVOutputFormat
    if saved.exists() and saved.stat().st_size:
        shutil.copyfile(saved, folder.progress)
        csv = ContinuedCSV(folder.progress)
    else:
        csv = CSVOutputFormat(str(folder.progress))
    logger = Logger(str(folder.path), [csv, ContinuedTensorBoard(folder.path, state["steps"] + 1)])
    for name, value, excluded in state["unlogged"]:
        logger.record(name, value, tuple(excluded))
    return logger
