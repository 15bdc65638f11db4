"""compute_reward of a wrapped environment returns the rewards of its steps, or raises."""

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs import wrappers
from rigid_envs.wrappers import Stage
from tests.rigid_envs.rollout import (
    EPISODE,
    PUSH,
    REWARDS,
    make_vec,
    put_cubes_on_goals,
    random_actions,
    steps_of,
)
from tests.rigid_envs.wrappers.test_formulas import GOAL_RULES, STACKS, wrapped, wrapped_vec

INFO_RULES = ["PotentialShaping", "ActionPenalty", "SmoothnessPenalty", "StagedReward"]


def goals(observation):
    return observation["achieved_goal"], observation["desired_goal"]


def half_solved(envs):
    put_cubes_on_goals(envs.unwrapped, np.arange(envs.num_envs) % 2 == 0)


@pytest.mark.parametrize("kind", REWARDS)
@pytest.mark.parametrize("names", STACKS, ids="+".join)
def test_a_step_returns_the_reward_of_compute_reward_bitwise(names, kind):
    env = wrapped(gym.make(PUSH, reward_type=kind), names)
    env.reset(seed=3)
    for step, action in enumerate(random_actions(EPISODE, 1)[:, 0]):
        if step == 30:
            put_cubes_on_goals(env.unwrapped)
        observation, reward, _, _, info = env.step(action)
        assert type(reward) is float
        assert reward == env.compute_reward(*goals(observation), info)


@pytest.mark.parametrize("kind", REWARDS)
@pytest.mark.parametrize("names", STACKS, ids="+".join)
def test_a_step_of_many_worlds_returns_the_rewards_of_compute_reward(names, kind):
    envs = wrapped_vec(16, names, reward_type=kind)
    envs.reset(seed=3)
    for step, actions in enumerate(random_actions(EPISODE, 16)):
        if step == 30:
            half_solved(envs)
        observation, reward, _, _, info = envs.step(actions)
        np.testing.assert_array_equal(reward, envs.compute_reward(*goals(observation), info))
        infos = [{key: info[key][i] for key in info} for i in range(16)]
        np.testing.assert_array_equal(reward, envs.compute_reward(*goals(observation), infos))


@pytest.mark.parametrize(
    "names", [*((name,) for name in GOAL_RULES), tuple(GOAL_RULES)], ids="+".join
)
@pytest.mark.parametrize("info", [None, {}, [{}] * 16])
def test_rewards_that_follow_from_goals_need_no_info(names, info):
    envs = wrapped_vec(16, names)
    envs.reset(seed=0)
    half_solved(envs)
    observation, reward, *_ = envs.step(np.zeros((16, 3)))
    np.testing.assert_array_equal(reward, envs.compute_reward(*goals(observation), info))
    assert len(np.unique(reward)) == 2
    # a goal moved to where the cube is pays as if it had been the goal
    achieved, _ = goals(observation)
    moved = envs.compute_reward(achieved, achieved, info)
    np.testing.assert_array_equal(moved, reward[0])


@pytest.mark.parametrize("name", GOAL_RULES)
def test_rewards_of_goals_are_vectorised_over_leading_axes(name):
    env = wrapped(gym.make(PUSH), [name])
    random = np.random.default_rng(0)
    pairs = random.uniform(-0.06, 0.06, (2, 4, 5, 3)).astype(np.float32)
    rewards = env.compute_reward(*pairs, {})
    assert rewards.shape == (4, 5)
    assert type(env.compute_reward(*pairs[:, 0, 0], {})) is np.float64
    for i in np.ndindex(4, 5):
        assert rewards[i] == env.compute_reward(pairs[0][i], pairs[1][i], {})


@pytest.mark.parametrize("info", [None, {}, [{}] * 16, {"reech": 0.0}])
@pytest.mark.parametrize("name", INFO_RULES)
def test_other_rewards_raise_without_the_info(name, info):
    envs = wrapped_vec(16, [name])
    observation, _ = envs.reset(seed=0)
    with pytest.raises(ValueError, match=rf"{name}.* needs .* in info, the info of the step; got"):
        envs.compute_reward(*goals(observation), info)


@pytest.mark.parametrize("name", ["PotentialShaping", "StagedReward"])
def test_terms_of_one_goal_raise_for_another(name):
    envs = wrapped_vec(4, [name])
    envs.reset(seed=0)
    observation, *_, info = envs.step(np.zeros((4, 3)))
    achieved, desired = goals(observation)
    moved = desired + np.float32([[0], [0], [1e-6], [0]])
    with pytest.raises(ValueError, match=rf"{name}.* only the goals of the step.* HER .*[Rr]emove"):
        envs.compute_reward(achieved, moved, info)


@pytest.mark.parametrize("name", ["ActionPenalty", "SmoothnessPenalty"])
def test_penalties_on_actions_do_not_change_with_the_goal(name):
    envs = wrapped_vec(4, [name])
    envs.reset(seed=0)
    envs.step(np.zeros((4, 3)))
    observation, reward, *_, info = envs.step(np.ones((4, 3)))
    achieved, _ = goals(observation)
    solved = envs.compute_reward(achieved, achieved, info)
    np.testing.assert_allclose(solved, reward + 1.0)  # sparse: 0 in place of -1


def test_stages_of_goals_alone_can_be_relabelled():
    stages = [Stage("distance", -0.4, -0.05), Stage("success", 0, 1)]
    envs = wrappers.vector.StagedReward(make_vec(16), stages)
    envs.reset(seed=0)
    half_solved(envs)
    observation, reward, *_ = envs.step(np.zeros((16, 3)))
    achieved, desired = goals(observation)
    np.testing.assert_array_equal(envs.compute_reward(achieved, desired, [{}] * 16), reward)
    np.testing.assert_array_equal(envs.compute_reward(achieved, achieved, {}), np.zeros(16))


def test_gymnasiums_own_vectors_of_single_environments_relabel_too():
    sync = gym.make_vec(PUSH, num_envs=3, vectorization_mode="sync")
    envs = wrapped(sync, GOAL_RULES, wrappers.vector)
    envs.reset(seed=0)
    for observation, reward, *_ in steps_of(envs, random_actions(20, 3)):
        np.testing.assert_array_equal(reward, envs.compute_reward(*goals(observation), {}))


@pytest.mark.parametrize(
    "between",
    [lambda env: gym.wrappers.TransformReward(env, lambda r: 2 * r), gym.wrappers.NormalizeReward],
)
def test_a_reward_wrapper_of_gymnasium_in_between_raises(between):
    env = wrappers.TimePenalty(between(gym.make(PUSH)), 1.0)
    observation, _ = env.reset(seed=0)
    env.step(np.zeros(3))
    with pytest.raises(ValueError, match=r"Gymnasium's .*Reward; use a wrapper of rigid_envs"):
        env.compute_reward(*goals(observation), {})
    envs = gym.wrappers.vector.TransformReward(make_vec(2), lambda reward: 2 * reward)
    envs = wrappers.vector.TimePenalty(envs, 1.0)
    observation, _ = envs.reset(seed=0)
    with pytest.raises(ValueError, match=r"Gymnasium's TransformReward"):
        envs.compute_reward(*goals(observation), {})
