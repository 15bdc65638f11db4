from pathlib import Path

import gymnasium as gym
import pytest

from tests.training.reach import ReachEnv, ReachVectorEnv
from training.config import PPOConfig

REACH = "Test/Reach-v0"

if REACH not in gym.registry:
    gym.register(REACH, entry_point=ReachEnv, vector_entry_point=ReachVectorEnv)


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
        seed=3,
        env_kwargs={"reward_type": "dense"},
        policy_kwargs={"net_arch": [8], "activation": "tanh"},
    )


@pytest.fixture
def write_yaml(tmp_path: Path):
    """Writes a configuration file and returns its path."""

    def write(text: str) -> Path:
        path = tmp_path / "settings.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write
