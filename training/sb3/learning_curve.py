"""The loggers of a run, which go on where a checkpoint stood."""

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
    """Writes a further file of events, which hides older ones from a step on."""

    def __init__(self, folder: Path, from_step: int):
        # files are read in the order of their names, which begin with the second of their making
        names = [path.name.split(".") for path in folder.glob("events.out.tfevents.*")]
        while names and int(time.time()) <= max(int(name[3]) for name in names):
            time.sleep(0.05)
        self.writer = SummaryWriter(log_dir=str(folder), purge_step=from_step)
        self._is_closed = False


def continued_logger(folder: RunFolder, checkpoint: Path, state: dict[str, Any]) -> Logger:
    """Puts the learning curve back to that of a checkpoint, and goes on with it.

    Args:
        folder: The run.
        checkpoint: Its checkpoint; rows that were written after it are dropped.
        state: What `model_state.read_state` says of it.
    """
    kept = checkpoint / folder.progress.name
    csv: CSVOutputFormat
    if kept.exists() and kept.stat().st_size:
        shutil.copyfile(kept, folder.progress)
        csv = ContinuedCSV(folder.progress)
    else:
        csv = CSVOutputFormat(str(folder.progress))
    logger = Logger(str(folder.path), [csv, ContinuedTensorBoard(folder.path, state["steps"] + 1)])
    for name, value, excluded in state["unlogged"]:
        logger.record(name, value, tuple(excluded))
    return logger
