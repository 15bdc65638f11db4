"""Interrupted runs resume from their last checkpoint, whatever interrupted them."""

import csv
import errno
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import CSVOutputFormat
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from tests.training.sb3.interruptions import aged, interrupted, stopping
from training.commands import cli
from training.commands.demo import print_training
from training.policies.policy_file import load_policy_file, read_policy
from training.results.plot import read_learning_curve
from training.runs.run_folder import RunFolder
from training.sb3 import checkpoint as checkpoint_module
from training.sb3 import train as train_module
from training.sb3.model_state import read_state
from training.sb3.train import resume, train
from training.settings.algorithms import BOUNDED_POLICY
from training.settings.errors import UsageError

KILLED = """
import sys
from pathlib import Path
import tests.training.conftest
from training.settings.config_file import load_config
from training.sb3.train import train
config = load_config(sys.argv[1], "Test/Reach-v0", Path(sys.argv[2]))
train(config, Path(sys.argv[3]), save_every=1, quiet=True)
"""


def steps_in_tensorboard(folder: RunFolder) -> list[int]:
    events = EventAccumulator(str(folder.path)).Reload()
    return [event.step for event in events.Scalars("rollout/ep_rew_mean")]


def steps_of(folder: RunFolder) -> list[int]:
    """Steps of each row of the learning curve; all rows must have the same number of cells."""
    with folder.progress.open(newline="") as file:
        rows = list(csv.reader(file))
    assert {len(row) for row in rows} == {len(rows[0])}
    return [int(row[rows[0].index("time/total_timesteps")]) for row in rows[1:]]


KEPT: dict[str, RunFolder] = {}  # by `stopped`


@pytest.fixture
def stopped(quick_ppo, tmp_path, monkeypatch, tmp_path_factory) -> RunFolder:
    """A run of 400 steps that ended after 200, trained once for all tests."""
    if "run" not in KEPT:
        place = tmp_path_factory.mktemp("stopped")
        KEPT["run"] = interrupted(quick_ppo.replace(n_timesteps=400), place, monkeypatch, 200)
    copy = tmp_path / "ppo" / "Test-Reach-v0_1"
    shutil.copytree(KEPT["run"].path, copy)
    return RunFolder(copy)


@pytest.mark.parametrize(
    ("error", "normalize"),
    [(KeyboardInterrupt, False), (RuntimeError, True), (KeyboardInterrupt, {"norm_obs": False})],
)
def test_ppo_resumes_and_trains_for_the_remaining_steps(
    quick_ppo, tmp_path, monkeypatch, error, normalize
):
    config = quick_ppo.replace(n_timesteps=400, normalize=normalize, learning_rate="lin_1e-3")
    folder = interrupted(config, tmp_path, monkeypatch, 200, error)
    before, state = read_learning_curve(folder), read_state(folder.checkpoint)
    assert 0 < state["seconds_in_envs"] < state["seconds"]
    result = resume(folder, quiet=True)
    at_end = read_state(folder.checkpoint)
    # the result is that of the whole run, not of the resumed part
    in_envs = result.environment_time_fraction * result.seconds
    assert at_end["seconds_in_envs"] == pytest.approx(in_envs)
    assert state["seconds_in_envs"] < at_end["seconds_in_envs"] < at_end["seconds"]
    assert at_end["seconds"] >= result.seconds > state["seconds"]
    assert (result.steps, result.steps_before) == (400, 160)
    assert steps_of(folder) == [80, 160, 240, 320, 400]
    assert steps_in_tensorboard(folder) == [80, 160, 240, 320, 400]
    after = read_learning_curve(folder)
    assert after[:2] == before[:2]
    seconds = [row["time/wall_time"] for row in after]
    assert seconds == sorted(seconds)
    with folder.progress.open() as file:
        rates = [float(row["train/learning_rate"]) for row in list(csv.DictReader(file))[1:]]
    assert rates == pytest.approx([8e-4, 6e-4, 4e-4, 2e-4])  # as in an uninterrupted run
    assert len(json.loads((folder.path / "run.json").read_text())["resumed"]) == 1
    assert len(folder.checkpoints()) == 1


