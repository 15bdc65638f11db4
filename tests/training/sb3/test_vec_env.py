"""RigidVecEnv: one test for each difference between the interfaces of Gymnasium and SB3."""

import copy
import importlib
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

import training.sb3
from tests.training.reach import ReachVectorEnv, straight_to_the_goal
from training.sb3.vec_env import RigidVecEnv

WORLDS = 6


def make(**kwargs) -> RigidVecEnv:
    return RigidVecEnv(ReachVectorEnv(WORLDS, **kwargs))


def still(env) -> np.ndarray:
    return np.zeros((env.num_envs, 2), np.float32)


def run_to_the_end(env, steps: int = 10):
    """Steps with zero actions; returns the outcome of the last step."""
    for _ in range(steps):
        outcome = env.step(still(env))
    return outcome


def test_spaces_are_those_of_one_world():
    env = make()
    assert env.observation_space == env.envs.single_observation_space
    assert env.action_space == env.envs.single_action_space
    assert env.num_envs == WORLDS


def test_other_autoreset_modes_raise():
    with pytest.raises(ValueError, match=r"autoreset_mode is .*should be .*SAME_STEP"):
        make(autoreset_mode=AutoresetMode.NEXT_STEP)


def test_dones_are_terminated_or_truncated():
    env = make(terminate_on_success=True, stagger=3)
    observation = env.reset()
    ended_by_success = ended_by_time = 0
    for _ in range(12):
        # worlds 0 to 2 move to the goal, the others do not move
        actions = straight_to_the_goal(observation)
        actions[3:] = 0
        observation, _, dones, infos = env.step(actions)
        assert dones.dtype == bool
        assert dones.shape == (WORLDS,)
        for done, info in zip(dones, infos, strict=True):
            assert done == ("terminal_observation" in info)
            ended_by_success += bool(done and info["is_success"])
            ended_by_time += bool(done and not info["is_success"])
    assert ended_by_success
    assert ended_by_time


def test_time_limit_is_truncated_and_not_terminated():
    env = make(max_episode_steps=1, terminate_on_success=True)
    env.seed(0)
    env.reset()
    # world 0 is at its goal in the last step: both terminated and truncated
    env.envs.buffer["desired_goal"][0] = 0
    _, _, dones, infos = env.step(still(env))
    assert dones.all()
    assert infos[0]["TimeLimit.truncated"] is False
    assert [info["TimeLimit.truncated"] for info in infos[1:]] == [True] * (WORLDS - 1)


def test_terminal_observation_is_that_of_the_ended_episode():
    env = make()
    observation = env.reset()
    goals = observation["desired_goal"].copy()
    right = np.tile(np.float32([1, 0]), (WORLDS, 1))
    for _ in range(10):
        observation, _, dones, infos = env.step(right)
    assert dones.all()
    for world, info in enumerate(infos):
        terminal = info["terminal_observation"]
        np.testing.assert_allclose(terminal["achieved_goal"], [2.5, 0], atol=1e-6)
        np.testing.assert_array_equal(terminal["desired_goal"], goals[world])
    np.testing.assert_array_equal(observation["achieved_goal"], 0)


def test_terminal_observation_is_a_copy():
    env = make()
    env.reset()
    observation, _, _, infos = run_to_the_end(env)
    before = copy.deepcopy([info["terminal_observation"] for info in infos])
    for value in observation.values():
        value[:] = 99
    run_to_the_end(env, 20)
    for info, expected in zip(infos, before, strict=True):
        for key, value in info["terminal_observation"].items():
            np.testing.assert_array_equal(value, expected[key])
            assert not np.shares_memory(value, env.envs.final_buffer[key])


def test_observations_and_rewards_are_not_overwritten_by_later_steps():
    env = make(reward_type="dense")
    first = env.reset()
    first_copy = copy.deepcopy(first)
    second, rewards, dones, _ = env.step(np.ones((WORLDS, 2), np.float32))
    second_copy, rewards_copy, dones_copy = copy.deepcopy((second, rewards, dones))
    run_to_the_end(env, 20)
    for key in first_copy:
        np.testing.assert_array_equal(first[key], first_copy[key])
        np.testing.assert_array_equal(second[key], second_copy[key])
    np.testing.assert_array_equal(rewards, rewards_copy)
    np.testing.assert_array_equal(dones, dones_copy)
    assert rewards.dtype == np.float32


def test_writing_to_an_observation_does_not_change_the_environment():
    env = make()
    observation = env.reset()
    observation["achieved_goal"][:] = 5
    observation, _, _, _ = env.step(still(env))
    np.testing.assert_array_equal(observation["achieved_goal"], 0)


def test_worlds_whose_episode_continues_share_one_empty_info():
    env = make(stagger=4)
    env.reset()
    _, _, dones, infos = run_to_the_end(env, 2)
    assert {id(info) for info in infos[:2]} == {id(infos[0])}
    assert infos[0] == {}
    assert dones.tolist() == [False, False, True] * 2
    assert infos[0] is not infos[2]


def test_info_at_the_end_contains_success_and_terms_of_the_last_step():
    env = make(reward_type="dense")
    observation = env.reset()
    for _ in range(10):
        observation, _, dones, infos = env.step(straight_to_the_goal(observation))
    assert dones.all()
    for info in infos:
        assert info["is_success"] is True
        assert info["distance"] == pytest.approx(0, abs=1e-5)
        assert not any(key.startswith("_") for key in info)


