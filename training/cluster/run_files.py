"""The files of a run folder as bytes, to send a run from node to node."""

import shutil
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from training.runs.run_folder import CHECKPOINT, LOCK, RunFolder, atomic_folder, atomic_write

Files = Mapping[str, bytes]
"""Content of each file by its path in the run folder, as in "checkpoint_3/policy.safetensors"."""


def read_files(folder: RunFolder) -> dict[str, bytes]:
    """The files of a run and of its last checkpoint.

    Args:
        folder: A run that nothing writes meanwhile.
    """
    found = [path for path in folder.path.iterdir() if path.is_file() and path.name != LOCK]
    if folder.checkpoints():
        found += [path for path in folder.checkpoint.iterdir() if path.is_file()]
    return {path.relative_to(folder.path).as_posix(): path.read_bytes() for path in found}


def write_files(folder: RunFolder, files: Files) -> None:
    """Replaces the files of a run so that its last checkpoint is complete at any moment.

    A checkpoint is written before the older ones are removed. Files that are not replaced remain.

    Args:
        folder: The run; its folder is created if it does not exist.
        files: As `read_files` returns them.

    Raises:
        OSError: A file cannot be written.
        ValueError: A path leads out of the folder.
    """
    top: dict[str, bytes] = {}
    checkpoints: dict[str, dict[str, bytes]] = {}
    for name, data in files.items():
        *folders, file = PurePosixPath(name).parts
        if len(folders) > 1 or ".." in (*folders, file) or PurePosixPath(name).is_absolute():
            raise ValueError(f"{name!r} is not a file of a run or of its checkpoint")
        if folders:
            checkpoints.setdefault(folders[0], {})[file] = data
        else:
            top[file] = data

    folder.path.mkdir(parents=True, exist_ok=True)
    previous = [path for _, path in folder.checkpoints()]
    for name, content in checkpoints.items():
        path = folder.path / name
        if path not in previous:
            _write_checkpoint(path, content)
    # run.json last, because it marks the folder as a run
    for name in sorted(top, key=lambda name: (name == "run.json", name)):
        with atomic_write(folder.path / name) as out:
            out.write(top[name])
    for path in previous:
        if checkpoints and path.name not in checkpoints:
            shutil.rmtree(path, ignore_errors=True)


def _write_checkpoint(path: Path, content: Files) -> None:
    if not path.name.startswith(f"{CHECKPOINT}_"):
        raise ValueError(f"{path.name!r} is not a checkpoint")
    with atomic_folder(path) as unfinished:
        for name, data in content.items():
            (unfinished / name).write_bytes(data)