@pytest.mark.parametrize("her", [True, False])
def test_sac_resumes_with_its_replay_buffer(quick_sac, tmp_path, monkeypatch, her):
    if not her:
        quick_sac = quick_sac.replace(replay_buffer_class=None, replay_buffer_kwargs={})
    config = quick_sac.replace(n_timesteps=400, buffer_size=200)
    folder = interrupted(config, tmp_path, monkeypatch, 240)
    models = []
    monkeypatch.setattr(train_module, "_learn", lambda model, *_: models.append(model))
    resume(folder)
    with np.load(folder.checkpoint / "replay.npz") as saved:
        assert saved["full"]
        np.testing.assert_array_equal(models[0].replay_buffer.actions, saved["actions"])
    monkeypatch.undo()
    result = resume(aged(folder), quiet=True)
    # a rollout has 8 steps, and Ctrl-C came after 4 of one
    assert result.steps == 404
    assert steps_of(folder) == sorted(set(steps_of(folder)))


STATE_STD = {"policy": BOUNDED_POLICY, "policy_kwargs": {"state_dependent_std": True}}


@pytest.mark.parametrize(
    "values",
    [{"normalize": True}, {"normalize": {"norm_obs": False}}, {"normalize": True, **STATE_STD}],
)
def test_model_is_restored_completely(quick_ppo, tmp_path, monkeypatch, values):
    config = quick_ppo.replace(n_timesteps=400, **values)
    saved = []
    save = checkpoint_module.state_files
    monkeypatch.setattr(
        checkpoint_module,
        "state_files",
        lambda model, notes: saved.append((model, mean_of(model).copy())) or save(model, notes),
    )
    folder = interrupted(config, tmp_path, monkeypatch, 200)
    state, (before, mean) = read_state(folder.checkpoint), saved[-1]
    found = []
    monkeypatch.setattr(train_module, "_learn", lambda model, *_: found.append(drawn(model)))
    for _ in range(2):
        resume(aged(folder))
    assert found[0][2:] == found[1][2:]
    model = found[0][0]
    assert model.num_timesteps == state["steps"] == 160
    assert model._n_updates == before._n_updates
    assert list(model.ep_success_buffer) == list(before.ep_success_buffer)[: state["steps"]]
    for name, parameter in before.policy.state_dict().items():
        torch.testing.assert_close(model.policy.state_dict()[name], parameter, rtol=0, atol=0)
    moments = [one.policy.optimizer.state_dict()["state"] for one in (model, before)]
    torch.testing.assert_close(*moments, rtol=0, atol=0)
    np.testing.assert_array_equal(found[0][1], mean)


def mean_of(model) -> np.ndarray:
    statistics = model.get_vec_normalize_env()
    observations = statistics.obs_rms["observation"].mean if statistics.norm_obs else []
    rewards = statistics.ret_rms
    return np.array([*observations, rewards.mean, rewards.var, rewards.count])


def drawn(model) -> tuple:
    """The model, its statistics, and the next number of each random generator."""
    mean = mean_of(model).copy()
    numbers = (random.random(), np.random.random(), float(torch.rand(1)))  # noqa: NPY002
    first = model.env.reset()["desired_goal"][0, 0]
    return model, mean, *numbers, float(model.action_space.sample()[0]), float(first)


