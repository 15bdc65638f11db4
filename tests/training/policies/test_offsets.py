"""OffsetPolicy: its features contain the goal offset, and its policy file acts as the policy."""

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import SAC

from tests.training.reach import ReachVectorEnv
from training.policies.offsets import SCALE, GoalOffsets, OffsetPolicy
from training.policies.policy_file import load_policy_file
from training.policies.trained_policy import trained_policy
from training.sb3.train import train
from training.sb3.vec_env import RigidVecEnv
from training.settings.algorithms import OFFSET_POLICY
from training.settings.errors import UsageError


def test_features_are_observation_goal_offset_and_goal():
    env = RigidVecEnv(ReachVectorEnv(4))
    found = env.reset()
    features = GoalOffsets(env.observation_space)({k: torch.as_tensor(v) for k, v in found.items()})
    offset = SCALE * (found["desired_goal"] - found["achieved_goal"])
    expected = np.concatenate([found["observation"], offset, SCALE * found["desired_goal"]], axis=1)
    np.testing.assert_allclose(features, expected, rtol=1e-5, atol=1e-6)
    assert features.shape[1] == GoalOffsets(env.observation_space).features_dim


def test_features_have_no_parameters_and_a_saved_policy_keeps_them(tmp_path):
    model = SAC(OffsetPolicy, RigidVecEnv(ReachVectorEnv(4)))
    assert not list(model.actor.features_extractor.parameters())
    model.save(tmp_path / "model.zip")
    loaded = SAC.load(tmp_path / "model.zip")
    assert isinstance(loaded.actor.features_extractor, GoalOffsets)
    assert isinstance(loaded.critic.features_extractor, GoalOffsets)


@pytest.mark.parametrize("normalize", [False, True])
def test_policy_file_acts_as_the_policy(quick_sac, tmp_path, normalize):
    config = quick_sac.replace(policy=OFFSET_POLICY, normalize=normalize)
    folder = train(config, tmp_path, quiet=True).folder
    content = load_policy_file(folder.policy)
    env = RigidVecEnv(ReachVectorEnv(50))
    env.seed(3)
    found = env.reset()
    expected = trained_policy(folder.model, trust_pickle=True).act(found)
    np.testing.assert_allclose(content.act(found), expected, atol=2e-5)
    # achieved and desired goals with different scales could not be compared
    scaled = content.header.normalization
    assert (scaled.keys if scaled else None) == (["observation"] if normalize else None)
    assert content.header.network.widths[0] == sum(v.shape[1] for v in found.values())


def test_spaces_without_goals_and_ppo_raise(quick_ppo):
    box = spaces.Box(-1.0, 1.0, (3,))
    with pytest.raises(UsageError, match="requires observations with goals, not Dict"):
        GoalOffsets(spaces.Dict({"observation": box}))
    with pytest.raises(
        UsageError, match=r"policy is 'training.policies.offsets.OffsetPolicy', should be"
    ):
        quick_ppo.replace(policy=OFFSET_POLICY)
