"""The commands end to end, on a small test environment."""

import pytest

from tests.training.reach import straight_to_the_goal
from training.commands import cli
from training.scripted import CONTROLLERS
from training.scripted.push import push
from training.settings.config_file import load_config

PUSH_DENSE = "RigidEnvs/PushDense-v0"


@pytest.fixture
def trained(reach, tmp_path, quick_ppo, write_yaml):
    """Arguments that select the only run in tmp_path."""
    config = write_yaml(quick_ppo.as_yaml())
    where = ["--env", reach, "-f", str(tmp_path)]
    assert cli.main(["train", *where, "--config", str(config)]) == 0
    return where


def test_train_prints_the_run_folder(capsys, trained):
    out = capsys.readouterr().out
    assert "trained after 160 steps" in out
    assert "Test-Reach-v0_1" in out
    assert "in the environments" in out


def test_evaluate_finds_the_latest_run(trained, capsys):
    assert cli.main(["evaluate", *trained, "-n", "20"]) == 0
    assert "20 episodes" in capsys.readouterr().out


def test_evaluate_prints_how_the_episodes_were_played(trained, reach, capsys):
    capsys.readouterr()
    assert cli.main(["evaluate", *trained, "-n", "20", "--seed", "7"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert f"environment  {reach}" in lines
    assert "fidelity     balanced" in lines
    assert "arguments    reward_type: dense" in lines
    assert "seeds        7 to 26" in lines
    assert cli.main(["evaluate", *trained, "-n", "20", "--fidelity", "fast"]) == 0
    assert "fidelity     fast" in capsys.readouterr().out.splitlines()


def test_evaluate_accepts_a_folder_a_model_and_other_arguments(trained, tmp_path, capsys):
    folder = tmp_path / "ppo" / "Test-Reach-v0_1"
    trusted = ["-n", "5", "--trust-pickle"]
    assert cli.main(["evaluate", str(folder), *trusted, "--stochastic"]) == 0
    assert (
        cli.main(["evaluate", str(folder / "checkpoint_2" / "model.zip"), *trusted, "--seed", "4"])
        == 0
    )
    assert cli.main(["evaluate", str(folder), "-n", "5", "--env-kwargs", "reward_type:sparse"]) == 0
    assert "-10.000" in capsys.readouterr().out


def test_record_and_plot_write_into_the_run_folder(trained, tmp_path, capsys):
    folder = tmp_path / "ppo" / "Test-Reach-v0_1"
    assert cli.main(["record", *trained, "-n", "1"]) == 0
    assert cli.main(["plot", *trained]) == 0
    out = capsys.readouterr().out
    for name in ("video.mp4", "video.png", "learning_curve.png"):
        assert (folder / name).stat().st_size > 0
        assert str(folder / name) in out


def test_scripted_prints_its_table(reach, monkeypatch, capsys):
    monkeypatch.setitem(CONTROLLERS, "test", straight_to_the_goal)
    assert cli.main(["scripted", "--env", reach, "-n", "10"]) == 0
    assert "100.0%" in capsys.readouterr().out


def test_scripted_passes_the_tasks_arguments_to_the_controller(capsys, monkeypatch):
    """Two posts, which are not observed."""
    received = []

    def recorded(observation, obstacles=0):
        received.append((obstacles, observation["desired_goal"].shape[1]))
        return push(observation, obstacles)

    monkeypatch.setitem(CONTROLLERS, "push", recorded)
    words = ["scripted", "-n", "20", "--env-kwargs", "obstacles:2", "target_yaw:true"]
    assert cli.main(words) == 0
    assert set(received) == {(2, 5)}
    assert "100.0%" in capsys.readouterr().out


def test_flags_replace_settings_of_the_file(reach, tmp_path, quick_ppo, write_yaml, capsys):
    config = write_yaml(quick_ppo.as_yaml())
    words = ["train", "--env", reach, "-f", str(tmp_path), "--config", str(config), "--seed", "8"]
    words += ["-n", "80", "--hyperparams", "gamma:0.9", "--env-kwargs", "max_episode_steps:5"]
    assert cli.main([*words, "--fidelity", "fast"]) == 0
    from training.runs.run_folder import latest_run

    config = latest_run(tmp_path, "ppo", reach).config()
    assert (config.seed, config.n_timesteps, config.gamma) == (8, 80, 0.9)
    assert config.env_kwargs == {
        "reward_type": "dense",
        "max_episode_steps": 5,
        "fidelity": "fast",
    }


def test_demo_runs_all_steps(reach, tmp_path, quick_ppo, write_yaml, capsys):
    config = write_yaml(quick_ppo.as_yaml())
    words = ["demo", "--env", reach, "-f", str(tmp_path), "--config", str(config)]
    assert cli.main([*words, "--n-episodes", "10"]) == 0
    out = capsys.readouterr().out
    for part in ("success rate", "wall time", "video.mp4", "learning_curve.png"):
        assert part in out


def test_dense_id_trains_with_the_packaged_settings_and_is_found_again(tmp_path, capsys):
    where = ["--env", PUSH_DENSE, "-f", str(tmp_path)]
    short = ["-n", "800", "--n-envs", "8", "--hyperparams", "batch_size:100"]
    assert cli.main(["train", *where, *short]) == 0
    folder = tmp_path / "ppo" / "RigidEnvs-PushDense-v0_1"
    config = load_config("ppo", PUSH_DENSE, folder / "config.yaml")
    assert config.env_kwargs == {"reward_type": "dense", "fidelity": "balanced"}
    assert config.gamma == load_config("ppo", PUSH_DENSE).gamma
    capsys.readouterr()
    assert cli.main(["evaluate", *where, "-n", "10"]) == 0
    assert f"environment  {PUSH_DENSE}" in capsys.readouterr().out


def test_dense_id_has_the_scripted_controller_of_its_task(capsys):
    assert cli.main(["scripted", "--env", PUSH_DENSE, "-n", "20"]) == 0
    out = capsys.readouterr().out
    assert "100.0%" in out
    assert "arguments    reward_type: dense" in out.splitlines()
