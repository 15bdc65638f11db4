"""Training uses the rewards of wrapped environments, also for relabelled transitions."""

import re

import gymnasium as gym
import numpy as np
import pytest
import yaml
from stable_baselines3 import SAC
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecMonitor
from stable_baselines3.her import HerReplayBuffer

from rigid_envs import wrappers
from rigid_envs.wrappers import Stage, goal_potential
from training.sb3.vec_env import RigidVecEnv
from training.settings.config_file import load_config
from training.settings.environments import make_training_env, make_vector_env
from training.settings.errors import UsageError

PUSH = "RigidEnvs/Push-v0"
WORLDS = 4
EPISODE = 50


def her(env, **buffer):
    return SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs={"n_sampled_goal": 4, **buffer},
        learning_starts=EPISODE * env.num_envs,
        buffer_size=2000,
        batch_size=32,
        policy_kwargs={"net_arch": [16]},
        seed=0,
    )


def test_her_relabels_with_the_wrapped_reward():
    envs = wrappers.vector.SuccessBonus(make_vector_env(PUSH, WORLDS), 5.0)
    envs = wrappers.vector.ScaleReward(wrappers.vector.TimePenalty(envs, 0.5), 2.0)
    model = her(VecMonitor(RigidVecEnv(envs)))
    model.learn(EPISODE * WORLDS + 20)
    rewards = model.replay_buffer.sample(64).rewards.numpy()
    assert set(np.unique(rewards)) == {-3.0, 10.0}


def test_reward_that_her_cannot_recompute_raises():
    envs = wrappers.vector.PotentialShaping(make_vector_env(PUSH, WORLDS), goal_potential, 0.98)
    model = her(VecMonitor(RigidVecEnv(envs)))
    with pytest.raises(ValueError, match=r"PotentialShaping.* HER .*Remove PotentialShaping"):
        model.learn(EPISODE * WORLDS + 20)


def test_her_with_infos_recomputes_costs_of_actions():
    env = make_vec_env(PUSH, 2, wrapper_class=wrappers.ActionPenalty, wrapper_kwargs={"weight": 1})
    model = her(env, copy_info_dict=True)
    model.learn(EPISODE * 2 + 20)
    sample = model.replay_buffer.sample(64)
    charged = (sample.actions.numpy() ** 2).sum(axis=1, keepdims=True)
    sparse = sample.rewards.numpy() + charged
    np.testing.assert_allclose(sparse, np.round(sparse), atol=1e-5)
    assert set(np.unique(np.round(sparse))) == {-1.0, 0.0}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("StagedReward", {"stages": [Stage("reach", -0.4, -0.03), Stage("success", 0, 1)]}),
        ("PotentialShaping", {"potential": goal_potential, "gamma": 0.98}),
        ("ActionPenalty", {"weight": 0.1}),
        ("SmoothnessPenalty", {"weight": 0.1}),
        ("SuccessBonus", {"bonus": 1.0}),
        ("TimePenalty", {"penalty": 1.0}),
        ("ScaleReward", {"scale": 0.1}),
        ("BoundReward", {"low": -0.5, "high": 0.0}),
    ],
)
@pytest.mark.parametrize("kind", ["sparse", "dense"])
def test_stable_baselines3_s_checker_passes(name, arguments, kind):
    check_env(getattr(wrappers, name)(gym.make(PUSH, reward_type=kind), **arguments))


PENALTY = "rigid_envs.wrappers.ActionPenalty"
BONUS = "rigid_envs.wrappers.SuccessBonus"


@pytest.mark.parametrize(
    ("entry", "paid"),
    [
        (None, 0.0),
        ({PENALTY: {"weight": 0.5}}, -1.5),
        ([{PENALTY: {"weight": 0.5}}, {BONUS: {"bonus": 2.0}}, {PENALTY: {"weight": 1}}], -4.5),
    ],
)
def test_configured_wrappers_are_their_vector_versions(write_yaml, entry, paid):
    settings = {"n_timesteps": 100, "n_envs": 3, "env_wrapper": entry}
    path = write_yaml(yaml.safe_dump({PUSH: settings}))
    config = load_config("ppo", PUSH, path)
    plain, wrapped = make_vector_env(PUSH, 3), make_training_env(config, {})
    actions = np.ones((3, 3), dtype=np.float32)
    rewards = []
    for envs in (plain, wrapped):
        envs.reset(seed=0)
        rewards.append(envs.step(actions)[1])
    np.testing.assert_allclose(rewards[1] - rewards[0], paid, rtol=1e-6)


@pytest.mark.parametrize(
    ("entry", "complaint"),
    [
        ("rigid_envs.wrappers.ActionPenalti", "did you mean 'rigid_envs.wrappers.ActionPenalty'"),
        ("rigid_envs.wrappers.PotentialShaping", "should be one of"),
        ({PENALTY: 0.5}, "a mapping, as in"),
        ({PENALTY: {}, BONUS: {}}, "should be NAME, "),
        (3, "should be NAME, "),
    ],
)
def test_invalid_wrappers_raise(write_yaml, entry, complaint):
    path = write_yaml(yaml.safe_dump({PUSH: {"n_timesteps": 100, "env_wrapper": entry}}))
    with pytest.raises(UsageError, match=re.escape(complaint)):
        load_config("ppo", PUSH, path)


def test_invalid_arguments_of_a_wrapper_raise(write_yaml):
    entry = {PENALTY: {"weight": -1.0}}
    path = write_yaml(yaml.safe_dump({PUSH: {"n_timesteps": 100, "env_wrapper": entry}}))
    with pytest.raises(UsageError, match=r"env_wrapper: .*ActionPenalty rejects .*weight"):
        make_training_env(load_config("ppo", PUSH, path), {})
