"""Potential shaping adds the same to every return from a state: optimal policies stay the same."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from rigid_envs import wrappers
from rigid_envs.wrappers import goal_potential
from tests.rigid_envs.rollout import (
    EPISODE,
    PUSH,
    make_vec,
    push_blindly,
    put_cubes_on_goals,
    random_actions,
)

GAMMAS = [0.0, 0.9, 1.0]
MODES = list(AutoresetMode)


def bumpy(observation):
    """A potential of the whole observation, much larger than the reward."""
    return 50.0 * np.sin(40.0 * observation["observation"].astype(float)).sum(axis=-1)


def returns(env, gamma, actions):
    """Discounted return, first and last observation, whether that was terminal."""
    first, _ = env.reset(seed=4)
    total = 0.0
    for step, action in enumerate(actions):
        last, reward, terminated, truncated, _ = env.step(action)
        total += gamma**step * reward
        if terminated or truncated:
            break
    return total, first, last, terminated


@pytest.mark.parametrize("gamma", GAMMAS)
@pytest.mark.parametrize("potential", [goal_potential, bumpy])
@pytest.mark.parametrize("steps", [1, 7, EPISODE])  # an episode cut short, or truncated
def test_returns_differ_by_the_potentials_of_both_ends_for_any_policy(potential, gamma, steps):
    for seed in range(4):
        actions = random_actions(steps, 1, seed)[:, 0]
        plain = returns(gym.make(PUSH, reward_type="dense"), gamma, actions)
        env = wrappers.PotentialShaping(gym.make(PUSH, reward_type="dense"), potential, gamma)
        total, first, last, terminated = returns(env, gamma, actions)
        assert not terminated
        gained = gamma**steps * potential(last) - potential(first)
        assert total - plain[0] == pytest.approx(gained, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("gamma", GAMMAS)
def test_a_terminal_state_has_no_potential(gamma):
    kwargs = {"terminate_on_success": True}
    env = wrappers.PotentialShaping(gym.make(PUSH, **kwargs), bumpy, gamma)
    before, _ = env.reset(seed=0)
    put_cubes_on_goals(env.unwrapped)
    _, reward, terminated, _, info = env.step(np.zeros(3))
    assert terminated
    assert reward == info["shaping"] == -bumpy(before)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("terminate", [False, True])
def test_shaping_never_reaches_across_episodes(mode, terminate):
    """The shaping of each episode of a vector environment telescopes."""
    worlds, gamma = 6, 0.9
    envs = wrappers.vector.PotentialShaping(
        make_vec(worlds, autoreset_mode=mode, terminate_on_success=terminate), bumpy, gamma
    )
    noise = random_actions(130, worlds)
    observation, _ = envs.reset(seed=0)
    start, total, length = bumpy(observation), np.zeros(worlds), np.zeros(worlds, dtype=int)
    started, episodes = np.zeros(worlds, dtype=bool), 0
    for step in range(130):
        if step in (20, 50, 51, 90):
            put_cubes_on_goals(envs.unwrapped, np.arange(worlds) % 3 == step % 3)
        observation, reward, terminated, truncated, info = envs.step(
            push_blindly(observation, noise[step])
        )
        ended, after = terminated | truncated, bumpy(observation)
        final = info.get("final_info", {})
        shaping = info.get("shaping", np.zeros(worlds))
        for i in range(worlds):
            if started[i]:  # NEXT_STEP: this step was the reset
                assert reward[i] == 0.0
                assert "_shaping" not in info or not info["_shaping"][i]
                start[i], total[i], length[i] = after[i], 0.0, 0
                continue
            replaced = mode is AutoresetMode.SAME_STEP and ended[i]
            paid = final["shaping"][i] if replaced else shaping[i]
            total[i] += gamma ** length[i] * paid
            length[i] += 1
            if ended[i]:
                episodes += 1
                last = bumpy(info["final_obs"][i]) if replaced else after[i]
                gained = (0.0 if terminated[i] else gamma ** length[i] * last) - start[i]
                assert total[i] == pytest.approx(gained, rel=1e-9, abs=1e-9)
                start[i], total[i], length[i] = after[i], 0.0, 0
        if mode is AutoresetMode.NEXT_STEP:
            started = ended
        if mode is AutoresetMode.DISABLED and ended.any():
            observation, _ = envs.reset(options={"reset_mask": ended.copy()})
            start = np.where(ended, bumpy(observation), start)
    assert episodes >= 2 * worlds


def test_a_reset_of_some_worlds_leaves_the_others_shaping_alone():
    kwargs = {"autoreset_mode": AutoresetMode.DISABLED}
    envs, alone = (
        wrappers.vector.PotentialShaping(make_vec(4, **kwargs), bumpy, 0.9) for _ in range(2)
    )
    for one in (envs, alone):
        one.reset(seed=0)
        one.step(np.ones((4, 3)))
    mask = np.array([True, False, True, False])
    observation, _ = envs.reset(options={"reset_mask": mask})
    ours, theirs = envs.step(np.ones((4, 3))), alone.step(np.ones((4, 3)))
    np.testing.assert_array_equal(ours[1][~mask], theirs[1][~mask])
    expected = 0.9 * bumpy(ours[0]) - bumpy(observation)
    np.testing.assert_array_equal(ours[4]["shaping"][mask], expected[mask])


@pytest.mark.parametrize("mode", MODES)
def test_a_reset_between_the_end_and_the_next_step_starts_a_shaped_episode(mode):
    envs = wrappers.vector.PotentialShaping(
        make_vec(3, autoreset_mode=mode, max_episode_steps=2), bumpy, 0.9
    )
    envs.reset(seed=0)
    for _ in range(2):
        truncated = envs.step(np.zeros((3, 3)))[3]
    assert truncated.all()
    before, _ = envs.reset(seed=1)
    after, _, _, _, info = envs.step(np.ones((3, 3)))
    np.testing.assert_array_equal(info["shaping"], 0.9 * bumpy(after) - bumpy(before))
