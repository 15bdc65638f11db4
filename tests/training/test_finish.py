"""A run may finish on other worlds: on them alone its success counts, and they are the policy's."""

import pytest
from stable_baselines3.common.callbacks import BaseCallback

from training.policies.policy_file import read_policy
from training.policies.trained_policy import trained_policy
from training.sb3 import train as train_module
from training.sb3.train import resume, train
from training.settings.errors import UsageError

FINER = {"fidelity": "accurate"}


@pytest.fixture
def made(monkeypatch):
    """Fidelities of the worlds that were stepped, one for each step."""
    stepped = []
    original = train_module.make_training_env

    def make(config, env_kwargs):
        envs = original(config, env_kwargs)
        step = envs.step

        def noted(actions):
            stepped.append(envs.unwrapped.fidelity)
            return step(actions)

        envs.step = noted
        return envs

    monkeypatch.setattr(train_module, "make_training_env", make)
    return stepped


@pytest.mark.parametrize("normalize", [False, True])
def test_the_last_steps_are_taken_on_the_other_worlds(quick_ppo, tmp_path, made, normalize):
    config = quick_ppo.replace(
        n_timesteps=320, finish_timesteps=80, finish_env_kwargs=FINER, normalize=normalize
    )
    result = train(config, tmp_path, quiet=True)
    assert result.steps == 320
    assert made == ["balanced"] * 30 + ["accurate"] * 10
    last = {"reward_type": "dense", **FINER}
    assert read_policy(result.folder.policy).env_kwargs == last
    assert trained_policy(result.folder.path).env_kwargs == last
    assert trained_policy(result.folder.model, trust_pickle=True).env_kwargs == last


def test_hindsight_goes_on_with_whole_episodes(quick_sac, tmp_path, made):
    config = quick_sac.replace(finish_timesteps=60, finish_env_kwargs=FINER)
    train(config, tmp_path, quiet=True)
    assert set(made) == {"balanced", "accurate"}
    assert made == sorted(made, reverse=True)


def test_success_before_the_finish_begins_it_early(quick_ppo, tmp_path, made, monkeypatch):
    monkeypatch.setattr(train_module, "SUCCESS_WINDOW", 8)
    config = quick_ppo.replace(
        n_timesteps=1600,
        target_success_rate=1e-9,
        finish_timesteps=160,
        finish_env_kwargs=FINER,
        env_kwargs={"reward_type": "dense", "terminate_on_success": True},
    )
    result = train(config, tmp_path, quiet=True)
    first = made.count("balanced")
    assert 0 < made.index("accurate") == first < 100  # of 180 rollout steps until the last part
    assert result.steps < 1440


class InterruptAfter(BaseCallback):
    """Ctrl-C after some steps."""

    def __init__(self, steps):
        super().__init__()
        self.steps = steps

    def _on_step(self):
        if self.num_timesteps > self.steps:
            raise KeyboardInterrupt
        return True


def test_a_run_that_is_resumed_in_its_finish_goes_on_there(quick_ppo, tmp_path, made):
    config = quick_ppo.replace(n_timesteps=320, finish_timesteps=160, finish_env_kwargs=FINER)
    ended = train(config, tmp_path, quiet=True, save_every=80, callbacks=[InterruptAfter(250)])
    assert ended.steps == 240
    made.clear()
    assert resume(ended.folder, quiet=True).steps == 320
    assert made == ["accurate"] * 10


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"finish_timesteps": 80}, "finish_env_kwargs is {}, should be given both or neither"),
        ({"finish_env_kwargs": FINER}, "finish_timesteps is 0 .* both or neither"),
        (
            {"finish_timesteps": 160, "finish_env_kwargs": FINER},
            "finish_timesteps is 160, should be below n_timesteps = 160",
        ),
        ({"finish_timesteps": -1}, "an integer of at least 0"),
        ({"finish_env_kwargs": "accurate"}, "a mapping"),
    ],
)
def test_settings_that_make_no_finish_are_refused(quick_ppo, changes, message):
    with pytest.raises(UsageError, match=message):
        quick_ppo.replace(**changes)


def test_what_the_environment_would_refuse_is_told_at_the_start(quick_ppo, tmp_path, made):
    config = quick_ppo.replace(finish_timesteps=80, finish_env_kwargs={"reward_type": "dens"})
    with pytest.raises(UsageError, match="dens"):
        train(config, tmp_path, quiet=True)
    assert not made
    assert not list(tmp_path.iterdir())


def test_a_finish_within_the_last_rollout_is_refused(quick_ppo):
    with pytest.raises(UsageError, match="finish_timesteps is 79, within the last rollout"):
        quick_ppo.replace(finish_timesteps=79, finish_env_kwargs=FINER)
    quick_ppo.replace(finish_timesteps=80, finish_env_kwargs=FINER)
