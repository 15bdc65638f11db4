"""Throw is a fair task: nothing is solved by chance, and its physics allows it to be solved."""

import numpy as np
import pytest

from physics import PRESETS as FIDELITIES
from rigid_envs import RigidEnv, Runner
from rigid_envs.tasks.grasping import hand
from rigid_envs.tasks.throw import (
    GRAVITY,
    MAX_TARGET_ANGLE,
    MAX_TARGET_DISTANCE,
    MIN_TARGET_DISTANCE,
    RADIUS,
    Throw,
)
from tests.rigid_envs.rollout import PRESETS, THROW, make_vec, steps_of
from training.scripted import controller_for

EPISODE = 50
HOLD, DROP = np.array([0.0, 0.0, 0.0, -1.0]), np.array([0.0, 0.0, 0.0, 1.0])
# s, of the presets' substeps
STEPS = {name: fidelity.substep for name, fidelity in FIDELITIES.items()}


def test_targets_are_out_of_reach_and_none_is_solved_at_the_start():
    observation, info = make_vec(5000, THROW).reset(seed=0)
    assert not info["is_success"].any()
    goal = observation["desired_goal"].astype(float)
    far = np.hypot(goal[:, 0], goal[:, 1])
    assert MIN_TARGET_DISTANCE - 1e-6 <= far.min() < MIN_TARGET_DISTANCE + 0.01
    assert MAX_TARGET_DISTANCE - 0.01 < far.max() <= MAX_TARGET_DISTANCE + 1e-6
    assert np.abs(np.arctan2(goal[:, 1], goal[:, 0])).max() <= MAX_TARGET_ANGLE + 1e-6
    assert far.min() > np.hypot(*Throw.hand.high[:2]) + 0.1
    # as many in the outer half of the area as in the inner one
    middle = np.sqrt(0.5 * (MIN_TARGET_DISTANCE**2 + MAX_TARGET_DISTANCE**2))
    assert abs((far > middle).mean() - 0.5) < 0.03


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_ball_that_is_held_stays_and_does_not_creep(fidelity):
    envs = make_vec(1, THROW, fidelity=fidelity, max_episode_steps=-1)
    envs.reset(seed=0)
    places = []
    for observation, *_, info in steps_of(envs, np.tile(HOLD, (300, 1, 1))):
        places.append(observation["observation"][0, 17:20].astype(float))
        assert not info["landed"].any()
    assert np.abs(places[0]).max() < 0.01
    assert np.abs(places[-1] - places[50]).max() < 1e-4  # 10 s


@pytest.mark.parametrize("fidelity", PRESETS)
def test_the_first_touch_counts_and_not_where_the_ball_rolls(fidelity):
    envs = make_vec(8, THROW, fidelity=fidelity, max_episode_steps=-1)
    envs.reset(seed=0)
    swing = np.tile([0.3, 0.1, 0.0, -1.0], (5, 8, 1))
    letting_go = np.tile([0.3, 0.1, 0.0, 1.0], (2, 8, 1))
    waiting = np.tile(DROP, (30, 8, 1))
    flight = landed = None
    for observation, *_, info in steps_of(envs, np.concatenate([swing, letting_go, waiting])):
        now = observation["achieved_goal"].astype(float)
        if not info["landed"].any():
            ball = observation["observation"][:, 11:17].astype(float)
            flight = ball[:, :3], ball[:, 3:]
        elif landed is None:
            landed = now
        else:
            np.testing.assert_array_equal(now, landed)
    # closed form from the last frame in free flight, to the substep in which it touched
    place, speed = flight
    rise = speed[:, 2]
    time = (rise + np.sqrt(rise**2 + 2.0 * GRAVITY * (place[:, 2] - RADIUS))) / GRAVITY
    expected = place[:, :2] + time[:, None] * speed[:, :2]
    fastest = np.linalg.norm(speed[:, :2], axis=1).max()
    assert fastest > 0.5
    assert np.abs(landed[:, :2] - expected).max() < 1.5 * STEPS[fidelity] * fastest
    ball = envs._runner.world.position[:, 0]
    assert np.linalg.norm(ball - landed, axis=1).min() > 0.02  # it rolled on


def test_aim_is_the_error_of_a_ball_released_now():
    envs = make_vec(16, THROW, reward_type="dense", max_episode_steps=-1)
    observation, info = envs.reset(seed=3)
    free = np.zeros(16, dtype=bool)
    for _ in range(EPISODE):
        before = info["aim"]
        observation, _, _, _, info = envs.step(controller_for(THROW)(observation))
        # flight changes nothing of where it lands
        np.testing.assert_allclose(info["aim"][free], before[free], atol=0.01)
        ball, hand = observation["observation"][:, 11:14], observation["observation"][:, :3]
        free = np.linalg.norm(ball - hand, axis=1) > 0.1
    apart = np.linalg.norm(observation["achieved_goal"] - observation["desired_goal"], axis=1)
    np.testing.assert_allclose(-info["aim"], apart, atol=0.01)


def test_a_ball_that_is_held_without_any_motion_in_the_hand_stays_finite():
    """Its velocity relative to the fingers is exactly zero, and round-off is all that is left."""
    ball = {"mass": 4.7102496147336135, "friction": 6.8884214787092475,
            "restitution": 0.8498830323192847, "size": 0.6149256865201029}  # fmt: skip
    runner = Runner("throw", 1, fidelity="accurate", randomize=ball)
    runner.reset(np.ones(1, dtype=bool), np.array([1266]))
    for _ in range(8):
        runner.step(np.array([[-1.0, 1.0, -1.0, -1.0]]))
    assert np.isfinite(runner.world.position).all()


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_scripted_controller_hits(fidelity, stress):
    """1,000 seeds; 400 at fast and balanced and 128 else, except with `make stress`."""
    worlds = 1000 if stress else 400 if fidelity in ("fast", "balanced") else 128
    envs = make_vec(worlds, THROW, fidelity=fidelity)
    observation, _ = envs.reset(seed=0)
    for _ in range(EPISODE):
        observation, _, _, truncated, info = envs.step(controller_for(THROW)(observation))
    assert truncated.all()
    assert info["is_success"].mean() >= 0.95


def test_the_grasp_is_found_with_the_kind_of_kernel_that_the_worlds_have(monkeypatch):
    """Another kind would be compiled for it alone, which takes as long as that of the task."""
    made = []

    class Noted(hand.World):
        def __init__(self, *arguments, **kwargs):
            super().__init__(*arguments, **kwargs)
            made.append(self.kernel)

    monkeypatch.setattr(hand, "World", Noted)
    for kernel in ("general", "special"):
        RigidEnv("throw", kernel=kernel).reset(seed=0)
    assert made == ["general", "special"]
