"""Training runs as Ray tasks, whose run folders stand on the driver's disk as those of local runs.

A run whose worker or node is lost continues on another node from its last checkpoint.
"""

import contextlib
import dataclasses
import shutil
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import ray
from ray.exceptions import RayError, RayTaskError, TaskCancelledError

from training.cluster.connection import Demand
from training.cluster.mailbox import Switchboard
from training.cluster.run_files import Files, read_files, write_files
from training.cluster.run_task import RunOrder, train_run
from training.runs.run_folder import RunFolder
from training.sb3.model_state import read_state
from training.sb3.train import TrainResult
from training.settings.errors import UsageError

RESTARTS = 3
"""Number of times that a run may be lost in a row without a new checkpoint before it has failed."""
SECONDS_TO_STOP = 60.0
"""Time for all tasks to save a checkpoint after Ctrl-C, in seconds."""


@dataclass
class Run:
    """A run on the cluster, as the driver sees it."""

    name: str
    """In messages, as "seed 3"."""
    folder: RunFolder
    """The run folder on the driver's disk."""
    steps_before: int
    """Environment steps of the checkpoint that it was resumed from; 0 for a new run."""
    attempt: int = 0
    """Number of tasks that have been lost."""
    lost_in_a_row: int = 0
    """Those since the last checkpoint."""
    failure: str | None = None
    """Why the run has failed; None if it has not."""
    task: Any = field(default=None, repr=False)
    """Reference of its present task."""

    @property
    def steps(self) -> int:
        """Environment steps of the last checkpoint; 0 without one."""
        return int(read_state(self.folder.checkpoint)["steps"]) if self.saved else 0

    @property
    def saved(self) -> bool:
        """Whether there is a checkpoint."""
        return bool(self.folder.checkpoints())

    @property
    def finished(self) -> bool:
        """Whether the last checkpoint is that of the end of the run."""
        return self.saved and bool(read_state(self.folder.checkpoint)["finished"])

    def result(self) -> TrainResult:
        """The outcome, of the last checkpoint."""
        state = read_state(self.folder.checkpoint)
        seconds, in_envs = float(state["seconds"]), state.get("seconds_in_envs")
        return TrainResult(
            folder=self.folder,
            steps=int(state["steps"]),
            steps_before=self.steps_before,
            seconds=seconds,
            environment_time_fraction=None if in_envs is None else float(in_envs) / seconds,
            success_rate=None,
            interrupted=not state["finished"],
        )


@dataclass(frozen=True)
class Outcome:
    """What became of all runs."""

    results: list[TrainResult]
    """Of each run that has a checkpoint, in the order of the folders."""
    failures: list[str]
    """A message for each run that has failed."""
    interrupted: bool
    """Whether Ctrl-C ended them."""


def train_runs(
    folders: Sequence[RunFolder],
    *,
    device: str = "cpu",
    num_threads: int = 1,
    save_every: int | None = None,
    quiet: bool = False,
) -> Outcome:
    """Trains runs on the cluster that this process is connected to.

    Each run is a task that takes `num_threads` CPUs. Runs wait until a node has as many free.
    Ctrl-C saves a checkpoint of each run, and removes the folders of runs that had not started.

    Args:
        folders: New run folders, or runs to resume from their checkpoints.
        device: Torch device of the networks.
        num_threads: Number of threads of torch and of the environments of each run.
        save_every: Steps between checkpoints; by default a tenth of the run.
        quiet: Print nothing.

    Raises:
        UsageError: No node is large enough, another process trains one of the runs, or a folder
            cannot be written.
    """
    demand = Demand.of(num_threads, device)
    demand.check()
    with contextlib.ExitStack() as locks:
        for folder in folders:
            locks.enter_context(folder.locked())
        runs = [Run(f"seed {folder.config().seed}", folder, 0) for folder in folders]
        runs = [dataclasses.replace(run, steps_before=run.steps) for run in runs]
        driver = _Driver(runs, demand, device, save_every, quiet)
        interrupted = driver.serve()
    for run in runs:
        if interrupted and not run.saved and run.failure is None:
            shutil.rmtree(run.folder.path, ignore_errors=True)
    return Outcome(
        results=[run.result() for run in runs if run.saved],
        failures=[f"{run.name}: {run.failure}" for run in runs if run.failure is not None],
        interrupted=interrupted,
    )


