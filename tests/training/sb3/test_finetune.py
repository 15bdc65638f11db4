"""The fine-tuning stage: other arguments of the environment in the last part of a run."""

import shutil

import numpy as np
import pytest
from safetensors.numpy import load_file
from stable_baselines3.common.callbacks import BaseCallback

from training.policies.episodes import Episodes
from training.policies.policy_file import read_policy
from training.policies.trained_policy import trained_policy
from training.runs.run_folder import RunFolder
from training.sb3 import build, evaluation
from training.sb3 import train as train_module
from training.sb3.train import resume, train
from training.settings.errors import UsageError

FINER = {"fidelity": "accurate"}


@pytest.fixture
def made(monkeypatch):
    """Fidelity of the environments in each step."""
    stepped = []
    original = build.make_training_env

    def make(config, env_kwargs):
        envs = original(config, env_kwargs)
        step = envs.step

        def recorded(actions):
            stepped.append(envs.unwrapped.fidelity)
            return step(actions)

        envs.step = recorded
        return envs

    for module in (build, train_module):
        monkeypatch.setattr(module, "make_training_env", make)
    return stepped


@pytest.mark.parametrize("normalize", [False, True])
def test_last_steps_have_the_other_arguments(quick_ppo, tmp_path, made, normalize):
    config = quick_ppo.replace(
        n_timesteps=320, finetune_timesteps=80, finetune_env_kwargs=FINER, normalize=normalize
    )
    result = train(config, tmp_path, quiet=True)
    assert result.steps == 320
    assert made == ["balanced"] * 30 + ["accurate"] * 10
    last = {"reward_type": "dense", **FINER}
    assert read_policy(result.folder.policy).env_kwargs == last
    assert trained_policy(result.folder.path).env_kwargs == last
    assert trained_policy(result.folder.model, trust_pickle=True).env_kwargs == last


def test_her_supports_the_change(quick_sac, tmp_path, made):
    config = quick_sac.replace(finetune_timesteps=60, finetune_env_kwargs=FINER)
    train(config, tmp_path, quiet=True)
    assert set(made) == {"balanced", "accurate"}
    assert made == sorted(made, reverse=True)


def test_success_before_fine_tuning_starts_it_early(quick_ppo, tmp_path, made, monkeypatch):
    every = Episodes(*np.ones((4, 10), dtype=bool))
    monkeypatch.setattr(evaluation, "play_episodes", lambda *_: every)
    config = quick_ppo.replace(
        n_timesteps=1600,
        target_success_rate=1.0,
        eval_freq=80,
        finetune_timesteps=160,
        finetune_env_kwargs=FINER,
        env_kwargs={"reward_type": "dense", "terminate_on_success": True},
    )
    result = train(config, tmp_path, quiet=True)
    # a rollout, the evaluation, and the stage; in it another rollout and evaluation
    assert made == ["balanced"] * 10 + ["accurate"] * 11
    assert result.steps == 168


class InterruptAfter(BaseCallback):
    """Ctrl-C after some steps."""

    def __init__(self, steps):
        super().__init__()
        self.steps = steps

    def _on_step(self):
        if self.num_timesteps > self.steps:
            raise KeyboardInterrupt
        return True


def test_run_interrupted_in_fine_tuning_resumes_in_it(quick_ppo, tmp_path, made):
    config = quick_ppo.replace(n_timesteps=320, finetune_timesteps=160, finetune_env_kwargs=FINER)
    ended = train(config, tmp_path, quiet=True, save_every=80, callbacks=[InterruptAfter(250)])
    assert ended.steps == 240
    copied = RunFolder(shutil.copytree(ended.folder.path, tmp_path / "copy"))
    made.clear()
    assert resume(ended.folder, quiet=True).steps == 320
    assert made == ["accurate"] * 10
    # with the same episodes each time
    resume(copied, quiet=True)
    for name, values in load_file(ended.folder.policy).items():
        np.testing.assert_array_equal(load_file(copied.policy)[name], values)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"finetune_timesteps": 80}, "finetune_env_kwargs is {}; give both or neither"),
        ({"finetune_env_kwargs": FINER}, "finetune_timesteps is 0 .* give both or neither"),
        (
            {"finetune_timesteps": 160, "finetune_env_kwargs": FINER},
            "finetune_timesteps is 160, should be less than n_timesteps = 160",
        ),
        ({"finetune_timesteps": -1}, "an integer of at least 0"),
        ({"finetune_env_kwargs": "accurate"}, "a mapping"),
    ],
)
def test_contradictory_settings_raise(quick_ppo, changes, message):
    with pytest.raises(UsageError, match=message):
        quick_ppo.replace(**changes)


def test_invalid_arguments_are_reported_at_the_start(quick_ppo, tmp_path, made):
    config = quick_ppo.replace(finetune_timesteps=80, finetune_env_kwargs={"reward_type": "dens"})
    with pytest.raises(UsageError, match="dens"):
        train(config, tmp_path, quiet=True)
    assert not made
    assert not list(tmp_path.iterdir())


def test_stage_shorter_than_a_rollout_raises(quick_ppo):
    with pytest.raises(UsageError, match="finetune_timesteps is 79, less than the last rollout"):
        quick_ppo.replace(finetune_timesteps=79, finetune_env_kwargs=FINER)
    quick_ppo.replace(finetune_timesteps=80, finetune_env_kwargs=FINER)


def test_the_stage_keeps_its_part_of_a_run_of_another_length(quick_ppo, quick_sac):
    ppo = quick_ppo.replace(n_timesteps=400, finetune_timesteps=100, finetune_env_kwargs=FINER)
    assert ppo.with_steps(400) == ppo
    assert ppo.with_steps(1200).finetune_timesteps == 300
    sac = quick_sac.replace(n_timesteps=400, finetune_timesteps=100, finetune_env_kwargs=FINER)
    for config in (ppo, sac):
        least = -(-config.rollout * 400 // 100)
        assert config.with_steps(least).finetune_timesteps == config.rollout
        short = config.with_steps(least - 1)
        assert (short.finetune_timesteps, short.finetune_env_kwargs) == (0, {})
    # a rollout of 160 steps is the least stage of other settings
    wider = ppo.with_steps(800, n_steps=20)
    assert (wider.n_timesteps, wider.finetune_timesteps) == (800, 200)
    assert ppo.with_steps(400, n_steps=20).finetune_timesteps == 0
    with pytest.raises(UsageError, match="n_timesteps is 0, should be an integer of at least 1"):
        ppo.with_steps(0)
