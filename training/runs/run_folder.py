"""A new folder for each training run, with a record of how the run was started.

runs/<algo>/<environment>_<number>/
    config.yaml      the settings, readable by `rigid-envs train --config`
    run.json         algorithm, environment, command, seed, git commit, start time
    versions.json    versions of Python, platform and packages
    progress.csv     the learning curve; events.out.tfevents.* is the same for TensorBoard
    checkpoint_<n>/  the policy, and the state that training resumes from, see checkpoint.py
    .lock            empty; locked while a process trains this run
"""

import io
import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from training.settings.config import TrainConfig
from training.settings.config_file import load_config
from training.settings.environment_ids import folder_name
from training.settings.errors import UsageError, check_exists

CHECKPOINT, LOCK = "checkpoint", ".lock"
PACKAGES = ("rigid-envs", "numpy", "numba", "gymnasium", "stable-baselines3", "torch")


@dataclass(frozen=True)
class RunFolder:
    """The files of one training run."""

    path: Path
    """The folder."""

    def checkpoints(self) -> list[tuple[int, Path]]:
        """Number and path of each checkpoint; only the one with the highest number is valid."""
        return [
            (int(path.name.removeprefix(f"{CHECKPOINT}_")), path)
            for path in self.path.glob(f"{CHECKPOINT}_*")
            if path.name.removeprefix(f"{CHECKPOINT}_").isdecimal()
        ]

    @property
    def checkpoint(self) -> Path:
        """The last checkpoint; the folder itself before the first one."""
        return max(self.checkpoints(), default=(0, self.path))[1]

    @property
    def policy(self) -> Path:
        """The policy file of the last checkpoint."""
        return self.checkpoint / "policy.safetensors"

    @property
    def model(self) -> Path:
        """Stable-Baselines3's model of the last checkpoint."""
        return self.checkpoint / "model.zip"

    @property
    def normalization(self) -> Path:
        """Stable-Baselines3's observation statistics; absent without normalisation."""
        return self.checkpoint / "vecnormalize.pkl"

    @property
    def progress(self) -> Path:
        """The learning curve."""
        return self.path / "progress.csv"

    def check_exists(self) -> None:
        """Raises UsageError unless the folder exists and holds a run."""
        check_exists(self.path, "a run folder")
        if not (self.path / "run.json").exists():
            raise UsageError(f"{self.path} is not a run folder: run.json is missing")

    def config(self) -> TrainConfig:
        """The settings of the run.

        Raises:
            UsageError: The folder holds no run, or its files are damaged.
        """
        self.check_exists()
        description = self.path / "run.json"
        try:
            run = json.loads(description.read_text(encoding="utf-8"))
            algo, env_id = run["algo"], run["env_id"]
        except (OSError, ValueError, KeyError, TypeError):
            raise UsageError(f"{description} is damaged: algo or env_id cannot be read") from None
        return load_config(algo, env_id, self.path / "config.yaml")

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Locks the run against training by another process; released when this process ends.

        Raises:
            UsageError: Another process is training this run.
        """
        self.check_exists()
        try:
            lock = FileLock(self.path / LOCK, timeout=0.0).acquire()
        except Timeout:
            raise UsageError(f"another process is training {self.path}") from None
        with lock:
            yield

    @property
    def last_start(self) -> str:
        """When the run was started or resumed last, as run.json has it; "" if that is damaged."""
        try:
            run = json.loads((self.path / "run.json").read_text(encoding="utf-8"))
            return str([run, *run.get("resumed", [])][-1]["started"])
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return ""

    def record_resumption(self, steps: int) -> None:
        """Adds the resumption to run.json: from which step, by which command, when.

        Raises:
            UsageError: run.json cannot be written.
        """
        description = self.path / "run.json"
        try:
            run = json.loads(description.read_text(encoding="utf-8"))
            run.setdefault("resumed", []).append({"steps": steps, **_provenance()})
            _write_text(description, json.dumps(run, indent=2) + "\n")
        except OSError as error:
            raise UsageError(f"{description} cannot be written: {error.strerror}") from None


def create_run_folder(log_folder: Path, config: TrainConfig) -> RunFolder:
    """Creates the next folder of the algorithm and environment, and writes how the run started.

    Raises:
        UsageError: The folder cannot be created or written.
    """
    parent, own = log_folder / config.algo, folder_name(config.env_id)
    number = 1 + max((n for name, n, _ in _runs(parent) if name == own), default=0)
    try:
        parent.mkdir(parents=True, exist_ok=True)
        path = _make_next(parent / folder_name(config.env_id), number)
    except OSError as error:
        raise UsageError(f"cannot create a folder in {parent}: {error.strerror}") from None
    run = {
        "algo": config.algo,
        "env_id": config.env_id,
        "seed": config.seed,
        **_provenance(),
    }
    try:
        _write_text(path / "config.yaml", config.as_yaml())
        _write_text(path / "versions.json", json.dumps(package_versions(), indent=2) + "\n")
        # last, because run.json marks the folder as a run
        _write_text(path / "run.json", json.dumps(run, indent=2) + "\n")
    except OSError as error:
        raise UsageError(f"cannot write to {path}: {error.strerror}") from None
    return RunFolder(path)


def latest_run(log_folder: Path, algo: str | None = None, env_id: str | None = None) -> RunFolder:
    """The run that was started or resumed last, of any algorithm or environment where None.

    Raises:
        UsageError: There is none.
    """
    runs = [
        (RunFolder(path).last_start, number, path)
        for folder in log_folder.glob(algo or "*")
        for name, number, path in _runs(folder)
        if env_id is None or name == folder_name(env_id)
        if (path / "run.json").exists()
    ]
    if not runs:
        wanted = (f" of {algo}" if algo else "") + (f" on {env_id}" if env_id else "")
        flags = (f" --algo {algo}" if algo else "") + (f" --env {env_id}" if env_id else "")
        raise UsageError(f"no run{wanted} in {log_folder}; to train one: rigid-envs train{flags}")
    return RunFolder(max(runs)[2])


@contextmanager
def atomic_write(path: Path) -> Iterator[io.BufferedWriter]:
    """Opens a file that replaces `path` only once it is complete.

    If writing fails, the previous file remains.
    """
    unfinished = path.with_name(path.name + ".tmp")
    try:
        with unfinished.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: Path) -> Iterator[Path]:
    """Yields an empty folder that becomes `path`, which must not exist, once it is complete.

    Its files are flushed to the disk first. If writing fails, or the process is killed, there is no
    `path`. One process at a time may write folders of the same name up to the last underscore.
    """
    unfinished = path.with_name(f"{path.name.rpartition('_')[0]}.tmp")
    shutil.rmtree(unfinished, ignore_errors=True)  # left by a killed process
    try:
        unfinished.mkdir()
        yield unfinished
        for file in unfinished.iterdir():
            _sync(file)
        _sync(unfinished)
        os.replace(unfinished, path)
        _sync(path.parent)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def package_versions() -> dict[str, Any]:
    """Versions of Python, the platform and the packages that affect a run."""
    versions: dict[str, Any] = {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cpu_count": os.cpu_count(),
    }
    for package in PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:  # run from a source tree that is not installed
            versions[package] = None
    return versions


def git_commit() -> str | None:
    """The commit of this project's source tree, with "-dirty" if tracked files have changed.

    None if the package is not run from its git repository.
    """
    source = Path(__file__).resolve().parents[2]
    try:
        top, commit = _git(source, "rev-parse", "--show-toplevel", "HEAD").splitlines()
        # a site-packages folder within another repository must not report that one's commit
        if Path(top).resolve() != source:
            return None
        changes = _git(source, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.CalledProcessError):
        return None
    return f"{commit}-dirty" if changes else commit


def _provenance() -> dict[str, Any]:
    """Command, commit and time, for run.json."""
    return {
        "command": [Path(sys.argv[0]).name, *sys.argv[1:]],
        "git_commit": git_commit(),
        "started": datetime.now(UTC).isoformat(timespec="milliseconds"),
    }


def _make_next(prefix: Path, number: int) -> Path:
    """Creates the first folder <prefix>_<number> that does not exist, counting up from `number`."""
    while True:
        path = prefix.with_name(f"{prefix.name}_{number}")
        try:
            path.mkdir()
            return path
        except FileExistsError:  # another process took this number in the meantime
            number += 1


def _write_text(path: Path, text: str) -> None:
    with atomic_write(path) as file:
        file.write(text.encode("utf-8"))


def _sync(path: Path) -> None:
    """Flushes a file, or a folder's entries, to the disk.

    Does nothing for folders where they cannot be opened.
    """
    if os.name != "posix" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _runs(folder: Path) -> list[tuple[str, int, Path]]:
    """Of each run of an algorithm: the environment as part of a folder name, number and path."""
    split = ((path.name.rpartition("_"), path) for path in folder.glob("*_*"))
    return [(name, int(number), path) for (name, _, number), path in split if number.isdecimal()]


def _git(source: Path, *words: str) -> str:
    command = ["git", "-C", str(source), *words]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
