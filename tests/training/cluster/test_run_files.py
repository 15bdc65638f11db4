"""Run folders as bytes: they arrive complete, or not at all."""

import errno
import os

import pytest

from training.cluster.run_files import read_files, write_files
from training.runs.run_folder import RunFolder
from training.sb3.train import train


@pytest.fixture
def run(quick_ppo, tmp_path) -> RunFolder:
    return train(quick_ppo, tmp_path / "here", save_every=1, quiet=True).folder


def test_a_run_that_was_sent_equals_the_original(run, tmp_path):
    there = RunFolder(tmp_path / "there")
    write_files(there, read_files(run))
    assert read_files(there) == read_files(run)
    assert there.config() == run.config()
    assert [path.name for _, path in there.checkpoints()] == [run.checkpoint.name]


def test_a_newer_checkpoint_replaces_the_older_one(run, tmp_path):
    there = RunFolder(tmp_path / "there")
    files = read_files(run)
    older = {name.replace("checkpoint_2", "checkpoint_1"): data for name, data in files.items()}
    write_files(there, older)
    (there.path / "video.mp4").write_bytes(b"of the user")
    write_files(there, files)
    assert [number for number, _ in there.checkpoints()] == [2]
    assert (there.path / "video.mp4").exists()
    write_files(there, files)  # the same once more changes nothing
    assert {**read_files(run), "video.mp4": b"of the user"} == read_files(there)


def test_a_full_disk_leaves_the_older_checkpoint_intact(run, tmp_path, monkeypatch):
    there = RunFolder(tmp_path / "there")
    files = read_files(run)
    older = {name.replace("checkpoint_2", "checkpoint_1"): data for name, data in files.items()}
    write_files(there, older)
    before = read_files(there)

    def full_disk(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr("training.runs.run_folder.os.replace", full_disk)
        with pytest.raises(OSError, match="No space left"):
            write_files(there, files)
    assert read_files(there) == before
    assert not list(there.path.glob("*.tmp"))


@pytest.mark.parametrize("name", ["../run.json", "/etc/motd", "checkpoint_1/a/b", "notes/a"])
def test_no_path_leads_out_of_the_folder(name, tmp_path):
    with pytest.raises(ValueError, match="is not a"):
        write_files(RunFolder(tmp_path / "there"), {name: b""})
    assert not list(tmp_path.glob("*.json"))
