"""Training: run folders, checkpoints, early stopping, learning curves."""

import csv

import numpy as np
import pytest
from stable_baselines3.common.callbacks import BaseCallback

from training.commands.demo import print_training
from training.policies.trained_policy import trained_policy
from training.results.plot import plot_learning_curves, read_learning_curve
from training.runs.run_folder import LOCK
from training.sb3 import train as train_module
from training.sb3.build import LinearSchedule, worlds_and_model
from training.sb3.train import train
from training.settings.algorithms import SACConfig
from training.settings.errors import UsageError


def test_run_writes_logs_and_a_policy(quick_ppo, tmp_path):
    result = train(quick_ppo, tmp_path, quiet=True)
    assert result.steps == 160
    assert not result.interrupted
    assert 0 < result.environment_time_fraction < 1
    # versions of filelock differ in whether the lock's empty file stays
    files = [path.name for path in result.folder.path.iterdir() if path.name != LOCK]
    names = {name.split(".")[0] for name in files}
    assert names == {"config", "run", "versions", "progress", "checkpoint_2", "events"}
    with result.folder.progress.open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["time/total_timesteps"]) for row in rows] == [80, 160]


def test_same_seed_gives_the_same_policy(quick_ppo, tmp_path):
    observation = {
        key: np.full((2, 2), 0.3, np.float32)
        for key in ("observation", "achieved_goal", "desired_goal")
    }
    actions = [
        trained_policy(train(config, tmp_path, quiet=True).folder.path).act(observation)
        for config in (quick_ppo, quick_ppo, quick_ppo.replace(seed=4))
    ]
    np.testing.assert_array_equal(actions[0], actions[1])
    assert not np.array_equal(actions[0], actions[2])


def test_random_seed_is_recorded(quick_ppo, tmp_path):
    result = train(quick_ppo.replace(seed=None), tmp_path, quiet=True)
    assert isinstance(result.folder.config().seed, int)


def test_sac_with_her_trains(quick_sac, tmp_path):
    result = train(quick_sac, tmp_path, quiet=True)
    assert result.steps == 200
    assert trained_policy(result.folder.path).name.startswith("sac")


@pytest.mark.parametrize(
    ("normalize", "scaled"),
    [
        (True, (True, True)),
        (False, None),
        ({}, (True, True)),
        ({"norm_obs": False}, (False, True)),
        ({"norm_reward": False}, (True, False)),
        ({"norm_obs": False, "norm_reward": False}, None),
    ],
)
def test_normalize_says_what_is_scaled(quick_ppo, normalize, scaled):
    with worlds_and_model(quick_ppo.replace(normalize=normalize), "cpu", 1) as (_, model):
        env = model.get_vec_normalize_env()
    assert (None if env is None else (env.norm_obs, env.norm_reward)) == scaled


def test_normalization_is_saved_and_used(quick_ppo, tmp_path):
    result = train(quick_ppo.replace(normalize=True), tmp_path, quiet=True)
    assert result.folder.normalization.exists()
    observation = {
        key: np.full((1, 2), 0.3, np.float32)
        for key in ("observation", "achieved_goal", "desired_goal")
    }
    with_statistics = trained_policy(result.folder.path).act(observation)
    sb3 = trained_policy(result.folder.model, trust_pickle=True)
    np.testing.assert_allclose(sb3.act(observation), with_statistics, atol=1e-6)
    result.folder.normalization.unlink()
    sb3 = trained_policy(result.folder.model, trust_pickle=True)
    assert not np.allclose(sb3.act(observation), with_statistics, atol=1e-6)


def test_a_run_shorter_than_an_update_says_how_long_it_is(quick_ppo, tmp_path, capsys):
    config = quick_ppo.replace(n_timesteps=10)
    result = train(config, tmp_path)
    assert result.steps == config.rollout
    shown = " ".join(capsys.readouterr().out.split())
    assert f"an update takes {config.rollout:,} steps: trains {config.rollout:,} instead of 10" in (
        shown
    )


