"""Push is a fair task: nothing is solved by chance, and its physics allows it to be solved."""

import numpy as np
import pytest

from rigid_envs.draws import uniform
from rigid_envs.rewards import distance
from rigid_envs.tasks.push import HALF, RANGE, THRESHOLD, TRIES, Push
from tests.rigid_envs.rollout import EPISODE, PRESETS, PUSH, make_vec, random_actions, steps_of
from training.scripted import CONTROLLERS

CORNERS = HALF * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


def test_no_episode_starts_solved():
    observation, info = make_vec(5000).reset(seed=0)
    assert not info["is_success"].any()
    apart = distance(observation["achieved_goal"], observation["desired_goal"])
    assert apart.min() > THRESHOLD


def test_starts_and_goals_fill_the_square():
    observation, _ = make_vec(5000).reset(seed=0)
    for key in ("achieved_goal", "desired_goal"):
        place = observation[key]
        assert np.abs(place[:, :2]).max() <= RANGE
        assert np.abs(place[:, :2]).max() > 0.99 * RANGE
        np.testing.assert_allclose(place[:, :2].mean(axis=0), 0.0, atol=5 * RANGE / 3**0.5 / 70)
        np.testing.assert_allclose(place[:, 2], HALF, atol=1e-6)


def test_a_goal_lies_apart_even_where_all_that_were_drawn_were_near():
    envs = make_vec(4)
    envs.reset(seed=0)
    corners = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])
    draws = np.concatenate([corners, np.zeros((4, 1)), np.tile(corners, (1, TRIES))], axis=1)
    assert draws.shape[1] == Push.draws
    goals = Push().start(envs._runner.world, np.ones(4, dtype=bool), draws)
    cubes = envs._runner.world.position[:, 0]
    assert distance(goals, cubes).min() > THRESHOLD
    assert np.abs(goals[:, :2]).max() <= RANGE


def test_the_draws_of_an_episode_are_its_start():
    observation, _ = make_vec(10).reset(seed=40)
    draws = uniform(np.arange(40, 50), np.zeros(10, dtype=int), Push.draws)
    expected = RANGE * (2.0 * draws[:, :2] - 1.0)
    np.testing.assert_allclose(observation["achieved_goal"][:, :2], expected, rtol=1e-6)


def test_the_observation_is_what_its_bounds_name():
    envs = make_vec(30)
    envs.reset(seed=0)
    world = envs._runner.world
    for observation, *_ in steps_of(envs, random_actions(40, 30)):
        seen = dict(zip([b[0] for b in Push.bounds], observation["observation"].T, strict=True))
        for i, axis in enumerate("xyz"):
            finger, cube = world.drive_position[:, 0, i], world.position[:, 0, i]
            np.testing.assert_allclose(seen[f"finger {axis}"], finger, atol=1e-6)
            np.testing.assert_allclose(seen[f"cube {axis}"], cube, atol=1e-6)
            np.testing.assert_allclose(seen[f"finger to cube {axis}"], cube - finger, atol=1e-6)
            velocity = world.linear_velocity[:, 0, i]
            np.testing.assert_allclose(seen[f"cube velocity {axis}"], velocity, atol=1e-5)
        assert (seen["cube quaternion w"] >= 0.0).all()
        np.testing.assert_array_equal(
            observation["achieved_goal"], observation["observation"][:, 6:9]
        )


def test_a_full_action_moves_the_finger_by_five_centimetres():
    envs = make_vec(2)
    envs.reset(seed=0)
    action = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    seen = [result[0]["observation"][:, :3] for result in steps_of(envs, np.stack([action] * 4))]
    moved = np.diff(seen, axis=0)[1:]  # the first step spends some of it on getting up to speed
    np.testing.assert_allclose(moved, np.broadcast_to(0.05 * action, moved.shape), atol=0.01)


def lowest_point(observation):
    """[n] m, of the cube's corners."""
    x, y, z, w = observation["observation"][:, 9:13].T
    up = np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], -1)
    return observation["observation"][:, 8] + (up @ CORNERS.T).min(axis=1)


@pytest.mark.parametrize("fidelity", PRESETS)
def test_blind_steps_stay_physical(fidelity, stress):
    """200,000 random and bang-bang actions, and a million under stress."""
    envs = make_vec(1024, fidelity=fidelity)
    envs.reset(seed=0)
    world = envs._runner.world
    most = 0.0
    for observation, *_, info in steps_of(envs, random_actions(1000 if stress else 200, 1024)):
        inside = ~info["out_of_bounds"]
        assert all(np.isfinite(values).all() for values in observation.values())
        energy = world.kinetic_energy() + world.potential_energy()
        most = max(most, float(energy[inside].max()))
        # a finger that rams the cube presses it in by its speed times the step, and then it's out
        assert lowest_point(observation)[inside].min() > {"fast": -0.015}.get(fidelity, -0.01)
        assert np.abs(world.position[inside]).max() <= 1.0
    # a finger at 2.2 m/s, twice over, is what an elastic blow could give: 0.97 J
    assert 0.02 < most < 0.97


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_random_policy_hardly_ever_solves_it(fidelity):
    envs = make_vec(1000, fidelity=fidelity)
    envs.reset(seed=0)
    random = np.random.default_rng(0)
    for actions in random.uniform(-1.0, 1.0, (EPISODE, 1000, 3)):
        _, _, _, truncated, info = envs.step(actions)
    assert truncated.all()
    assert info["is_success"].mean() < 0.02


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_scripted_controller_solves_it(fidelity):
    envs = make_vec(1000, fidelity=fidelity)
    observation, _ = envs.reset(seed=0)
    for _ in range(EPISODE):
        observation, _, _, truncated, info = envs.step(CONTROLLERS[PUSH](observation))
    assert truncated.all()
    assert info["is_success"].mean() >= 0.99
