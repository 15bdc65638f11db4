"""Slide is a fair task: goals are out of reach, and its physics allows it to be solved."""

import numpy as np
import pytest

from rigid_envs.tasks.finger import Finger
from rigid_envs.tasks.slide import (
    FRICTION,
    GRAVITY,
    MAX_GOAL_ANGLE,
    MAX_GOAL_DISTANCE,
    MIN_GOAL_DISTANCE,
    RADIUS,
    START,
    THRESHOLD,
    Slide,
)
from tests.rigid_envs.rollout import EPISODE, SLIDE, make_vec, steps_of
from training.scripted import controller_for


def test_goals_are_out_of_reach_and_none_is_solved_at_the_start():
    observation, info = make_vec(5000, SLIDE).reset(seed=0)
    assert not info["is_success"].any()
    goal = observation["desired_goal"].astype(float)
    far = np.hypot(goal[:, 0], goal[:, 1])
    assert MIN_GOAL_DISTANCE - 1e-6 <= far.min() < MIN_GOAL_DISTANCE + 0.01
    assert MAX_GOAL_DISTANCE - 0.01 < far.max() <= MAX_GOAL_DISTANCE + 1e-6
    assert np.abs(np.arctan2(goal[:, 1], goal[:, 0])).max() <= MAX_GOAL_ANGLE + 1e-6
    # a puck that the finger touches is within 4 cm of it
    assert goal[:, 0].min() > Slide.finger.high[0] + 0.04 + THRESHOLD
    puck = observation["achieved_goal"].astype(float)
    assert START - 0.001 < np.abs(puck[:, :2]).max() <= START + 1e-6
    # as many in the outer half of the area as in the inner one
    middle = np.sqrt(0.5 * (MIN_GOAL_DISTANCE**2 + MAX_GOAL_DISTANCE**2))
    assert abs((far > middle).mean() - 0.5) < 0.03


def test_the_finger_does_not_touch_the_largest_puck_at_the_start():
    envs = make_vec(500, SLIDE, randomize={"size": Slide.size_range[1:] * 2})
    first, _ = envs.reset(seed=0)
    for observation, *_ in steps_of(envs, np.zeros((10, 500, 3))):
        moved = observation["achieved_goal"] - first["achieved_goal"]
        assert np.abs(moved).max() < 1e-3


@pytest.mark.parametrize("friction", [FRICTION, 4.0 * FRICTION])
def test_a_puck_stops_where_friction_lets_it_and_aim_tells_where(friction):
    """Coulomb's law: v^2 / (2 mu g). Aim knows the friction of each world."""
    options = {} if friction == FRICTION else {"randomize": {"friction": (friction, friction)}}
    envs = make_vec(16, SLIDE, reward_type="dense", max_episode_steps=-1, **options)
    envs.reset(seed=3)
    world, angle = envs._runner.world, np.linspace(-0.4, 0.4, 16)
    speed = np.linspace(0.6, 1.2, 16)
    velocity = speed[:, None] * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    world.set_state(linear_velocity=velocity[:, None])
    start, aims = world.position[:, 0].copy(), []
    for _ in range(60):
        observation, *_, info = envs.step(np.zeros((16, 3)))
        aims.append(info["aim"])
    far = np.linalg.norm(observation["achieved_goal"] - start, axis=1)
    mu = np.sqrt(FRICTION * friction)  # the ground keeps its own
    np.testing.assert_allclose(far, speed**2 / (2.0 * mu * GRAVITY), rtol=3e-3)
    stopped = -np.linalg.norm(observation["achieved_goal"] - observation["desired_goal"], axis=1)
    np.testing.assert_allclose(aims, np.tile(stopped, (60, 1)), atol=2e-3)


def test_reach_counts_until_the_puck_has_left_the_workspace():
    envs = make_vec(4, SLIDE, reward_type="dense")
    envs.reset(seed=0)
    world = envs._runner.world
    place = world.position.copy()
    place[:2, 0, 0] = Slide.finger.high[0] + 0.1
    world.set_state(position=place)
    info = envs.step(np.zeros((4, 3)))[-1]
    assert (info["reach"] == 0.0).tolist() == [True, True, False, False]


def test_reach_leads_behind_the_puck_whatever_its_size_and_is_finite_at_the_goal():
    envs = make_vec(4, SLIDE, reward_type="dense", randomize={"size": (0.8, 1.2)})
    envs.reset(seed=0)
    runner = envs._runner
    world, task = runner.world, runner.task
    puck, size = world.position[:, 0], world.parameters.size[:, 0]
    goal = puck + np.array([0.6, 0.0, 0.0])
    finger = puck - np.outer(RADIUS * size + Finger.RADIUS, (1.0, 0.0, 0.0))
    world.set_state(drive_position=finger[:, None])
    far = task.terms(world, world.read(), puck, goal, np.full(4, 0.6))
    np.testing.assert_allclose(far["reach"], 0.0, atol=1e-6)
    there = task.terms(world, world.read(), puck, puck, np.zeros(4))
    np.testing.assert_allclose(there["reach"], -(RADIUS * size + Finger.RADIUS), rtol=1e-5)


def test_the_controller_solves_nearly_all_episodes():
    envs = make_vec(500, SLIDE)
    observation, info = envs.reset(seed=1)
    for _ in range(EPISODE - 1):
        observation, *_, info = envs.step(controller_for(SLIDE)(observation))
    assert info["is_success"].mean() >= 0.95
