"""Batched bootstrapping adds the same values as Stable-Baselines3's loop."""

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO

from tests.training.reach import ReachVectorEnv
from training.sb3.bootstrap import BatchedTimeoutBootstrap
from training.sb3.vec_env import RigidVecEnv


def rewards_of_a_rollout(callback, **env_kwargs) -> np.ndarray:
    """(steps, worlds) rewards in the buffer after a rollout in which several episodes end."""
    env = RigidVecEnv(ReachVectorEnv(6, reward_type="dense", stagger=3, **env_kwargs))
    torch.set_num_threads(1)
    model = PPO("MultiInputPolicy", env, n_steps=30, batch_size=30, n_epochs=1, seed=1)
    _, callback = model._setup_learn(180, callback)
    callback.on_training_start(locals(), globals())
    model.collect_rollouts(env, callback, model.rollout_buffer, model.n_steps)
    return model.rollout_buffer.rewards


@pytest.mark.parametrize("terminate_on_success", [False, True])
def test_batched_values_equal_those_of_one_world_at_a_time(terminate_on_success):
    one_by_one = rewards_of_a_rollout(None, terminate_on_success=terminate_on_success)
    batched = rewards_of_a_rollout(
        BatchedTimeoutBootstrap(), terminate_on_success=terminate_on_success
    )
    np.testing.assert_allclose(batched, one_by_one, rtol=0, atol=1e-6)
