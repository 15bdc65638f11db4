"""Environments work in other processes, whatever threads the parent process has run."""

import functools
import multiprocessing

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv
from stable_baselines3.common.vec_env import SubprocVecEnv

from tests.rigid_envs.rollout import (
    IDS,
    PUSH,
    assert_same,
    make,
    make_vec,
    random_actions,
    steps_of,
)

WORKERS = 2
STEPS = {env_id: gym.spec(env_id).max_episode_steps for env_id in IDS}


def makers(env_id):
    """Functions that import the package in the worker, where nothing is registered yet."""
    return [functools.partial(gym.make, f"rigid_envs:{env_id}")] * WORKERS


def actions_of(env_id):
    """Actions for a little more than one episode."""
    size = make(env_id).action_space.shape[0]
    return random_actions(STEPS[env_id] + 5, WORKERS, size=size)


@pytest.fixture(scope="module", autouse=True)
def threads_have_run():
    envs = make_vec(1024, threads=4)
    envs.reset(seed=0)
    for _ in range(5):
        envs.step(envs.action_space.sample())
    return envs


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize(
    "context", [c for c in ("fork", "spawn") if c in multiprocessing.get_all_start_methods()]
)
def test_async_vector_env_returns_what_the_native_one_returns(context, env_id, stress):
    if context == "spawn" and env_id != PUSH and not stress:
        pytest.skip("workers that import the package take 4 s")
    native = make_vec(WORKERS, env_id)
    envs = AsyncVectorEnv(makers(env_id), context=context)
    try:
        assert_same(envs.reset(seed=7), native.reset(seed=7))
        for actions in actions_of(env_id):
            assert_same(envs.step(actions), native.step(actions))
    finally:
        envs.close()


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="needs fork")
def test_many_worlds_run_on_threads_in_a_forked_process(threads_have_run):
    """A fork does not copy the threads of the parent process."""
    actions = random_actions(3, 1024)
    twin = make_vec(1024, threads=4)
    twin.set_state(threads_have_run.get_state())
    expected = [result[1].sum() for result in steps_of(threads_have_run, actions)]
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)

    def work():
        sender.send([result[1].sum() for result in steps_of(twin, actions)])

    process = context.Process(target=work)
    process.start()
    try:
        assert receiver.poll(60), "the forked process hangs"
        assert receiver.recv() == expected
    finally:
        process.kill()
        process.join()


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
@pytest.mark.parametrize("env_id", IDS)
def test_subproc_vec_env_returns_what_the_single_one_returns(env_id, stress):
    *actions_before, last = actions_of(env_id)[: STEPS[env_id]]
    # forked workers need not import the package, which takes 4 s
    forked = "fork" in multiprocessing.get_all_start_methods() and env_id != PUSH and not stress
    envs = SubprocVecEnv(makers(env_id), start_method="fork" if forked else None)
    try:
        envs.seed(7)
        observation = envs.reset()
        alone = make(env_id)
        assert_same({k: v[1] for k, v in observation.items()}, dict(alone.reset(seed=8)[0]))
        for actions in actions_before:
            observation, rewards, dones, infos = envs.step(actions)
            seen, reward, *_, info = alone.step(actions[1])
            assert_same({k: v[1] for k, v in observation.items()}, seen)
            assert rewards[1] == reward
            assert infos[1]["is_success"] == info["is_success"]
            assert not dones.any()
        goals = observation["desired_goal"]
        observation, rewards, dones, infos = envs.step(last)
        assert dones.all()
        for world, info in enumerate(infos):
            assert info["TimeLimit.truncated"]
            np.testing.assert_array_equal(
                info["terminal_observation"]["desired_goal"], goals[world]
            )
        achieved = np.stack([info["terminal_observation"]["achieved_goal"] for info in infos])
        relabelled = envs.env_method("compute_reward", achieved, goals, [{}] * WORKERS)
        np.testing.assert_array_equal(relabelled[0], rewards)
    finally:
        envs.close()
