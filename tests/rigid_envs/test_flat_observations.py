"""obs_type="flat": state and goals in one array, for learners without dictionaries."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector
from stable_baselines3 import PPO

from rigid_envs import RigidVectorEnv
from rigid_envs.wrappers import SuccessBonus
from tests.rigid_envs.rollout import IDS, PUSH, make, make_vec, random_actions
from training.sb3.vec_env import RigidVecEnv


def joined(observation):
    return np.concatenate(
        [observation[name] for name in ("observation", "achieved_goal", "desired_goal")], axis=-1
    )


@pytest.mark.parametrize("env_id", IDS)
def test_it_holds_state_achieved_and_desired_goal_in_this_order(env_id):
    flat, named = make(env_id, obs_type="flat"), make(env_id)
    space = flat.observation_space
    assert isinstance(space, gym.spaces.Box)
    assert space.dtype == np.float32
    np.testing.assert_array_equal(
        space.low, joined({name: box.low for name, box in named.observation_space.items()})
    )
    np.testing.assert_array_equal(flat.reset(seed=3)[0], joined(named.reset(seed=3)[0]))
    named.action_space.seed(0)
    for _ in range(5):
        action = named.action_space.sample()
        observation, *rest = flat.step(action)
        expected, *others = named.step(action)
        np.testing.assert_array_equal(observation, joined(expected))
        assert rest[0] == others[0]
        assert observation in space


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_vectors_have_it_in_all_modes_and_at_the_end_of_episodes(mode):
    settings = {"autoreset_mode": mode, "max_episode_steps": 3}
    flat, named = make_vec(4, obs_type="flat", **settings), make_vec(4, **settings)
    np.testing.assert_array_equal(flat.reset(seed=0)[0], joined(named.reset(seed=0)[0]))
    for actions in random_actions(3, 4):
        observation, _, _, truncated, infos = flat.step(actions)
        expected, _, _, _, others = named.step(actions)
        np.testing.assert_array_equal(observation, joined(expected))
        assert observation in flat.observation_space
    assert truncated.all()
    if mode == AutoresetMode.SAME_STEP:
        for last, other in zip(infos["final_obs"], others["final_obs"], strict=True):
            np.testing.assert_array_equal(last, joined(other))


def test_stable_baselines_learns_from_it():
    envs = make_vec(8, obs_type="flat", autoreset_mode="SameStep", max_episode_steps=10)
    model = PPO("MlpPolicy", RigidVecEnv(envs), n_steps=16, batch_size=64, n_epochs=1)
    model.learn(256)
    assert model.num_timesteps == 256


def test_gymnasiums_wrappers_take_it():
    envs = vector.NormalizeObservation(make_vec(3, obs_type="flat"))
    observation, _ = envs.reset(seed=0)
    assert observation.shape == envs.observation_space.shape


def test_pixels_cannot_be_part_of_it_and_shaping_needs_the_goals_by_name():
    with pytest.raises(ValueError, match=r'pixel_size=84 needs .*, got "flat"'):
        make(PUSH, obs_type="flat", pixel_size=84)
    with pytest.raises(TypeError, match="their observation contains achieved_goal"):
        SuccessBonus(make(PUSH, obs_type="flat"), 1.0)


def test_worlds_share_the_attributes_of_their_vector():
    envs = make_vec(3)
    assert isinstance(envs.unwrapped, RigidVectorEnv)
    assert envs.get_attr("num_envs") == (3, 3, 3)
    goals = np.zeros((2, 3))
    rewards = envs.call("compute_reward", goals, goals + 1.0, {})
    assert len(rewards) == 3
    np.testing.assert_array_equal(rewards[0], [-1.0, -1.0])
    assert envs.call("render_mode") == (None, None, None)
    envs.set_attr("label", ["a", "a", "a"])
    assert envs.get_attr("label") == ("a", "a", "a")
    envs.set_attr("label", "b")
    assert envs.label == "b"
    with pytest.raises(ValueError, match="values of 'label' must be 3 equal ones"):
        envs.set_attr("label", ["a", "b", "a"])