def test_ctrl_c_saves_the_policy_and_says_how_to_go_on(quick_ppo, tmp_path, monkeypatch, capsys):
    class CtrlC(BaseCallback):
        def _on_step(self) -> bool:
            if self.num_timesteps > 100:
                raise KeyboardInterrupt
            return True

    monkeypatch.setattr(train_module, "BatchedTimeoutBootstrap", CtrlC)
    result = train(quick_ppo, tmp_path, quiet=True)
    assert result.interrupted
    assert trained_policy(result.folder.path)
    print_training(result)
    command = capsys.readouterr().out.splitlines()[-1]
    assert command == f"to go on: rigid-envs train --resume {result.folder.path}"


def test_checkpoints_are_saved_during_training(quick_ppo, tmp_path, monkeypatch):
    class Crash(BaseCallback):
        def _on_step(self) -> bool:
            if self.num_timesteps > 100:
                raise RuntimeError("power cut")
            return True

    monkeypatch.setattr(train_module, "BatchedTimeoutBootstrap", Crash)
    with pytest.raises(RuntimeError, match="power cut"):
        train(quick_ppo, tmp_path, save_every=80, quiet=True)
    assert trained_policy(tmp_path / "ppo" / "Test-Reach-v0_1")


def test_her_without_a_complete_episode_is_reported_before_a_folder_is_created(tmp_path):
    config = SACConfig(
        env_id="RigidEnvs/Reach-v0", n_envs=4, n_timesteps=400, learning_starts=95, eval_freq=0,
        batch_size=32, buffer_size=1000, replay_buffer_class="HerReplayBuffer",
    )  # fmt: skip
    message = "learning_starts is 95, should be at least n_envs × max_episode_steps = 100, or"
    with pytest.raises(UsageError, match=message):
        train(config, tmp_path, quiet=True)
    endless = config.replace(
        env_kwargs={"max_episode_steps": -1}, eval_env_kwargs={"max_episode_steps": 25}
    )
    with pytest.raises(UsageError, match="max_episode_steps is -1, should be at least 1 in train"):
        train(endless, tmp_path, quiet=True)
    assert not list(tmp_path.iterdir())
    train(config.replace(learning_starts=96), tmp_path, quiet=True)  # 100 steps before an update


def test_linear_schedule_falls_to_zero():
    schedule = LinearSchedule(3e-4)
    assert schedule(1.0) == 3e-4
    assert schedule(0.5) == pytest.approx(1.5e-4)
    assert schedule(0.0) == 0


def test_linear_learning_rate_survives_saving(quick_ppo, tmp_path):
    result = train(quick_ppo.replace(learning_rate="lin_3e-4"), tmp_path, quiet=True)
    assert trained_policy(result.folder.path)


def test_invalid_arguments_are_reported_before_a_folder_is_created(quick_ppo, tmp_path):
    with pytest.raises(UsageError, match=r"Test/Reach-v0 .*rejects .*'denze', should be"):
        train(quick_ppo.replace(env_kwargs={"reward_type": "denze"}), tmp_path, quiet=True)
    with pytest.raises(UsageError, match="device is 'gpu'"):
        train(quick_ppo, tmp_path, device="gpu", quiet=True)
    assert not list(tmp_path.iterdir())


def test_plot_of_a_learning_curve_is_small(quick_ppo, tmp_path):
    result = train(quick_ppo, tmp_path, quiet=True)
    rows = read_learning_curve(result.folder)
    assert rows[-1]["time/total_timesteps"] == 160
    assert rows[-1]["time/wall_time"] > 0
    image = plot_learning_curves([result.folder])
    assert image.read_bytes().startswith(b"\x89PNG")
    assert image.stat().st_size < 300_000


def test_run_without_a_learning_curve_raises(quick_ppo, tmp_path):
    result = train(quick_ppo, tmp_path, quiet=True)
    result.folder.progress.write_text("time/total_timesteps,time/wall_time\n80,1.0\n")
    with pytest.raises(UsageError, match="no row with a success rate"):
        plot_learning_curves([result.folder])
    result.folder.progress.unlink()
    with pytest.raises(UsageError, match=r"progress\.csv is missing"):
        plot_learning_curves([result.folder])
