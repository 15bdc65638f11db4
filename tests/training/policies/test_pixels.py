"""PixelPolicy: the actor sees where things are in a picture, the critic sees the state."""

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import PPO

from training.policies.features.keypoints import keypoints, map_size
from training.policies.pixels import KeypointFeatures, PixelPolicy, StateFeatures
from training.policies.policy_file import load_policy_file, read_policy
from training.policies.trained_policy import trained_policy
from training.results.evaluate import evaluate
from training.sb3.train import train
from training.sb3.vec_env import RigidVecEnv
from training.settings.algorithms import PIXEL_POLICY, PPOConfig
from training.settings.environments import make_vector_env
from training.settings.errors import UsageError

PUSH = "RigidEnvs/Push-v0"
PICTURES = {"obs_type": "pixels+state", "pixel_size": (24, 20), "camera": "top"}
NETWORK = {"net_arch": [8], "filters": [[4, 5, 2]], "keypoints": 3, "components": [2, -1]}


def config(**values):
    given = {
        "n_envs": 4,
        "n_timesteps": 40,
        "n_steps": 10,
        "batch_size": 20,
        "n_epochs": 1,
        "normalize": {"norm_obs": False},
        "eval_freq": 20,
        "n_eval_episodes": 2,
        "env_kwargs": {"reward_type": "dense", "max_episode_steps": 10, **PICTURES},
        "eval_env_kwargs": {"obs_type": "pixels"},
        "policy": PIXEL_POLICY,
        "policy_kwargs": NETWORK,
        **values,
    }
    return PPOConfig.from_mapping(PUSH, given, "test")


def test_the_keypoint_of_a_map_is_where_the_picture_matches_its_filter():
    pictures = np.zeros((3, 9, 11, 1), np.uint8)
    places = [(0, 0), (10, 8), (5, 4)]  # column, row
    for picture, (column, row) in zip(pictures, places, strict=True):
        picture[row, column] = 255
    filters = [(np.full((1, 1, 1, 1), 100.0), np.zeros(1))]
    found = keypoints(pictures, filters, [1])
    np.testing.assert_allclose(found, [[-1, 1], [1, -1], [0, 0]], atol=1e-9)
    even = keypoints(np.full((1, 9, 11, 1), 7, np.uint8), filters, [1])
    np.testing.assert_allclose(even, [[0, 0]], atol=1e-12)
    assert map_size(48, [(16, 5, 3), (16, 3, 1)]) == 13


def test_many_pictures_have_the_keypoints_of_each():
    random = np.random.default_rng(0)
    pictures = random.integers(0, 256, (150, 12, 12, 3), dtype=np.uint8)
    filters = [
        (random.normal(size=(4, 3, 3, 3)), random.normal(size=4)),
        (random.normal(size=(2, 4, 1, 1)), random.normal(size=2)),
    ]
    many = keypoints(pictures, filters, [2, 1])
    each = [keypoints(picture[None], filters, [2, 1])[0] for picture in pictures]
    np.testing.assert_allclose(many, each, atol=1e-12)
    assert keypoints(pictures[:0], filters, [2, 1]).shape == (0, 4)


def test_the_policy_file_acts_from_pixels_as_the_policy(tmp_path):
    folder = train(config(), tmp_path, quiet=True).folder
    content = load_policy_file(folder.policy)
    assert content.header.observation == {"observation": (20, 24, 3), "desired_goal": (3,)}
    assert content.header.environment.kwargs["obs_type"] == "pixels"
    envs = make_vector_env(PUSH, 30, **{**PICTURES, "obs_type": "pixels"})
    found, _ = envs.reset(seed=0)
    assert "state" not in found
    actions = content.act(found)
    assert np.ptp(actions[:, 0]) > 0.0
    expected = trained_policy(folder.model, trust_pickle=True).act(found)
    np.testing.assert_allclose(actions, expected, atol=2e-5)
    without = {key: found[key] for key in ("observation", "desired_goal")}
    np.testing.assert_array_equal(content.act(without), actions)
    played = evaluate(read_policy(folder.policy), episodes=4)
    assert played.env_kwargs["obs_type"] == "pixels"
    assert len(played.success_at_end) == 4