def test_reset_infos_are_one_dict_per_world_and_follow_autoreset():
    env = make(stagger=4)
    env.reset()
    assert env.reset_infos == [{"is_success": False, "episode_index": 0}] * WORLDS
    run_to_the_end(env, 2)
    assert [info["episode_index"] for info in env.reset_infos] == [0, 0, 1] * 2


def test_env_is_wrapped_returns_a_value_per_world():
    env = make()
    assert env.env_is_wrapped(Monitor) == [False] * WORLDS
    assert env.env_is_wrapped(Monitor, indices=[0, 2]) == [False, False]
    wrapped = RigidVecEnv(RecordEpisodeStatistics(ReachVectorEnv(WORLDS)))
    assert wrapped.env_is_wrapped(RecordEpisodeStatistics) == [True] * WORLDS


def test_seed_repeats_episodes_and_applies_to_one_reset():
    env = make()
    assert list(env.seed(5)) == [5 + world for world in range(WORLDS)]
    first = env.reset()["desired_goal"]
    unseeded = env.reset()["desired_goal"]
    env.seed(5)
    again = env.reset()["desired_goal"]
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, unseeded)


def test_seeds_of_worlds_are_consecutive():
    env = make()
    env.seed(5)
    first = env.reset()["desired_goal"]
    env.seed(6)
    np.testing.assert_array_equal(env.reset()["desired_goal"][:-1], first[1:])


def test_options_reach_the_environment_once():
    env = make()
    env.set_options({"difficulty": 2})
    env.reset()
    assert env.envs.received_options == {"difficulty": 2}
    env.reset()
    assert env.envs.received_options is None


def test_options_that_differ_between_worlds_raise():
    env = make()
    env.set_options([{"difficulty": world} for world in range(WORLDS)])
    with pytest.raises(ValueError, match="options differ between worlds"):
        env.reset()


def test_compute_reward_is_called_once_and_repeated_for_the_indices():
    env = make()
    achieved = np.zeros((3, 2), np.float32)
    desired = np.float32([[0, 0], [1, 0], [0, 0.1]])
    result = env.env_method("compute_reward", achieved, desired, [{}] * 3, indices=[0])
    assert len(result) == 1
    np.testing.assert_array_equal(result[0], [0, -1, 0])
    assert len(env.env_method("compute_reward", achieved, desired, [{}] * 3)) == WORLDS


class HarderReward(gym.vector.VectorWrapper):
    def compute_reward(self, achieved, desired, info):
        return self.env.compute_reward(achieved, desired, info) - 1


def test_compute_reward_is_that_of_the_outermost_wrapper():
    env = RigidVecEnv(HarderReward(ReachVectorEnv(WORLDS)))
    goal = np.zeros((1, 2), np.float32)
    assert env.env_method("compute_reward", goal, goal, [{}], indices=[0])[0] == -1
    assert env.get_attr("fidelity", indices=[0]) == ["balanced"]


def test_get_attr_and_set_attr_apply_to_all_worlds():
    env = make()
    assert env.get_attr("fidelity") == ["balanced"] * WORLDS
    assert env.get_attr("fidelity", indices=3) == ["balanced"]
    env.set_attr("fidelity", "fast")
    assert env.get_attr("fidelity", indices=[1, 2]) == ["fast", "fast"]
    assert not env.has_attr("colour")
    with pytest.raises(ValueError, match="should be None: all worlds share 'fidelity'"):
        env.set_attr("fidelity", "fast", indices=[0])
    with pytest.raises(AttributeError, match="no attribute 'colour'"):
        env.get_attr("colour")


def test_render_returns_the_environment_s_frames():
    env = make(render_mode="rgb_array")
    env.reset()
    assert env.render_mode == "rgb_array"
    frames = env.envs.render()
    assert len(env.get_images()) == len(frames) == env.num_envs
    np.testing.assert_array_equal(env.get_images()[0], frames[0])
    assert env.render().ndim == 3


def test_close_closes_the_environment():
    env = make()
    env.close()
    assert env.envs.closed


def test_vec_monitor_reports_return_and_length():
    env = VecMonitor(make(stagger=2))
    env.reset()
    lengths = []
    for _ in range(10):
        _, _, dones, infos = env.step(still(env))
        lengths += [infos[world]["episode"]["l"] for world in np.flatnonzero(dones)]
        for world in np.flatnonzero(dones):
            assert infos[world]["episode"]["r"] == -infos[world]["episode"]["l"]
            assert "terminal_observation" in infos[world]
    assert sorted(lengths) == [6, 6, 8, 8, 10, 10]
    assert infos[1] == {}  # the shared info is not changed


def test_vec_normalize_scales_terminal_observations_once():
    env = VecNormalize(VecMonitor(make()), norm_reward=False)
    env.reset()
    right = np.tile(np.float32([1, 0]), (WORLDS, 1))
    for _ in range(10):
        _, _, _, infos = env.step(right)
    scaled = infos[0]["terminal_observation"]
    original = env.unnormalize_obs(scaled)
    np.testing.assert_allclose(original["achieved_goal"], [2.5, 0], atol=1e-5)


def test_without_stable_baselines_the_import_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(ModuleNotFoundError, match=r'constraints.txt -e "\.\[train\]"'):
        importlib.reload(training.sb3)
