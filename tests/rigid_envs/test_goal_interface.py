"""compute_terminated and compute_truncated agree with the steps, as Gymnasium-Robotics asks."""

import gymnasium as gym
import numpy as np
import pytest

from rigid_envs import RigidEnv, wrappers
from tests.rigid_envs.rollout import (
    IDS,
    PUSH,
    make,
    make_vec,
    put_cubes_on_goals,
    random_actions,
    steps_of,
)


def goals(observation):
    return observation["achieved_goal"], observation["desired_goal"]


def wrap(env, space=wrappers):
    return space.TimePenalty(space.ActionPenalty(env, 0.1), 1.0)


def leave_the_bounds(env, worlds=None):
    far = np.array([1.2, 0.0, 0.02])
    env.unwrapped._runner.world.set_state(position=far, worlds=worlds)


@pytest.mark.parametrize("terminate", [False, True])
@pytest.mark.parametrize("wrapped", [False, True])
def test_a_step_agrees_with_both_functions(terminate, wrapped):
    env = make(terminate_on_success=terminate)
    env = wrap(env) if wrapped else env
    env.reset(seed=0)
    seen = set()
    for step, action in enumerate(random_actions(20, 1)[:, 0]):
        if step == 10:
            put_cubes_on_goals(env.unwrapped)
        if step == 19:
            leave_the_bounds(env)
        observation, _, terminated, truncated, info = env.step(action)
        for found, expected in (
            (env.compute_terminated(*goals(observation), info), terminated),
            (env.compute_truncated(*goals(observation), info), truncated),
        ):
            assert type(found) is bool
            assert found == expected
        seen.add((terminated, truncated))
    assert seen == {(False, False), (False, True), (terminate, False)}


@pytest.mark.parametrize(
    ("mode", "wrapped"), [(None, False), (None, True), ("sync", True)]
)  # Gymnasium's own vector of single environments has these functions only in our wrappers
def test_steps_of_many_worlds_agree_with_both_functions(mode, wrapped):
    envs = inner = make_vec(3, terminate_on_success=True, vectorization_mode=mode)
    envs = wrap(inner, wrappers.vector) if wrapped else inner
    envs.reset(seed=0)
    if mode == "sync":
        put_cubes_on_goals(inner.envs[1].unwrapped)
        leave_the_bounds(inner.envs[2])
    else:
        put_cubes_on_goals(inner, np.array([False, True, False]))
        leave_the_bounds(inner, np.array([False, False, True]))
    observation, _, terminated, truncated, info = envs.step(np.zeros((3, 3), dtype=np.float32))
    assert terminated.tolist() == [False, True, False]
    assert truncated.tolist() == [False, False, True]
    infos = [{key: info[key][i] for key in info} for i in range(3)]
    for given in (info, infos):
        found = envs.compute_terminated(*goals(observation), given)
        np.testing.assert_array_equal(found, terminated)
        found = envs.compute_truncated(*goals(observation), given)
        np.testing.assert_array_equal(found, truncated)
        assert found.dtype == bool


@pytest.mark.parametrize("env_id", IDS)
def test_relabelled_goals_terminate_where_they_are_reached(env_id):
    """As HER asks, with leading axes and with empty infos."""
    envs = make_vec(6, env_id, terminate_on_success=True)
    observation, _ = envs.reset(seed=0)
    achieved, desired = (values.reshape(2, 3, -1) for values in goals(observation))
    for info in ({}, None, [{}] * 2, np.array([{}] * 2)):
        assert not envs.compute_terminated(achieved, desired, info).any()
        assert envs.compute_terminated(desired, desired, info).all()
        assert envs.compute_terminated(achieved, desired, info).shape == (2, 3)
        assert not envs.compute_truncated(achieved, desired, info).any()
        assert envs.compute_truncated(achieved, desired, info).shape == (2, 3)
    outside = [{"out_of_bounds": True}, {"out_of_bounds": False}]
    truncated = envs.compute_truncated(achieved, desired, outside)
    assert truncated.tolist() == [[True] * 3, [False] * 3]


def test_the_limit_of_steps_is_not_included():
    env = RigidEnv(max_episode_steps=1)
    env.reset(seed=0)
    observation, _, _, truncated, info = env.step(np.zeros(3))
    assert truncated
    assert not env.compute_truncated(*goals(observation), info)


def test_a_wrapped_environment_without_these_functions_says_so():
    class Foreign(gym.Env):
        observation_space, action_space = make().observation_space, make().action_space

        def compute_reward(self, achieved, desired, info):
            return 0.0

    env = wrappers.ScaleReward(Foreign(), 2.0)
    with pytest.raises(AttributeError, match="Foreign has no method 'compute_terminated'"):
        env.compute_terminated(np.zeros(3), np.zeros(3), {})


def test_wrappers_inside_gym_make_reach_them():
    env = wrap(gym.make(PUSH))
    env.reset(seed=0)
    for observation, _, terminated, truncated, info in steps_of(env, random_actions(5, 1)[:, 0]):
        assert env.compute_terminated(*goals(observation), info) == terminated
        assert env.compute_truncated(*goals(observation), info) == truncated
