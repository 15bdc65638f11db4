"""Evaluation: one episode per seed, whatever the number of worlds; the confidence interval."""

import numpy as np
import pytest
from scipy.stats import binomtest

from tests.training.reach import ReachEnv, straight_to_the_goal
from training.policies.policy import Policy, scripted_policy
from training.policies.trained_policy import trained_policy
from training.results import evaluate as evaluate_module
from training.results.evaluate import evaluate, print_evaluation, wilson_interval
from training.results.video import record
from training.sb3.train import train
from training.scripted import CONTROLLERS
from training.settings.errors import UsageError


@pytest.fixture
def solver(reach) -> Policy:
    return Policy(straight_to_the_goal, reach, "solver")


@pytest.fixture
def drifter(reach) -> Policy:
    """Passes the goals on the right without stopping."""

    def right(observation):
        return np.tile(np.float32([0.5, 0]), (len(observation["observation"]), 1))

    return Policy(right, reach, "drifter")


@pytest.mark.parametrize(("successes", "trials"), [(0, 10), (10, 10), (973, 1000), (1, 3)])
def test_interval_is_that_of_wilson(successes, trials):
    expected = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    assert wilson_interval(successes, trials) == pytest.approx((expected.low, expected.high))


def test_controller_that_solves_the_task_has_success_rate_1(solver):
    result = evaluate(solver, 50, quiet=True)
    assert result.success_at_end.all()
    assert result.success_at_any_time.all()


def test_success_at_the_end_and_at_any_time_differ(drifter):
    result = evaluate(drifter, 100, quiet=True)
    assert 0 < result.success_at_any_time.mean() < 1
    assert result.success_at_end.sum() < result.success_at_any_time.sum()


@pytest.mark.parametrize("terminate_on_success", [False, True])
def test_episode_i_is_that_of_the_single_environment_with_seed_plus_i(
    drifter, terminate_on_success
):
    kwargs = {"reward_type": "dense", "terminate_on_success": terminate_on_success}
    result = evaluate(drifter, 12, seed=7, quiet=True, **kwargs)
    env = ReachEnv(**kwargs)
    for episode in range(12):
        observation, _ = env.reset(seed=7 + episode)
        total, length, any_time, ended = 0.0, 0, False, False
        while not ended:
            action = drifter.act({key: v[None] for key, v in observation.items()})[0]
            observation, reward, terminated, truncated, info = env.step(action)
            total, length, any_time = total + reward, length + 1, any_time or info["is_success"]
            ended = terminated or truncated
        assert result.episode_return[episode] == pytest.approx(total)
        assert result.length[episode] == length
        assert result.success_at_end[episode] == info["is_success"]
        assert result.success_at_any_time[episode] == any_time


@pytest.mark.parametrize("worlds", [1, 4, 30])
def test_outcome_does_not_depend_on_the_number_of_worlds(drifter, worlds, monkeypatch):
    expected = evaluate(drifter, 10, quiet=True, terminate_on_success=True)
    monkeypatch.setattr(evaluate_module, "WORLDS", worlds)
    result = evaluate(drifter, 10, quiet=True, terminate_on_success=True)
    np.testing.assert_array_equal(result.length, expected.length)
    np.testing.assert_array_equal(result.success_at_end, expected.success_at_end)


def test_short_episodes_count_no_more_than_long_ones(drifter, monkeypatch):
    monkeypatch.setattr(evaluate_module, "WORLDS", 16)
    result = evaluate(drifter, 200, quiet=True, terminate_on_success=True)
    assert len(result.length) == 200
    one_each = evaluate(drifter, 200, quiet=True)
    np.testing.assert_array_equal(result.success_at_any_time, one_each.success_at_any_time)


def test_numbers_out_of_range_raise(solver, tmp_path):
    with pytest.raises(UsageError, match="number of episodes is 0"):
        evaluate(solver, 0)
    with pytest.raises(UsageError, match="seed is -1"):
        evaluate(solver, 1, seed=-1)
    with pytest.raises(UsageError, match="number of episodes is 0"):
        record(solver, tmp_path / "video.mp4", episodes=0)
    with pytest.raises(UsageError, match=r"should end in \.mp4 or \.gif"):
        record(solver, tmp_path / "video.avi")


