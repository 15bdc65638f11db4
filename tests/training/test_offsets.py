"""A policy of offsets sees how far the goal is, and its file acts as it does."""

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
from training.settings.config import OFFSETS
from training.settings.errors import UsageError


def test_features_are_the_observation_the_way_to_the_goal_and_the_goal():
    env = RigidVecEnv(ReachVectorEnv(4))
    found = env.reset()
    features = GoalOffsets(env.observation_space)({k: torch.as_tensor(v) for k, v in found.items()})
    way = SCALE * (found["desired_goal"] - found["achieved_goal"])
    expected = np.concatenate([found["observation"], way, SCALE * found["desired_goal"]], axis=1)
    np.testing.assert_allclose(features, expected, rtol=1e-5, atol=1e-6)
    assert features.shape[1] == GoalOffsets(env.observation_space).features_dim


def test_nothing_of_it_is_learned_and_a_saved_policy_keeps_it(tmp_path):
    model = SAC(OffsetPolicy, RigidVecEnv(ReachVectorEnv(4)))
    assert not list(model.actor.features_extractor.parameters())
    model.save(tmp_path / "model.zip")
    loaded = SAC.load(tmp_path / "model.zip")
    assert isinstance(loaded.actor.features_extractor, GoalOffsets)
    assert isinstance(loaded.critic.features_extractor, GoalOffsets)


@pytest.mark.parametrize("normalize", [False, True])
def test_the_file_of_a_trained_policy_acts_as_the_policy(quick_sac, tmp_path, normalize):
    config = quick_sac.replace(policy=OFFSETS, normalize=normalize)
    folder = train(config, tmp_path, quiet=True).folder
    content = load_policy_file(folder.policy)
    env = RigidVecEnv(ReachVectorEnv(50))
    env.seed(3)
    found = env.reset()
    expected = trained_policy(folder.model, trust_pickle=True).act(found)
    np.testing.assert_allclose(content.act(found), expected, atol=2e-5)
    # goals scaled apart couldn't be compared
    scaled = content.header.normalization
    assert (scaled.keys if scaled else None) == (["observation"] if normalize else None)
    assert content.header.network.widths[0] == sum(v.shape[1] for v in found.values())


def test_it_is_for_goals_and_for_sac(quick_ppo):
    box = spaces.Box(-1.0, 1.0, (3,))
    with pytest.raises(UsageError, match="takes observations with goals, not Dict"):
        GoalOffsets(spaces.Dict({"observation": box}))
    with pytest.raises(
        UsageError, match=r"policy is 'training.policies.offsets.OffsetPolicy', should be"
    ):
        quick_ppo.replace(policy=OFFSETS)