class _Driver:
    """Starts the tasks of runs, stores their checkpoints, and starts lost ones again."""

    def __init__(
        self, runs: Sequence[Run], demand: Demand, device: str, save_every: int | None, quiet: bool
    ):
        self.runs, self.demand, self.quiet = runs, demand, quiet
        self.machine: dict[str, Any] = {
            "device": device,
            "num_threads": demand.threads,
            "save_every": save_every,
        }
        self.train = ray.remote(**demand.options())(train_run)
        self.switchboard = Switchboard()

    def serve(self) -> bool:
        """Returns when all runs have ended: whether Ctrl-C ended them."""
        try:
            for run in self.runs:
                self._start(run)
            while pending := self._pending():
                for task in self.switchboard.wait(pending, self._store, None):
                    self._end(pending[task])
        except KeyboardInterrupt:
            self._stop()
            return True
        return False

    def _pending(self) -> dict[Any, Run]:
        return {run.task: run for run in self.runs if run.task is not None}

    def _start(self, run: Run) -> None:
        order = RunOrder(
            config=run.folder.config(),
            files=read_files(run.folder),
            command=tuple(sys.argv),
            **self.machine,
        )
        caller = self.switchboard.caller((self.runs.index(run), run.attempt))
        run.task = self.train.remote(order, caller)

    def _store(self, sender: Any, files: Files) -> bool:
        """Stores the files of a run; False if another task has replaced the sender."""
        index, attempt = sender
        run = self.runs[index]
        if attempt != run.attempt or run.task is None:
            return False
        self._write(run, files)
        run.lost_in_a_row = 0
        total = run.folder.config().n_timesteps
        self._say(run, f"checkpoint after {run.steps:,} of {total:,} steps")
        return True

    def _write(self, run: Run, files: Files) -> None:
        try:
            write_files(run.folder, files)
        except OSError as error:
            raise UsageError(
                f"cannot write to {run.folder.path}: {error.strerror or error}; "
                + ("the last checkpoint is intact" if run.saved else "there is no checkpoint yet")
            ) from error

    def _end(self, run: Run) -> None:
        """Collects the files of a task that has ended, or starts it again if it was lost."""
        task, run.task = run.task, None
        try:
            self._write(run, ray.get(task))
        except TaskCancelledError:
            pass
        except RayTaskError as error:  # raised by the code of the task
            run.failure = _message(error)
            self._say(run, f"failed: {run.failure}")
        except RayError as error:  # a worker or node was lost
            self._lost(run, error)

    def _lost(self, run: Run, error: RayError) -> None:
        if run.finished:  # lost after its last checkpoint
            return
        run.attempt += 1
        run.lost_in_a_row += 1
        reason = f"its worker was lost ({type(error).__name__})"
        if run.lost_in_a_row > RESTARTS:
            run.failure = f"{reason} {run.lost_in_a_row} times in a row after {run.steps:,} steps"
            self._say(run, f"failed: {run.failure}")
            return
        self._say(run, f"{reason}; it continues from {run.steps:,} steps on another node")
        try:
            self.demand.check()
        except UsageError as unfit:
            run.failure = str(unfit)
            return
        self._start(run)

    def _stop(self) -> None:
        """Cancels all tasks, and stores the checkpoints that they save at the end."""
        self._say(None, "interrupted: waiting for checkpoints")
        for task in self._pending():
            ray.cancel(task)
        deadline = time.monotonic() + SECONDS_TO_STOP
        while (pending := self._pending()) and (left := deadline - time.monotonic()) > 0:
            for task in self.switchboard.wait(pending, self._store, left):
                with contextlib.suppress(RayError):
                    self._write(pending[task], ray.get(task))
                pending[task].task = None

    def _say(self, run: Run | None, text: str) -> None:
        if not self.quiet:
            print(f"{run.name}: {text}" if run else text, file=sys.stderr, flush=True)


def _message(error: RayTaskError) -> str:
    """The error that a task raised, in one line."""
    cause = error.cause
    text = " ".join(str(cause).split())
    return text if isinstance(cause, UsageError) else f"{type(cause).__name__}: {text:.300}"
