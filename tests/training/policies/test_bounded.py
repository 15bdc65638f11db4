"""BoundedPolicy: a mean action within bounds, and a standard deviation above its floor."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO

from tests.training.reach import ReachVectorEnv
from training.policies.bounded import BoundedPolicy
from training.sb3.train import train
from training.sb3.vec_env import RigidVecEnv
from training.settings.algorithms import BOUNDED_POLICY
from training.settings.errors import UsageError

MIN_STD = 0.2


@pytest.fixture
def model() -> PPO:
    env = RigidVecEnv(ReachVectorEnv(4))
    return PPO(BoundedPolicy, env, policy_kwargs={"min_std": MIN_STD, "log_std_init": 0.0})


def distribution(model: PPO):
    return model.policy.get_distribution(model.policy.obs_to_tensor(model.env.reset())[0])


def test_mean_is_within_bounds_and_standard_deviation_above_its_floor(model):
    with torch.no_grad():
        model.policy.action_net.bias[:] = torch.tensor([5.0, -0.5])
        model.policy.action_net.weight[:] = 0.0
        model.policy.log_std[:] = torch.tensor([0.0, -20.0])
    of = distribution(model).distribution
    np.testing.assert_allclose(of.mean.detach()[0], [5.0 / 6.0, -0.5 / 1.5], rtol=1e-6)
    np.testing.assert_allclose(of.stddev.detach()[0], [1.0 + MIN_STD, MIN_STD], rtol=1e-6)


def test_standard_deviation_has_a_gradient_near_its_floor(model):
    with torch.no_grad():
        model.policy.log_std[:] = -3.0
    distribution(model).log_prob(torch.full((4, 2), 0.9)).sum().backward()
    assert (model.policy.log_std.grad.abs() > 0.0).all()


def test_saved_policy_keeps_its_floor(model, tmp_path):
    model.save(tmp_path / "model.zip")
    assert PPO.load(tmp_path / "model.zip").policy.min_std == MIN_STD


def test_run_folder_stores_the_policy_class_and_other_classes_reject_min_std(quick_ppo, tmp_path):
    config = quick_ppo.replace(policy=BOUNDED_POLICY, policy_kwargs={"min_std": MIN_STD})
    folder = train(config, tmp_path, quiet=True).folder
    assert folder.config() == config
    with pytest.raises(UsageError, match=r"min_std requires policy: .*Bounded"):
        quick_ppo.replace(policy_kwargs={"min_std": MIN_STD})


def test_other_action_bounds_raise():
    env = RigidVecEnv(ReachVectorEnv(4))
    env.action_space = gym.spaces.Box(np.float32([-1.0, -0.5]), np.float32([1.0, 1.0]))
    with pytest.raises(UsageError, match="requires actions within ±1, not"):
        PPO(BoundedPolicy, env)