@pytest.mark.parametrize("algo", ["ppo", "sac"])
def test_run_killed_at_any_moment_can_be_resumed(
    algo, quick_ppo, quick_sac, tmp_path, write_yaml, stress
):
    if algo == "ppo" and not stress:
        pytest.skip("a checkpoint of SAC has all files of one of PPO, and its replay buffer")
    config = {"ppo": quick_ppo, "sac": quick_sac}[algo].replace(n_timesteps=1_000_000)
    settings = write_yaml(config.as_yaml())
    folder = RunFolder(tmp_path / algo / "Test-Reach-v0_1")
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, algo, str(settings), str(tmp_path)],
        cwd=Path(__file__).parents[3],
    )
    rng = random.Random(algo)
    try:
        deadline = time.monotonic() + 120
        while not (folder.path.exists() and folder.checkpoints()):
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.01)
        with pytest.raises(UsageError, match="another process is training"):
            resume(folder)
        for _ in range(10):  # the files that a kill at each of these moments would leave
            process.send_signal(signal.SIGSTOP)
            os.waitpid(process.pid, os.WUNTRACED)  # until it has stopped
            state = read_state(folder.checkpoint)
            assert load_policy_file(folder.policy).header.steps == state["steps"]
            process.send_signal(signal.SIGCONT)
            time.sleep(rng.uniform(0, 0.05))
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    # few remaining steps, so that the test is short
    steps = read_state(folder.checkpoint)["steps"]
    shorter = folder.config().replace(n_timesteps=steps + 160)
    (folder.path / "config.yaml").write_text(shorter.as_yaml())
    result = resume(folder, quiet=True)
    assert result.steps_before == steps
    assert result.steps >= steps + 160
    assert steps_of(folder) == sorted(set(steps_of(folder)))
    assert not list(folder.path.glob("*.tmp"))


def full_disk(*_args, **_kwargs):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("file", ["policy.safetensors", "tensors.pt", "model.zip", "progress.csv"])
def test_full_disk_leaves_the_last_checkpoint_intact(quick_ppo, tmp_path, monkeypatch, file):
    write, seen = checkpoint_module._write, []

    def write_until_full(path, content):
        seen.append(path.name)
        if path.name == file and seen.count(file) == 2:
            path.write_bytes(b"half")
            full_disk()
        write(path, content)

    config = quick_ppo.replace(n_timesteps=400)
    with monkeypatch.context() as patched:
        patched.setattr(checkpoint_module, "_write", write_until_full)
        with pytest.raises(UsageError, match="No space left on device; the previous one is intact"):
            train(config, tmp_path, save_every=1, quiet=True)
    folder = RunFolder(tmp_path / "ppo" / "Test-Reach-v0_1")
    assert [number for number, _ in folder.checkpoints()] == [1]
    assert not list(folder.path.glob("*.tmp"))
    read_policy(folder.policy)
    assert resume(aged(folder), quiet=True).steps == 400


def test_full_disk_for_the_learning_curve_stops_training(quick_ppo, tmp_path, monkeypatch):
    write = CSVOutputFormat.write

    def write_until_full(self, values, excluded, step=0):
        if step > 200:
            self.file.write("24")
            self.file.flush()
            full_disk()
        write(self, values, excluded, step)

    with monkeypatch.context() as patched:
        patched.setattr(CSVOutputFormat, "write", write_until_full)
        with pytest.raises(UsageError, match=r"training stopped in .*: No space left on device"):
            train(quick_ppo.replace(n_timesteps=400), tmp_path, save_every=1, quiet=True)
    folder = RunFolder(tmp_path / "ppo" / "Test-Reach-v0_1")
    with monkeypatch.context() as patched:
        patched.setattr("training.sb3.learning_curve.shutil.copyfile", full_disk)
        with pytest.raises(UsageError, match=r"training stopped in .*: No space left on device"):
            resume(folder, quiet=True)
    assert resume(folder, quiet=True).steps == 400
    assert steps_of(folder) == [80, 160, 240, 320, 400]
    assert steps_in_tensorboard(folder) == [80, 160, 240, 320, 400]


