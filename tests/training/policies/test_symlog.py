"""SymlogPolicy: its features are logarithms of offsets, and its policy file acts as the policy."""

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import SAC

from tests.training.reach import ReachVectorEnv
from training.policies.policy_file import load_policy_file
from training.policies.symlog import UNITS, SymlogOffsets, SymlogPolicy
from training.policies.trained_policy import trained_policy
from training.sb3.train import train
from training.sb3.vec_env import RigidVecEnv
from training.settings.algorithms import SYMLOG_POLICY
from training.settings.errors import UsageError

PAIRS = [[1, 0], [0, 1]]


def test_features_are_logarithms_of_observation_goal_offset_and_differences():
    env = RigidVecEnv(ReachVectorEnv(4))
    found = env.reset()
    extractor = SymlogOffsets(env.observation_space, PAIRS)
    features = extractor({key: torch.as_tensor(value) for key, value in found.items()})
    seen = found["observation"]
    difference = seen[:, [1]] - seen[:, [0]]
    offset = found["desired_goal"] - found["achieved_goal"]
    x = np.concatenate([seen, offset, difference, -difference], axis=1)
    expected = [np.sign(x) * np.log(1.0 + np.abs(x) / unit) for unit in UNITS]
    np.testing.assert_allclose(features, np.concatenate(expected, axis=1), rtol=1e-4, atol=1e-5)
    assert features.shape[1] == extractor.features_dim


def test_a_saved_policy_keeps_its_features(tmp_path):
    kwargs = {"differences": PAIRS}
    model = SAC(SymlogPolicy, RigidVecEnv(ReachVectorEnv(4)), policy_kwargs=kwargs)
    assert not list(model.actor.features_extractor.parameters())
    model.save(tmp_path / "model.zip")
    loaded = SAC.load(tmp_path / "model.zip")
    for one in (loaded.actor, loaded.critic):
        kept = one.features_extractor
        assert torch.equal(kept.matrix, model.actor.features_extractor.matrix)


def test_policy_file_acts_as_the_policy(quick_sac, tmp_path):
    kwargs = {**quick_sac.policy_kwargs, "differences": PAIRS}
    config = quick_sac.replace(policy=SYMLOG_POLICY, policy_kwargs=kwargs)
    folder = train(config, tmp_path, quiet=True).folder
    content = load_policy_file(folder.policy)
    env = RigidVecEnv(ReachVectorEnv(50))
    env.seed(3)
    found = env.reset()
    expected = trained_policy(folder.model, trust_pickle=True).act(found)
    np.testing.assert_allclose(content.act(found), expected, atol=2e-5)
    assert content.header.network.features == "symlog"


def test_wrong_spaces_components_and_algorithms_raise(quick_ppo, quick_sac):
    box = spaces.Box(-1.0, 1.0, (3,))
    goals = spaces.Dict(dict.fromkeys(("observation", "achieved_goal", "desired_goal"), box))
    with pytest.raises(UsageError, match="requires observations with goals, not Dict"):
        SymlogOffsets(spaces.Dict({"observation": box}))
    with pytest.raises(UsageError, match=r"differences is \[\[0, 3\]\], should .* 0 to 2"):
        SymlogOffsets(goals, [[0, 3]])
    with pytest.raises(UsageError, match=r"policy is 'training.policies.symlog.SymlogPolicy'"):
        quick_ppo.replace(policy=SYMLOG_POLICY)
    with pytest.raises(UsageError, match=r"differences requires policy: training.policies.symlog"):
        quick_sac.replace(policy_kwargs={"differences": PAIRS})
    with pytest.raises(UsageError, match=r"normalize is True, should be false with training.poli"):
        quick_sac.replace(policy=SYMLOG_POLICY, normalize=True)
    for wrong in ([[1]], [[1, -1]], [1, 2], "8-0"):
        with pytest.raises(UsageError, match=r"a list of pairs of indices, as in \[\[8, 0\]"):
            quick_sac.replace(policy=SYMLOG_POLICY, policy_kwargs={"differences": wrong})
