"""A folder for each training run: never used twice, and it says what made it.

runs/<algo>/<env id>_<number>/
    config.yaml      the settings, readable by `rigid-envs train --config`
    run.json         algorithm, environment, command, seed, git commit, time of start
    versions.json    Python, platform and packages
    progress.csv     the learning curve; events.out.tfevents.* the same for TensorBoard
    checkpoint_<n>/  the policy, and what training goes on from, see checkpoint.py
"""

import io
import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from training.settings.config import TrainConfig, load_config
from training.settings.errors import UsageError

try:
    import fcntl
except ImportError:  # not on Windows, where nothing keeps two processes apart
    fcntl = None  # type: ignore[assignment]

CHECKPOINT = "checkpoint"
PACKAGES = ("rigid-envs", "numpy", "numba", "gymnasium", "stable-baselines3", "torch")


@dataclass(frozen=True)
class RunFolder:
    """The files of one training run."""

    path: Path
    """The folder."""

    def checkpoints(self) -> list[tuple[int, Path]]:
        """Number and path of each checkpoint: of the highest, which is whole, and of remains."""
        return [
            (int(path.name.removeprefix(f"{CHECKPOINT}_")), path)
            for path in self.path.glob(f"{CHECKPOINT}_*")
            if path.name.removeprefix(f"{CHECKPOINT}_").isdecimal()
        ]

    @property
    def checkpoint(self) -> Path:
        """The last checkpoint; the folder itself before the first."""
        return max(self.checkpoints(), default=(0, self.path))[1]

    @property
    def policy(self) -> Path:
        """What acts, as of the last checkpoint."""
        return self.checkpoint / "policy.policy"

    @property
    def model(self) -> Path:
        """Stable-Baselines3's model, as of the last checkpoint."""
        return self.checkpoint / "model.zip"

    @property
    def normalization(self) -> Path:
        """Its statistics of the observations; absent if they are not normalised."""
        return self.checkpoint / "vecnormalize.pkl"

    @property
    def progress(self) -> Path:
        """The learning curve."""
        return self.path / "progress.csv"

    def config(self) -> TrainConfig:
        """The settings that the run was made with.

        Raises:
            UsageError: The folder holds no run, or its files are damaged.
        """
        description = self.path / "run.json"
        try:
            run = json.loads(description.read_text(encoding="utf-8"))
            algo, env_id = run["algo"], run["env_id"]
        except OSError:
            raise UsageError(f"{self.path} is no run folder: run.json is missing") from None
        except (ValueError, KeyError, TypeError):
            raise UsageError(f"{description} is damaged: algo or env_id cannot be read") from None
        return load_config(algo, env_id, self.path / "config.yaml")

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Keeps other processes from training here; the claim ends with ours, however it ends.

        Raises:
            UsageError: Another process trains here.
        """
        with (self.path / "config.yaml").open("rb") as file:
            if fcntl is not None:
                try:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    raise UsageError(f"{self.path} is being trained by another process") from None
            yield

    def note_resumption(self, steps: int) -> None:
        """Adds to run.json that the run goes on, from how many steps and by which command.

        Raises:
            UsageError: It cannot be written.
        """
        description = self.path / "run.json"
        try:
            run = json.loads(description.read_text(encoding="utf-8"))
            run.setdefault("resumed", []).append({"steps": steps, **_circumstances()})
            _write_text(description, json.dumps(run, indent=2) + "\n")
        except OSError as error:
            raise UsageError(f"{description} cannot be written: {error.strerror}") from None


def create_run_folder(log_folder: Path, config: TrainConfig) -> RunFolder:
    """Makes the next free folder of the algorithm and environment, and describes the run in it.

    Raises:
        UsageError: The folder cannot be made.
    """
    number = 1 + max((n for n, _ in _runs(log_folder, config.algo, config.env_id)), default=0)
    parent = _parent(log_folder, config.algo)
    try:
        parent.mkdir(parents=True, exist_ok=True)
        path = _make_next(parent / folder_name(config.env_id), number)
    except OSError as error:
        raise UsageError(f"cannot make a folder in {parent}: {error.strerror}") from None
    run = {
        "algo": config.algo,
        "env_id": config.env_id,
        "seed": config.seed,
        **_circumstances(),
    }
    try:
        _write_text(path / "config.yaml", config.as_yaml())
        _write_text(path / "versions.json", json.dumps(package_versions(), indent=2) + "\n")
        _write_text(path / "run.json", json.dumps(run, indent=2) + "\n")  # last: a run it is now
    except OSError as error:
        raise UsageError(f"cannot write to {path}: {error.strerror}") from None
    return RunFolder(path)


def latest_run(log_folder: Path, algo: str, env_id: str) -> RunFolder:
    """The run with the highest number.

    Raises:
        UsageError: There is none.
    """
    runs = _runs(log_folder, algo, env_id)
    if not runs:
        raise UsageError(
            f"no run of {algo} on {env_id} under {log_folder}; "
            f"make one: rigid-envs train --algo {algo} --env {env_id}"
        )
    return RunFolder(max(runs)[1])


@contextmanager
def written_whole(path: Path) -> Iterator[io.BufferedWriter]:
    """A file to write that appears at `path` only once it is complete.

    Until then, and for good if writing fails, what was there before stays.
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


def _circumstances() -> dict[str, Any]:
    return {
        "command": [Path(sys.argv[0]).name, *sys.argv[1:]],
        "git_commit": git_commit(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _make_next(prefix: Path, number: int) -> Path:
    """Makes the first folder <prefix>_<number> that does not exist, from `number` on."""
    while True:
        path = prefix.with_name(f"{prefix.name}_{number}")
        try:
            path.mkdir()
            return path
        except FileExistsError:  # another run took the number in the meantime
            number += 1


def _write_text(path: Path, text: str) -> None:
    with written_whole(path) as file:
        file.write(text.encode("utf-8"))


def _parent(log_folder: Path, algo: str) -> Path:
    return log_folder / algo


def folder_name(env_id: str) -> str:
    """An environment id as part of the name of a folder, as in RigidEnvs-Push-v0."""
    return env_id.replace("/", "-").replace(":", "-")


def _runs(log_folder: Path, algo: str, env_id: str) -> list[tuple[int, Path]]:
    """Number and path of each run of the algorithm on the environment."""
    prefix = folder_name(env_id) + "_"
    return [
        (int(path.name.removeprefix(prefix)), path)
        for path in _parent(log_folder, algo).glob(f"{prefix}*")
        if path.name.removeprefix(prefix).isdecimal()
    ]


def package_versions() -> dict[str, Any]:
    """Of Python, the platform and the packages that decide a run."""
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
    """The commit of this project's source tree, with "-dirty" where tracked files differ from it.

    None if it is installed from elsewhere.
    """
    source = Path(__file__).resolve().parents[2]
    try:
        top, commit = _git(source, "rev-parse", "--show-toplevel", "HEAD").splitlines()
        # A site-packages inside somebody's repository must not report that repository's commit.
        if Path(top).resolve() != source:
            return None
        changes = _git(source, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.CalledProcessError):
        return None
    return f"{commit}-dirty" if changes else commit


def _git(source: Path, *words: str) -> str:
    command = ["git", "-C", str(source), *words]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
