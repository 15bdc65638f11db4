"""Run folders: never reused, with a record of how the run was started."""

import json
import os
import subprocess
from dataclasses import replace

import pytest

from training.runs import run_folder
from training.runs.run_folder import (
    RunFolder,
    atomic_write,
    create_run_folder,
    git_commit,
    latest_run,
)
from training.settings.config_file import load_config
from training.settings.errors import UsageError


def test_each_run_gets_a_new_folder(tmp_path, quick_ppo):
    paths = [create_run_folder(tmp_path, quick_ppo).path for _ in range(3)]
    assert [path.name for path in paths] == [f"Test-Reach-v0_{n}" for n in (1, 2, 3)]
    assert {path.parent for path in paths} == {tmp_path / "ppo"}


def test_numbers_of_deleted_runs_are_not_reused(tmp_path, quick_ppo):
    first = create_run_folder(tmp_path, quick_ppo).path
    create_run_folder(tmp_path, quick_ppo)
    for file in first.iterdir():
        file.unlink()
    first.rmdir()
    assert create_run_folder(tmp_path, quick_ppo).path.name == "Test-Reach-v0_3"


def test_folder_created_by_another_process_is_not_changed(tmp_path, quick_ppo, monkeypatch):
    taken = create_run_folder(tmp_path, quick_ppo)
    before = taken.path.joinpath("config.yaml").read_bytes()
    monkeypatch.setattr(run_folder, "_runs", lambda *_: [])
    other = create_run_folder(tmp_path, quick_ppo.replace(seed=9))
    assert other.path.name == "Test-Reach-v0_2"
    assert taken.path.joinpath("config.yaml").read_bytes() == before


def test_folder_records_how_the_run_was_started(tmp_path, quick_ppo):
    folder = create_run_folder(tmp_path, quick_ppo)
    assert load_config("ppo", "Test/Reach-v0", folder.path / "config.yaml") == quick_ppo
    assert folder.config() == quick_ppo
    run = json.loads((folder.path / "run.json").read_text())
    assert run["seed"] == 3
    assert run["algo"] == "ppo"
    assert run["command"]
    assert run["git_commit"] is None or len(run["git_commit"].removesuffix("-dirty")) == 40
    versions = json.loads((folder.path / "versions.json").read_text())
    for package in ("python", "numpy", "numba", "gymnasium", "stable-baselines3", "torch"):
        assert versions[package]
    assert "rigid-envs" in versions


def test_commit_is_marked_dirty_after_changes(tmp_path, monkeypatch):
    def git(*words):
        who = ["-c", "user.name=Ada", "-c", "user.email=ada@example.org"]
        subprocess.run(["git", "-C", str(tmp_path), *who, *words], check=True, capture_output=True)

    source = tmp_path / "training" / "runs" / "run_folder.py"
    source.parent.mkdir(parents=True)
    source.write_text("")
    monkeypatch.setattr(run_folder, "__file__", str(source))
    assert git_commit() is None
    git("init")
    git("add", ".")
    git("commit", "-m", "first")
    commit = git_commit()
    assert len(commit) == 40
    (tmp_path / "notes").write_text("untracked")
    assert git_commit() == commit
    source.write_text("changed")
    assert git_commit() == f"{commit}-dirty"


def test_latest_run_is_the_one_that_was_started_or_resumed_last(tmp_path, quick_ppo):
    other = replace(quick_ppo, env_id="Test/Other-v0")
    runs = [create_run_folder(tmp_path, config) for config in (quick_ppo, quick_ppo, other)]
    for run in runs:  # a copy has other times of its files
        os.utime(run.path / "run.json", ns=(0, 10**18 - int(run.path.name[-1])))
    assert latest_run(tmp_path) == runs[2]
    assert latest_run(tmp_path, "ppo") == runs[2]
    assert latest_run(tmp_path, "ppo", "Test/Reach-v0") == runs[1]
    assert latest_run(tmp_path, env_id="Test/Other-v0") == runs[2]
    runs[0].record_resumption(80)
    assert latest_run(tmp_path) == runs[0]


def test_missing_run_suggests_the_command(tmp_path):
    with pytest.raises(UsageError, match="rigid-envs train --algo ppo --env Test/Reach-v0"):
        latest_run(tmp_path, "ppo", "Test/Reach-v0")
    with pytest.raises(UsageError, match=r"no run in .*rigid-envs train$"):
        latest_run(tmp_path)


def test_log_folder_that_is_a_file_raises(tmp_path, quick_ppo):
    file = tmp_path / "runs"
    file.write_text("")
    with pytest.raises(UsageError, match="runs"):
        create_run_folder(file, quick_ppo)
    (tmp_path / "ppo").write_text("")
    with pytest.raises(UsageError, match=r"cannot create a folder in .*ppo"):
        create_run_folder(tmp_path, quick_ppo)


def test_other_folders_raise(tmp_path):
    with pytest.raises(UsageError, match=r"is not a run folder: run\.json is missing"):
        RunFolder(tmp_path).config()
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(UsageError, match=r"run\.json is damaged"):
        RunFolder(tmp_path).config()


def test_failed_write_keeps_the_previous_file(tmp_path):
    path = tmp_path / "model.zip"
    path.write_bytes(b"before")

    def write_half() -> None:
        with atomic_write(path) as file:
            file.write(b"half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_half()
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]
