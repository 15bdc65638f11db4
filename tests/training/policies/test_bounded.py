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


def test_standard_deviation_can_depend_on_the_state(tmp_path):
    env = RigidVecEnv(ReachVectorEnv(4))
    kwargs = {"min_std": MIN_STD, "log_std_init": -1.0, "state_dependent_std": True}
    model = PPO(BoundedPolicy, env, policy_kwargs=kwargs, n_steps=4, batch_size=16)
    new = distribution(model).distribution.stddev.detach()
    np.testing.assert_allclose(new, np.full((4, 2), np.exp(-1.0) + MIN_STD), rtol=1e-6)
    before = model.policy.std_net.weight.clone()
    model.learn(16)
    assert not torch.equal(model.policy.std_net.weight, before)  # the optimiser has the layer
    with torch.no_grad():
        model.policy.std_net.weight[:] = 0.01
    stddev = distribution(model).distribution.stddev
    assert stddev.min() >= MIN_STD
    assert torch.unique(stddev[:, 0]).numel() == 4
    model.save(tmp_path / "model.zip")
    model.policy.save(tmp_path / "policy.pt")
    for kept in (
        PPO.load(tmp_path / "model.zip").policy,
        BoundedPolicy.load(tmp_path / "policy.pt"),
    ):
        assert torch.equal(kept.std_net.weight, model.policy.std_net.weight)


def test_components_of_the_action_may_explore_differently(tmp_path):
    kwargs = {"log_std_init": [-1.5, -0.5], "min_std": MIN_STD}
    model = PPO(BoundedPolicy, RigidVecEnv(ReachVectorEnv(4)), policy_kwargs=kwargs)
    expected = MIN_STD + np.exp([-1.5, -0.5])
    model.policy.save(tmp_path / "policy.pt")
    for policy in (model.policy, BoundedPolicy.load(tmp_path / "policy.pt")):
        distribution = policy.get_distribution(policy.obs_to_tensor(model.env.reset())[0])
        found = distribution.distribution.stddev.detach().numpy()
        np.testing.assert_allclose(found, np.tile(expected, (4, 1)), rtol=1e-5)


def test_a_deviation_that_could_not_be_learned_raises():
    for wrong in ([-1.0], [-1.0, -1.0, -1.0]):
        kwargs = {"log_std_init": wrong}
        with pytest.raises(UsageError, match=r"should be one number or a list of 2, one for each"):
            PPO(BoundedPolicy, RigidVecEnv(ReachVectorEnv(4)), policy_kwargs=kwargs)
    kwargs = {"log_std_init": [-1.0, -7.0], "state_dependent_std": True}
    with pytest.raises(UsageError, match=r"log_std_init is \[-1.0, -7.0\], should be above -6.0"):
        PPO(BoundedPolicy, RigidVecEnv(ReachVectorEnv(4)), policy_kwargs=kwargs)
    kwargs = {"log_std_init": 1.0, "state_dependent_std": True}
    with pytest.raises(
        UsageError, match=r"log_std_init is 1.0, should be above -6.0 and below 0.5"
    ):
        PPO(BoundedPolicy, RigidVecEnv(ReachVectorEnv(4)), policy_kwargs=kwargs)


def test_saved_policy_keeps_its_floor(model, tmp_path):
    model.save(tmp_path / "model.zip")
    assert PPO.load(tmp_path / "model.zip").policy.min_std == MIN_STD


def test_run_folder_stores_the_policy_class_and_other_classes_reject_min_std(
    quick_ppo, quick_sac, tmp_path
):
    config = quick_ppo.replace(policy=BOUNDED_POLICY, policy_kwargs={"min_std": MIN_STD})
    folder = train(config, tmp_path, quiet=True).folder
    assert folder.config() == config
    for name, value in (("min_std", MIN_STD), ("state_dependent_std", True)):
        with pytest.raises(UsageError, match=rf"{name} requires policy: .*Bounded"):
            quick_ppo.replace(policy_kwargs={name: value})
    several = {"log_std_init": [-1.0, -0.5]}
    assert config.replace(policy_kwargs=several).policy_kwargs == several
    for other in (quick_ppo, quick_sac):
        with pytest.raises(UsageError, match=r"is \[-1.0, -0.5\], should be one number with Multi"):
            other.replace(policy_kwargs=several)
        with pytest.raises(UsageError, match=r"log_std_init is a number, or a list of numbers, as"):
            other.replace(policy_kwargs={"log_std_init": ["x"]})


def test_other_action_bounds_raise():
    env = RigidVecEnv(ReachVectorEnv(4))
    env.action_space = gym.spaces.Box(np.float32([-1.0, -0.5]), np.float32([1.0, 1.0]))
    with pytest.raises(UsageError, match="requires actions within ±1, not"):
        PPO(BoundedPolicy, env)
