"""PushT is a fair task: starts and goals, reward terms, and physics that allows it to be solved."""

import numpy as np

from rigid_envs.tasks.coverage import UNIT, uncovered
from rigid_envs.tasks.goals import distance
from rigid_envs.tasks.push_t import (
    FINGER_START,
    GOAL_YAW,
    GYRATION,
    RANGE,
    UNCOVERED,
    UNCOVERED_START,
    PushT,
)
from tests.rigid_envs.rollout import PUSH_T, make_vec, random_actions, steps_of
from training.scripted import controller_for

STEPS = PushT.max_episode_steps


def uncovered_part(observation):
    return distance(observation["achieved_goal"], observation["desired_goal"], uncovered)


def test_starts_cover_little_of_the_goal_and_the_finger_is_clear_of_the_t():
    envs = make_vec(5000, PUSH_T)
    observation, info = envs.reset(seed=0)
    assert not info["is_success"].any()
    assert uncovered_part(observation).min() > UNCOVERED_START - 1e-5
    np.testing.assert_allclose(
        observation["desired_goal"][7], [0.0, 0.0, np.cos(GOAL_YAW), np.sin(GOAL_YAW)], rtol=1e-6
    )
    pose = observation["achieved_goal"].astype(float)
    assert 0.99 * RANGE < np.abs(pose[:, :2]).max() <= RANGE + 1e-6
    yaw = np.arctan2(pose[:, 3], pose[:, 2])
    assert np.abs(np.histogram(yaw, 8, (-np.pi, np.pi))[0] / 5000 - 0.125).max() < 0.03
    finger = observation["observation"][:, :2]
    np.testing.assert_allclose(np.hypot(*(finger - pose[:, :2]).T), FINGER_START, rtol=1e-5)
    assert np.all((finger > PushT.finger.low[:2]) & (finger < PushT.finger.high[:2]))
    for after, *_ in steps_of(envs, np.zeros((3, 5000, 2))):
        assert np.abs(after["achieved_goal"] - pose).max() < 1e-3  # at rest, and not touched


def test_observed_offset_is_in_the_frame_of_the_t():
    observation, _ = make_vec(50, PUSH_T).reset(seed=0)
    values = observation["observation"].astype(float)
    offset = (values[:, 0] + 1j * values[:, 1]) - (values[:, 4] + 1j * values[:, 5])
    turned = offset * (values[:, 6] - 1j * values[:, 7])
    np.testing.assert_allclose(values[:, 11] + 1j * values[:, 12], turned, atol=1e-7)


def test_reward_terms_are_coverage_and_the_distance_of_the_points_of_the_t():
    envs = make_vec(64, PUSH_T, reward_type="dense")
    envs.reset(seed=0)
    observation, reward, _, _, info = envs.step(random_actions(1, 64, size=2)[0])
    weights = PushT.reward.weights
    expected = weights["success"] * info["is_success"] - weights["distance"] * uncovered_part(
        observation
    )
    expected += weights["pose"] * info["pose"] + weights["reach"] * info["reach"]
    np.testing.assert_allclose(reward, expected, rtol=1e-12)
    pose, goal = (observation[f"{k}_goal"].astype(float) for k in ("achieved", "desired"))
    # points at the radius of gyration in four directions have the second moments of the T
    circle = GYRATION * np.exp(0.5j * np.pi * np.arange(4))
    a, b = (
        (p[:, :1] + 1j * p[:, 1:2]) + (p[:, 2:3] + 1j * p[:, 3:]) * circle for p in (pose, goal)
    )
    mean = np.sqrt(np.mean(np.abs(a - b) ** 2, axis=1))
    np.testing.assert_allclose(info["pose"], -mean, rtol=1e-5)


def test_radius_of_gyration_is_that_of_two_rectangles():
    """Of each, (w^2 + h^2) / 12 and the square of its distance from the centre, in units."""
    bar, stem = (16 + 1) / 12 + (6 / 7) ** 2, (1 + 9) / 12 + (8 / 7) ** 2
    np.testing.assert_allclose((GYRATION / UNIT) ** 2, (4 * bar + 3 * stem) / 7, rtol=1e-12)


def test_solved_where_nine_tenths_of_the_goal_are_covered():
    envs = make_vec(41, PUSH_T)
    envs.reset(seed=0)
    world = envs._runner.world
    place = world.position.copy()
    place[:, 0, :2] = np.linspace(0.0, 0.01, 41)[:, None] * (np.cos(0.3), np.sin(0.3))
    turn = np.zeros((41, 1, 4))
    turn[:, 0, 2:] = np.sin(0.5 * GOAL_YAW), np.cos(0.5 * GOAL_YAW)
    far = np.tile([[[-0.2, 0.2, 0.016]]], (41, 1, 1))
    world.set_state(position=place, orientation=turn, drive_position=far)
    observation, *_, info = envs.step(np.zeros((41, 2)))
    assert 5 < info["is_success"].sum() < 36
    np.testing.assert_array_equal(info["is_success"], uncovered_part(observation) <= UNCOVERED)


def test_the_controller_solves_nearly_all_episodes(stress):
    envs = make_vec(300 if stress else 128, PUSH_T)
    observation, info = envs.reset(seed=1)
    for _ in range(STEPS - 1):
        observation, *_, info = envs.step(controller_for(PUSH_T)(observation))
    assert info["is_success"].mean() >= 0.95