def test_checkpoint_without_the_environments_time_can_be_resumed(stopped, capsys):
    folder = stopped
    state = read_state(folder.checkpoint)
    del state["seconds_in_envs"]
    (folder.checkpoint / "state.json").write_text(json.dumps(state))
    result = resume(folder, quiet=True)
    assert read_state(folder.checkpoint)["seconds_in_envs"] is None
    assert result.environment_time_fraction is None
    print_training(result)
    assert "in the environments" not in capsys.readouterr().out


def test_runs_that_cannot_be_resumed_raise(quick_ppo, tmp_path, monkeypatch):
    with pytest.raises(UsageError, match="nothing does not exist; it should be a run folder"):
        resume(RunFolder(tmp_path / "nothing"))
    finished = train(quick_ppo, tmp_path, quiet=True).folder
    with pytest.raises(UsageError, match="is finished after 160 steps"):
        resume(finished)
    config = quick_ppo.replace(n_timesteps=400)
    with monkeypatch.context() as patched:
        stopping(patched, 100, RuntimeError())
        with pytest.raises(RuntimeError):
            train(config, tmp_path, save_every=300, quiet=True)
    with pytest.raises(UsageError, match="has no checkpoint: the run ended before the first one"):
        resume(RunFolder(tmp_path / "ppo" / "Test-Reach-v0_2"))


@pytest.mark.parametrize("name", ["state.json", "tensors.pt"])
@pytest.mark.parametrize("damage", ["missing", "cut", "foreign"])
def test_damaged_checkpoint_raises(stopped, name, damage):
    folder = stopped
    file = folder.checkpoint / name
    content = file.read_bytes()
    file.unlink()
    if damage != "missing":
        file.write_bytes(content[: len(content) // 2] if damage == "cut" else b"{}")
    with pytest.raises(UsageError, match="checkpoint_3 is damaged"):
        resume(folder)


def test_command_resumes_and_rejects_contradictory_flags(stopped, tmp_path, capsys):
    folder = stopped
    words = ["train", "--resume", str(folder.path)]
    for flags, message in (
        (["--algo", "sac"], "--algo is 'sac'"),
        (["--env", "RigidEnvs/Push-v0"], "--env is 'RigidEnvs/Push-v0'"),
        (["--config", "other.yaml"], "--config cannot be used with --resume"),
        (["--seed", "4"], "seed is 4, but"),
        (["-n", "500"], "n_timesteps is 500, but"),
        (["--hyperparams", "gamma:0.5"], "gamma is 0.5, but"),
        (["--env-kwargs", "reward_type:sparse"], "env_kwargs is {"),
        (["--fidelity", "fast"], "env_kwargs is {"),
    ):
        assert cli.main([*words, *flags]) == 2
        assert message in capsys.readouterr().err
    assert cli.main([*words, "--algo", "ppo", "--seed", "3", "-n", "400"]) == 0
    line = capsys.readouterr().out.splitlines()[-1]
    seconds = read_state(folder.checkpoint)["seconds"]
    assert line.startswith("trained after 400 steps in ")
    speed = float(line.partition("(")[2].partition(" steps/s")[0].replace(",", ""))
    assert speed == pytest.approx(400 / seconds, rel=0.3)  # of the whole run
    assert [path.name for path in (tmp_path / "ppo").iterdir()] == ["Test-Reach-v0_1"]


def test_a_run_whose_last_update_was_interrupted_can_be_finished(quick_ppo, tmp_path, monkeypatch):
    update = PPO.train

    def interrupted(model):
        if model.num_timesteps >= 160:
            raise KeyboardInterrupt
        update(model)

    with monkeypatch.context() as patched:
        patched.setattr(PPO, "train", interrupted)
        ended = train(quick_ppo, tmp_path, quiet=True)
    assert (ended.steps, ended.interrupted) == (160, True)
    finished = resume(aged(ended.folder), quiet=True)
    assert (finished.steps, finished.interrupted) == (160, False)
    with pytest.raises(UsageError, match="is finished after 160 steps"):
        resume(ended.folder)
