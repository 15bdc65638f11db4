from pathlib import Path

import gymnasium as gym
import pytest

from tests.training.reach import ReachEnv, ReachVectorEnv
from training.settings.algorithms import PPOConfig, SACConfig

REACH = "Test/Reach-v0"

if REACH not in gym.registry:
    gym.register(
        REACH,
        entry_point=ReachEnv,
        vector_entry_point=ReachVectorEnv,
        kwargs={"task": "test"},
    )


@pytest.fixture
def reach() -> str:
    """Id of the test double."""
    return REACH


@pytest.fixture
def quick_ppo(reach: str) -> PPOConfig:
    """Two short updates of a small network."""
    return PPOConfig(
        env_id=reach,
        n_envs=8,
        n_timesteps=160,
        n_steps=10,
        n_epochs=1,
        batch_size=40,
        eval_freq=0,
        seed=3,
        env_kwargs={"reward_type": "dense"},
        policy_kwargs={"net_arch": [8], "activation": "tanh"},
    )


@pytest.fixture
def quick_sac(reach: str) -> SACConfig:
    """A hundred short updates of a small network, with HER."""
    return SACConfig(
        env_id=reach,
        n_envs=4,
        n_timesteps=200,
        batch_size=32,
        buffer_size=1000,
        learning_starts=80,
        train_freq=2,
        eval_freq=0,
        seed=3,
        env_kwargs={"reward_type": "sparse"},
        policy_kwargs={"net_arch": [8], "activation": "relu"},
        replay_buffer_class="HerReplayBuffer",
        replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
    )


@pytest.fixture
def write_yaml(tmp_path: Path):
    """Writes a configuration file and returns its path."""

    def write(text: str) -> Path:
        path = tmp_path / "settings.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write
