"""Training runs on a Ray cluster: what is lost with a node, with Ctrl-C, and with wrong input."""

# ruff: noqa: E402  (imports after the skip where Ray is missing)

import contextlib
import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ray = pytest.importorskip("ray")

from training.cluster import runs as runs_module
from training.cluster.connection import Demand, connected
from training.cluster.runs import train_runs
from training.commands import cli
from training.runs.run_folder import RunFolder, create_run_folder
from training.sb3.model_state import read_state
from training.settings.config_file import load_config
from training.settings.errors import UsageError

ROOT = Path(__file__).parents[3]
REACH = "RigidEnvs/ReachDense-v0"
NO_EVALUATION = ("eval_freq:0", "target_success_rate:null")
STEPS = 200_000
"""Of a run that lasts long enough to lose its node in the middle."""


def reach(**settings):
    """Settings of a run of half a second."""
    small = {"n_envs": 64, "n_steps": 25, "batch_size": 800, "n_timesteps": 3200, "eval_freq": 0}
    small["target_success_rate"] = None
    return load_config("ppo", REACH).replace(**{**small, "seed": 5, **settings})


@contextlib.contextmanager
def command(*words):
    """A process of the command line, and what it has printed to stderr in the end."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "RAY_USAGE_STATS_ENABLED": "0"}
    process = subprocess.Popen(
        [sys.executable, "-m", "training.commands.cli", *map(str, words)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
    )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def train_words(address, folder, *more, steps=STEPS):
    words = ["train", "--env", REACH, "-n", steps, "--save-freq", 16_000, "-f", folder]
    return [*words, "--hyperparams", *NO_EVALUATION, "--ray", address, *more]


def wait_for(condition, process, seconds=180):
    deadline = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)


def folder_of(path, number) -> RunFolder:
    return RunFolder(path / "ppo" / f"RigidEnvs-ReachDense-v0_{number}")


def steps_of(folder) -> list[int]:
    with folder.progress.open(newline="") as file:
        return [int(row["time/total_timesteps"]) for row in csv.DictReader(file)]


def resumptions(folder) -> list[int]:
    run = json.loads((folder.path / "run.json").read_text())
    return [one["steps"] for one in run.get("resumed", [])]


def test_a_killed_node_costs_only_the_work_since_the_last_checkpoint(fragile, tmp_path, capsys):
    folders = [folder_of(tmp_path, 1), folder_of(tmp_path, 2)]
    with command(*train_words(fragile.address, tmp_path, "--seeds", "0-1")) as process:
        wait_for(lambda: all(folder.checkpoints() for folder in folders), process)
        fragile.remove_node(fragile.list_all_nodes()[1], allow_graceful=False)
        out, err = process.communicate(timeout=240)
    # Ray was seen to terminate a driver that had finished and disconnected, in one run of seven
    assert process.returncode in (0, -signal.SIGTERM), out + err
    assert out.count("trained after") == 2
    assert "its worker was lost" in err
    lost = [folder for folder in folders if resumptions(folder)]
    assert len(lost) == 1
    assert resumptions(lost[0])[0] > 0
    for seed, folder in enumerate(folders):
        state = read_state(folder.checkpoint)
        assert state["finished"]
        assert state["steps"] >= STEPS
        assert steps_of(folder) == list(range(6400, state["steps"] + 1, 6400))
        assert folder.config().seed == seed
        assert len(folder.checkpoints()) == 1
        assert not list(folder.path.glob("*.tmp"))
    paths = [str(folder.path) for folder in folders]
    assert cli.main(["plot", *paths]) == 0
    assert cli.main(["evaluate", paths[0], "-n", "100"]) == 0
    assert "success at the end" in capsys.readouterr().out


def test_ctrl_c_saves_a_checkpoint_of_each_run_and_resuming_works_there_too(address, tmp_path):
    first = folder_of(tmp_path, 1)
    # long enough that neither of the two that start first finishes before Ctrl-C arrives, in
    # whatever order their workers come up
    words = train_words(address, tmp_path, "--seeds", "0-3", steps=10 * STEPS)
    with command(*words) as process:
        wait_for(first.checkpoints, process)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120)
    assert process.returncode == 130, err
    assert "interrupted after" in out
    # two of the four ran, in any order; others may have started where these had ended
    runs = [folder_of(tmp_path, number) for number in range(1, 5)]
    assert not any(read_state(run.checkpoint)["finished"] for run in runs if run.checkpoints())
    steps = read_state(first.checkpoint)["steps"]
    assert 0 < steps < 10 * STEPS
    shorter = first.config().replace(n_timesteps=steps + 6400)
    (first.path / "config.yaml").write_text(shorter.as_yaml())
    words = ["train", "--resume", first.path, "--ray", address]
    with command(*words) as process:
        out, err = process.communicate(timeout=120)
    assert process.returncode == 0, out + err
    assert resumptions(first) == [steps]
    assert read_state(first.checkpoint)["finished"]


def test_a_worker_that_dies_again_and_again_fails_and_the_other_runs_continue(
    joined, tmp_path, monkeypatch
):
    train_run = runs_module.train_run

    def dying(order, driver):
        if order.config.seed == 1:
            os._exit(1)
        return train_run(order, driver)

    monkeypatch.setattr(runs_module, "train_run", dying)
    folders = [create_run_folder(tmp_path, reach(seed=seed)) for seed in range(3)]
    outcome = train_runs(folders, quiet=True)
    assert len(outcome.results) == 2
    assert outcome.failures == [
        "seed 1: its worker was lost (WorkerCrashedError) 4 times in a row after 0 steps"
    ]
    assert not outcome.interrupted


def test_a_run_whose_task_is_lost_after_its_last_checkpoint_is_finished(
    joined, tmp_path, monkeypatch
):
    train_run = runs_module.train_run

    def dying(order, driver):
        train_run(order, driver)
        os._exit(1)

    monkeypatch.setattr(runs_module, "train_run", dying)
    outcome = train_runs([create_run_folder(tmp_path, reach())], quiet=True)
    assert outcome.failures == []
    assert [result.steps for result in outcome.results] == [3200]
    assert not outcome.results[0].interrupted


def test_an_error_in_a_task_names_the_run_and_leaves_the_others(joined, tmp_path, monkeypatch):
    train_run = runs_module.train_run

    def failing(order, driver):
        if order.config.seed == 1:
            raise UsageError("learning_rate is 9, should be less")
        return train_run(order, driver)

    monkeypatch.setattr(runs_module, "train_run", failing)
    folders = [create_run_folder(tmp_path, reach(seed=seed)) for seed in range(2)]
    outcome = train_runs(folders, quiet=True)
    assert outcome.failures == ["seed 1: learning_rate is 9, should be less"]
    assert [result.folder for result in outcome.results] == folders[:1]


def test_a_task_uses_as_many_threads_as_it_has_cpus(joined):
    def threads():
        import torch

        from training.settings.environments import environment_threads, make_vector_env

        with environment_threads(1):
            envs = make_vector_env(REACH, 16)
        return torch.get_num_threads(), envs.unwrapped.runner.world.threads

    task = ray.remote(**Demand.of(1, "cpu").options())(threads)
    assert ray.get(task.remote()) == (1, 1)


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ("nowhere", "--ray is 'nowhere', should be HOST:PORT"),
        ("127.0.0.1:1", "--ray is '127.0.0.1:1': nothing answers there"),
        ("127.0.0.1:99999", "--ray is '127.0.0.1:99999': nothing answers there"),
        ("no.such.host.invalid:6379", "nothing answers there"),
    ],
)
def test_a_wrong_address_is_reported_before_any_folder_is_created(
    wrong, complaint, tmp_path, capsys
):
    words = ["train", "--env", REACH, "-f", str(tmp_path), "--seeds", "0-1", "--ray", wrong]
    assert cli.main(words) == 2
    err = capsys.readouterr().err
    assert complaint in err
    assert "should be HOST:PORT of a head" in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_as_many_tasks_run_at_a_time_as_nodes_have_cpus_and_gpus(monkeypatch):
    both, cpus = {"CPU": 8.0, "GPU": 2.0}, {"CPU": 4.0}
    nodes = [{"Alive": True, "Resources": each} for each in (both, cpus)]
    monkeypatch.setattr(ray, "nodes", lambda: nodes)
    assert [Demand.of(2, one).slots() for one in ("cpu", "auto", "cuda")] == [6, 6, 2]


def test_more_threads_than_a_node_has_are_rejected(address, tmp_path, capsys):
    words = ["train", "--env", REACH, "-f", str(tmp_path), "--num-threads", "2"]
    assert cli.main([*words, "--ray", address]) == 2
    assert "--num-threads is 2, but the largest node of the Ray cluster has 1 CPUs" in (
        capsys.readouterr().err
    )
    with connected(address):
        with pytest.raises(UsageError, match="--device needs a GPU"):
            Demand.of(1, "cuda").check()
        assert Demand.of(1, "cpu").slots() == 2
    assert not list(tmp_path.iterdir())
