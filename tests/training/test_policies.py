"""benchmarks.policies: runs are reused only if they are finished and have the same settings."""

import pytest
from stable_baselines3.common.callbacks import BaseCallback

from training.sb3 import train as training

policies = pytest.importorskip("benchmarks.policies")


class CtrlC(BaseCallback):
    def _on_step(self):
        if self.num_timesteps > 80:
            raise KeyboardInterrupt
        return True


def test_a_run_is_reused_if_it_is_finished_and_has_the_same_settings(quick_ppo, tmp_path):
    config = quick_ppo.replace(n_timesteps=160)
    interrupted = training.train(config, tmp_path, quiet=True, callbacks=[CtrlC()])
    assert interrupted.interrupted
    run, seconds = policies.trained(config, tmp_path)
    assert run.path == interrupted.folder.path  # resumed
    assert policies.trained(config, tmp_path) == (run, pytest.approx(seconds, abs=0.5))
    other, _ = policies.trained(config.replace(gamma=0.5), tmp_path)
    assert other.path != run.path
    assert other.config().gamma == 0.5


def test_the_interrupted_training_is_not_evaluated(quick_ppo, tmp_path, monkeypatch):
    monkeypatch.setattr(
        policies, "train", lambda *_, **__: training.train(
            quick_ppo.replace(n_timesteps=160), tmp_path, quiet=True, callbacks=[CtrlC()]
        ),
    )  # fmt: skip
    with pytest.raises(KeyboardInterrupt):
        policies.trained(quick_ppo.replace(n_timesteps=160), tmp_path)
