"""Evaluations of the mean action during training, and what they end."""

import csv

import numpy as np
import pytest

from training.policies.episodes import play_episodes
from training.policies.policy_file import load_policy_file
from training.policies.trained_policy import trained_policy
from training.results.plot import EVALUATED, draw_learning_curves, read_learning_curve
from training.sb3 import evaluation
from training.sb3.train import resume, train
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError
from training.settings.seed_ranges import TRAINING_EVALUATION


def test_an_evaluation_plays_new_episodes_with_the_mean_action(quick_ppo, tmp_path):
    # the rate of learning is zero in the last update: the last evaluation has the final policy
    config = quick_ppo.replace(
        n_timesteps=4000, learning_rate="lin_1e-2", n_epochs=4, normalize=True,
        eval_freq=2000, n_eval_episodes=100,
    )  # fmt: skip
    folder = train(config, tmp_path, quiet=True).folder
    with folder.progress.open() as file:
        rates = [row["eval/success_rate"] for row in csv.DictReader(file)]
    assert [n for n, rate in enumerate(rates) if rate] == [24, 49]
    envs = make_vector_env(config.env_id, 100, **config.env_kwargs)
    played = play_episodes(envs, trained_policy(folder.path).act, TRAINING_EVALUATION + 2 * 100)
    assert float(rates[-1]) == played.success_at_end.mean() > 0.0
    curve = read_learning_curve(folder)
    assert [row[EVALUATED] for row in curve if EVALUATED in row] == [
        float(rates[n]) for n in (24, 49)
    ]
    draw_learning_curves([curve], tmp_path / "curve.png", title="one", labels=["seed 3"])
    draw_learning_curves([curve] * 2, tmp_path / "curves.png", title="two", labels=["a", "b"])


@pytest.mark.parametrize("quick", ["quick_ppo", "quick_sac"])
def test_evaluations_change_no_bit_of_the_training(quick, request, tmp_path):
    config = request.getfixturevalue(quick)
    plain = train(config, tmp_path, quiet=True).folder
    often = train(config.replace(eval_freq=16, n_eval_episodes=20), tmp_path, quiet=True).folder
    for one, other in zip(*(load_policy_file(f.policy).layers for f in (plain, often)),
                          strict=True):  # fmt: skip
        np.testing.assert_array_equal(one[0], other[0])


def test_by_default_training_takes_a_hundred_steps_for_each_episode_and_zero_means_none(quick_ppo):
    assert quick_ppo.replace(eval_freq=None, n_eval_episodes=50).evaluation_interval == 5000
    assert quick_ppo.evaluation_interval == 0
    with pytest.raises(UsageError, match=r"target_success_rate is 0\.9, but eval_freq is 0"):
        quick_ppo.replace(target_success_rate=0.9)


def test_training_ends_when_an_evaluation_reaches_the_target_and_keeps_that_policy(
    quick_ppo, tmp_path
):
    # so low a target is reached by the first success
    config = quick_ppo.replace(
        n_timesteps=100_000, learning_rate=3e-2, n_epochs=4,
        target_success_rate=0.01, eval_freq=80, n_eval_episodes=100,
    )  # fmt: skip
    result = train(config, tmp_path, quiet=True)
    assert result.steps < 100_000
    reached = [row[EVALUATED] for row in read_learning_curve(result.folder) if EVALUATED in row]
    assert reached[-1] >= 0.01
    assert max(reached[:-1], default=0.0) < 0.01
    evaluations = (result.steps - config.n_envs) // config.eval_freq  # training ends a step later
    envs = make_vector_env(config.env_id, 100, **config.env_kwargs)
    policy = trained_policy(result.folder.path)
    played = play_episodes(envs, policy.act, TRAINING_EVALUATION + evaluations * 100)
    assert played.success_at_end.mean() == reached[-1]


def test_the_evaluation_at_which_sac_ends_is_in_its_curve(quick_sac, tmp_path, monkeypatch):
    def play(envs, act, seed):
        return play_episodes(envs, act, seed)._replace(success_at_end=np.ones(5, dtype=bool))

    monkeypatch.setattr(evaluation, "play_episodes", play)
    config = quick_sac.replace(target_success_rate=0.9, eval_freq=120, n_eval_episodes=5)
    result = train(config, tmp_path, quiet=True)
    assert result.steps < config.n_timesteps
    evaluated = [row[EVALUATED] for row in read_learning_curve(result.folder) if EVALUATED in row]
    assert evaluated == [1.0]


def test_a_resumed_run_evaluates_other_episodes_than_before(quick_ppo, tmp_path, monkeypatch):
    seeds = []

    def play(envs, act, seed):
        seeds.append(seed)
        return play_episodes(envs, act, seed)

    monkeypatch.setattr(evaluation, "play_episodes", play)
    config = quick_ppo.replace(n_timesteps=320, eval_freq=80, n_eval_episodes=10)

    class Interrupt(evaluation.BaseCallback):
        def _on_step(self):
            if self.num_timesteps > 170:
                raise KeyboardInterrupt
            return True

    folder = train(config, tmp_path, quiet=True, callbacks=[Interrupt()]).folder
    resume(folder, quiet=True)
    assert seeds == [TRAINING_EVALUATION + 10 * k for k in (1, 2, 3, 4)]


def test_a_rollout_before_an_interrupted_evaluation_is_repeated(quick_ppo, tmp_path, monkeypatch):
    config = quick_ppo.replace(n_timesteps=320, eval_freq=80, n_eval_episodes=10)

    def interrupted(envs, act, seed):
        if seed > TRAINING_EVALUATION + 10:
            raise KeyboardInterrupt
        return play_episodes(envs, act, seed)

    with monkeypatch.context() as patched:
        patched.setattr(evaluation, "play_episodes", interrupted)
        ended = train(config, tmp_path, quiet=True)
    assert ended.steps == 80  # no update has used the second rollout
    assert resume(ended.folder, quiet=True).steps == 320
    with ended.folder.progress.open(newline="") as file:
        evaluated = [row for row in csv.DictReader(file) if row.get("eval/success_rate")]
    assert [int(row["time/total_timesteps"]) for row in evaluated] == [80, 160, 240, 320]