def test_the_actor_sees_no_state_and_the_critic_no_picture():
    envs = RigidVecEnv(make_vector_env(PUSH, 4, **PICTURES))
    model = PPO(PixelPolicy, envs, n_steps=2, batch_size=8, policy_kwargs=NETWORK)
    found = envs.reset()
    tensors, _ = model.policy.obs_to_tensor(found)

    def outputs(**changed):
        observation = {**tensors, **{key: tensors[key] + value for key, value in changed.items()}}
        with torch.no_grad():
            mean = model.policy.get_distribution(observation).distribution.mean
            return mean, model.policy.predict_values(observation)

    mean, value = outputs()
    for key in ("state", "achieved_goal"):
        new_mean, new_value = outputs(**{key: 0.1})
        assert torch.equal(new_mean, mean)
        assert not torch.equal(new_value, value)
    noise = torch.randint(0, 20, tensors["observation"].shape)
    new_mean, new_value = outputs(observation=noise)
    assert not torch.equal(new_mean, mean)
    assert torch.equal(new_value, value)


def test_a_saved_policy_keeps_its_networks(tmp_path):
    envs = RigidVecEnv(make_vector_env(PUSH, 4, **PICTURES))
    model = PPO(PixelPolicy, envs, n_steps=2, batch_size=8, policy_kwargs=NETWORK)
    model.save(tmp_path / "model.zip")
    model.policy.save(tmp_path / "policy.pt")
    found = envs.reset()
    expected = model.predict(found, deterministic=True)[0]
    for kept in (PPO.load(tmp_path / "model.zip").policy, PixelPolicy.load(tmp_path / "policy.pt")):
        assert isinstance(kept.pi_features_extractor, KeypointFeatures)
        assert isinstance(kept.vf_features_extractor, StateFeatures)
        assert kept.vf_features_extractor.features_dim == 2 * (2 + 3)
        np.testing.assert_array_equal(kept.predict(found, deterministic=True)[0], expected)


def test_wrong_settings_name_what_is_required():
    with pytest.raises(UsageError, match=r"filters requires policy: training.policies.pixels"):
        config(policy="MultiInputPolicy", policy_kwargs={"filters": [[4, 5, 2]]})
    for wrong in ([[4, 5]], [[4, 5, 0]], [4, 5, 2], "4-5-2"):
        with pytest.raises(UsageError, match=r"filters is a list of \[outputs, kernel width, str"):
            config(policy_kwargs={"filters": wrong})
    with pytest.raises(UsageError, match=r"normalize is True, should be false or .norm_obs: fal"):
        config(normalize=True)
    box = spaces.Box(-1.0, 1.0, (3,))
    picture = spaces.Box(0, 255, (3, 20, 20), np.uint8)
    goals = {"achieved_goal": box, "desired_goal": box}
    with pytest.raises(UsageError, match="PixelPolicy requires pictures and goals"):
        KeypointFeatures(spaces.Dict({"observation": box, **goals}))
    with pytest.raises(UsageError, match="too much for pictures of 20 x 20 pixels"):
        KeypointFeatures(spaces.Dict({"observation": picture, **goals}), [[4, 21, 1]])
    deep = spaces.Box(0, 255, (24, 20, 24), np.uint8)
    with pytest.raises(UsageError, match="should have fewer channels than rows and columns"):
        KeypointFeatures(spaces.Dict({"observation": deep, **goals}))
    with pytest.raises(UsageError, match="keypoints is an integer of at least 1 and at most 1024"):
        config(policy_kwargs={"keypoints": 1025})
    pictures = {**PICTURES, "pixel_size": 36}
    with pytest.raises(UsageError, match=r"MultiInputPolicy with obs_type pixels\+state: train"):
        config(policy="MultiInputPolicy", policy_kwargs={}, env_kwargs=pictures)
    with pytest.raises(UsageError, match=r"critic requires obs_type=.pixels\+state"):
        StateFeatures(spaces.Dict({"observation": picture, **goals}))
