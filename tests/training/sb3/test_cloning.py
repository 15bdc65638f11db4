"""CloningSAC: its actor learns what was intended, and keeps to it."""

import numpy as np
import pytest
import torch

minari = pytest.importorskip("minari", reason="needs the extra data")

from training.datasets.demonstrations import read_demonstrations  # noqa: E402
from training.datasets.minari_store import write_dataset  # noqa: E402
from training.policies.policy import scripted_policy  # noqa: E402
from training.policies.trained_policy import trained_policy  # noqa: E402
from training.results.evaluate import evaluate  # noqa: E402
from training.sb3.build import worlds_and_model  # noqa: E402
from training.sb3.cloning import NOISE  # noqa: E402
from training.sb3.train import train  # noqa: E402
from training.settings.algorithms import OFFSET_POLICY, SYMLOG_POLICY, SACConfig  # noqa: E402
from training.settings.errors import UsageError  # noqa: E402

REACH, NAME = "RigidEnvs/Reach-v0", "reach/noisy-v0"


@pytest.fixture
def config(tmp_path, monkeypatch):
    """Demonstrations with noise, and settings to imitate them."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    write_dataset(scripted_policy(REACH, fidelity="fast"), 40, NAME, action_noise=0.3, slowdown=0.5)
    return SACConfig(
        env_id=REACH, n_envs=8, n_timesteps=2000, batch_size=64, buffer_size=5000,
        learning_starts=0, train_freq=4, eval_freq=0, seed=1, env_kwargs={"fidelity": "fast"},
        policy=SYMLOG_POLICY, policy_kwargs={"net_arch": [32, 32]}, demonstrations=NAME,
        cloning_steps=800, learning_rate="lin_1e-4",
    )  # fmt: skip


def test_a_clone_solves_the_task_and_still_does_after_training(config, tmp_path):
    folder = train(config, tmp_path / "runs", quiet=True).folder
    assert evaluate(trained_policy(folder.path), 200).success_at_end.mean() > 0.9


def test_the_actor_is_fitted_to_what_was_intended(config):
    episodes = read_demonstrations(config)
    intended = np.concatenate([one.intended for one in episodes])
    executed = np.concatenate([one.actions for one in episodes])
    seen = {
        key: torch.as_tensor(np.concatenate([one.observations[key][:-1] for one in episodes]))
        for key in episodes[0].observations
    }
    with worlds_and_model(config, "cpu", 1) as (_, model):
        model._clone()
        with torch.no_grad():
            found = model.actor(seen, deterministic=True).numpy()
            spread = model.actor.get_action_dist_params(seen)[1].exp()
    apart = [np.sqrt(np.mean((found - actions) ** 2)) for actions in (intended, executed)]
    assert apart[0] < 0.5 * apart[1]
    torch.testing.assert_close(spread, torch.full_like(spread, NOISE))


def test_cloning_needs_demonstrations(config):
    with (
        pytest.raises(UsageError, match=r"cloning_steps is 800, which requires demonstrations"),
        worlds_and_model(config.replace(demonstrations=None), "cpu", 1),
    ):
        pass


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"normalize": True, "policy": OFFSET_POLICY},
            "normalize is True, should be false with clo",
        ),
        ({"ent_coef": 0.1}, r"ent_coef is 0.1, but has no effect with cloning_steps"),
    ],
)
def test_settings_that_cloning_contradicts_raise(config, values, message):
    with pytest.raises(UsageError, match=message):
        config.replace(**values)


def test_the_critic_learns_the_return_and_the_actor_climbs_it(config):
    config = config.replace(
        gamma=0.5, tau=0.05, learning_rate=1e-3, cloning_weight=0.0, cloning_steps=10
    )
    with worlds_and_model(config, "cpu", 1) as (worlds, model):
        model.learn(64)  # to set up the logger; clones
        buffer, observation = model.replay_buffer, worlds.reset()
        buffer.reset()
        draw = np.random.default_rng(0)
        for _ in range(200):  # each step ends its episode, and pays for the first component
            action = draw.uniform(-1, 1, (8, 3)).astype(np.float32)
            done, infos = np.ones(8, dtype=bool), [{} for _ in range(8)]
            buffer.add(observation, observation, action, action[:, 0], done, infos)
        buffer.fraction = 0.0
        seen = {key: torch.as_tensor(values) for key, values in observation.items()}
        with torch.no_grad():
            before = model.actor(seen, deterministic=True)[:, 0].mean()
        losses = [model._update(64)[0] for _ in range(600)]
        with torch.no_grad():
            after = model.actor(seen, deterministic=True)[:, 0].mean()
            value = model.critic(seen, torch.full((8, 3), 0.5))[0].mean()
    assert np.mean(losses[-20:]) < 0.1 * np.mean(losses[:20])
    assert value == pytest.approx(0.5, abs=0.15)
    assert after > max(0.8, before)