def test_episodes_without_an_end_raise(solver, tmp_path):
    with pytest.raises(UsageError, match=r"max_episode_steps is -1, should be at least 1"):
        evaluate(solver, 5, max_episode_steps=-1)
    with pytest.raises(UsageError, match=r"max_episode_steps is -1, should be at least 1"):
        record(solver, tmp_path / "a.mp4", max_episode_steps=-1)
    assert not list(tmp_path.iterdir())


def test_a_scripted_controller_acts_from_the_state_beside_pixels():
    push = "RigidEnvs/Push-v0"
    seen = {"obs_type": "pixels+state", "pixel_size": 16}
    plain, other = (evaluate(scripted_policy(push, **a), 20, quiet=True) for a in ({}, seen))
    np.testing.assert_array_equal(plain.episode_return, other.episode_return)
    with pytest.raises(UsageError, match="obs_type is 'pixels', should be 'state' or"):
        scripted_policy(push, obs_type="pixels")


def test_unknown_environment_suggests_the_nearest():
    policy = Policy(straight_to_the_goal, "RigidEnvs/Posh-v0", "solver")
    with pytest.raises(UsageError, match=r"did you mean 'RigidEnvs/Push-v0'\?"):
        evaluate(policy, 1)


def test_output_shows_success_interval_and_how_the_episodes_were_played(solver, capsys):
    print_evaluation(solver, evaluate(solver, 100, seed=5, quiet=True))
    shown = capsys.readouterr().out
    for part in (
        "success at the end",
        "100.0%",
        "96.3% to 100.0%",
        "10.0 steps",
        "5 to 104",
        "balanced",
    ):
        assert part in shown


def test_scripted_policy_is_that_of_the_task(reach, monkeypatch):
    monkeypatch.setitem(CONTROLLERS, "test", straight_to_the_goal)
    assert evaluate(scripted_policy(reach), 5, quiet=True).success_at_end.all()
    with pytest.raises(UsageError, match="unknown environment 'Test/Reech-v0'"):
        scripted_policy("Test/Reech-v0")


def test_trained_policy_is_evaluated_with_the_arguments_of_training(quick_ppo, tmp_path):
    folder = train(quick_ppo, tmp_path, quiet=True).folder
    policy = trained_policy(folder.path)
    assert policy.env_kwargs == {"reward_type": "dense"}
    first, second = (evaluate(policy, 20, quiet=True) for _ in range(2))
    np.testing.assert_array_equal(first.episode_return, second.episode_return)
    unpickled = trained_policy(folder.model, trust_pickle=True)
    assert evaluate(unpickled, 20, quiet=True).episode_return == pytest.approx(first.episode_return)


def test_model_outside_a_run_folder_requires_algorithm_and_environment(quick_ppo, tmp_path, reach):
    folder = train(quick_ppo, tmp_path, quiet=True).folder
    alone = tmp_path / "alone.zip"
    folder.model.rename(alone)
    with pytest.raises(UsageError, match="give --algo and --env"):
        trained_policy(alone, trust_pickle=True)
    trusted = trained_policy(alone, algo="ppo", env_id=reach, trust_pickle=True)
    assert trusted.env_id == reach
    with pytest.raises(UsageError, match="did you mean 'ppo'"):
        trained_policy(alone, algo="ppq", env_id=reach)
    with pytest.raises(UsageError, match=r"model\.zip is missing"):
        trained_policy(folder.path, deterministic=False)


def test_files_that_are_no_policies_raise(quick_ppo, tmp_path):
    with pytest.raises(UsageError, match="does not exist"):
        trained_policy(tmp_path / "nothing")
    folder = train(quick_ppo, tmp_path, quiet=True).folder
    with pytest.raises(UsageError, match="was trained with ppo, not with 'sac'"):
        trained_policy(folder.path, algo="sac")
    folder.model.write_bytes(b"no zip")
    with pytest.raises(UsageError, match="cannot be read as a ppo policy"):
        trained_policy(folder.model, trust_pickle=True)
