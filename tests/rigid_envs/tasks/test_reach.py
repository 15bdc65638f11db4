"""Reach is a fair task: no goal is reached by chance, and every goal can be reached."""

import numpy as np
import pytest

from rigid_envs.tasks.reach import HIGH, LOW, MIN_DISTANCE, THRESHOLD
from tests.rigid_envs.rollout import REACH, make, make_vec, steps_of
from training.scripted import controller_for

EPISODE = 25


def test_goals_fill_their_box_and_none_is_reached_at_the_start():
    observation, info = make_vec(5000, REACH).reset(seed=0)
    assert not info["is_success"].any()
    goal = observation["desired_goal"].astype(float)
    for end, limit in ((goal.min(axis=0), LOW), (goal.max(axis=0), HIGH)):
        np.testing.assert_allclose(end, limit, atol=0.002)
    away = np.linalg.norm(goal - observation["achieved_goal"], axis=1)
    assert MIN_DISTANCE - 1e-6 < away.min() < MIN_DISTANCE + 0.01
    np.testing.assert_array_equal(observation["achieved_goal"], observation["observation"][:, :3])


def test_every_goal_is_within_the_fingers_workspace():
    envs = make_vec(1000, REACH)
    observation, info = envs.reset(seed=1)
    for _ in range(EPISODE - 1):
        observation, *_, info = envs.step(controller_for(REACH)(observation))
    assert info["is_success"].all()


def test_a_random_policy_hardly_ever_reaches_its_goal():
    envs = make_vec(2000, REACH)
    envs.reset(seed=0)
    reached = np.zeros(2000, dtype=bool)
    actions = np.random.default_rng(0).uniform(-1, 1, (EPISODE - 1, 2000, 3))
    for *_, info in steps_of(envs, actions):
        reached |= info["is_success"]
    assert reached.mean() < 0.02


def test_a_full_action_moves_the_finger_by_a_stride_up_to_the_end_of_its_workspace():
    env = make(REACH)
    observation, _ = env.reset(seed=0)
    for _ in range(2):  # from the second step on it moves at full speed
        before = observation["achieved_goal"]
        observation = env.step(np.array([1.0, 0.0, 0.0]))[0]
    assert (observation["achieved_goal"] - before)[0] == pytest.approx(0.05, abs=0.01)
    for _ in range(15):
        observation = env.step(np.array([1.0, -1.0, -1.0]))[0]
    finger = env._runner.task.finger
    ends = [finger.high[0], finger.low[1], finger.low[2]]
    np.testing.assert_allclose(observation["achieved_goal"], ends, atol=0.003)


def test_the_dense_reward_of_any_goals_can_be_computed():
    env = make(REACH, reward_type="dense")
    env.reset(seed=2)
    observation, *_, info = env.step(env.action_space.sample())
    achieved = observation["achieved_goal"]
    assert env.compute_reward(achieved, achieved, info) == 1.0
    far = achieved + np.array([0.3, 0.0, 0.4])
    assert env.compute_reward(achieved, far, {}) == pytest.approx(-5.0)


def test_the_dense_reward_follows_from_the_distance():
    env = make(REACH, reward_type="dense")
    env.reset(seed=2)
    observation, reward, *_ = env.step(env.action_space.sample())
    apart = np.linalg.norm(observation["achieved_goal"] - observation["desired_goal"])
    assert reward == pytest.approx((apart <= THRESHOLD) - 10.0 * apart, abs=1e-6)
