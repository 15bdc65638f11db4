"""PickAndPlace is a fair task: no goal is met by chance, and every goal can be met."""

import numpy as np
import pytest

from physics import World
from rigid_envs.tasks.grasping.hand import Hand
from rigid_envs.tasks.grasping.pick_and_place import (
    HALF,
    HIGHEST,
    MIN_DISTANCE,
    RANGE,
    THRESHOLD,
    PickAndPlace,
)
from tests.rigid_envs.rollout import PICK_AND_PLACE, make, make_vec, steps_of
from training.scripted import controller_for

EPISODE = 50


def solved(envs, steps=EPISODE - 1, seed=0):
    observation, info = envs.reset(seed=seed)
    for _ in range(steps):
        observation, *_, info = envs.step(controller_for(PICK_AND_PLACE)(observation))
    return info["is_success"].mean()


def test_half_of_the_goals_lie_in_the_air_and_none_is_met_at_the_start():
    observation, info = make_vec(5000, PICK_AND_PLACE).reset(seed=0)
    assert not info["is_success"].any()
    goal = observation["desired_goal"].astype(float)
    in_air = goal[:, 2] > HALF + 1e-6
    assert in_air.mean() == pytest.approx(0.45, abs=0.03)  # a tenth of heights are too low
    assert goal[:, 2].min() == pytest.approx(HALF)
    assert goal[:, 2].max() == pytest.approx(HIGHEST, abs=0.002)
    assert np.abs(goal[:, :2]).max() == pytest.approx(RANGE, abs=0.002)
    away = np.linalg.norm(goal - observation["achieved_goal"], axis=1)
    assert MIN_DISTANCE - 1e-6 < away.min() < MIN_DISTANCE + 0.01
    hand = observation["observation"][:, :3]
    np.testing.assert_allclose(observation["observation"][:, 24:27],
                               observation["achieved_goal"] - hand, atol=1e-6)  # fmt: skip


@pytest.mark.parametrize(
    ("fidelity", "least"),
    [("fast", 0.96), ("balanced", 0.995), ("accurate", 0.99), ("solid", 0.99)],
)
def test_a_scripted_controller_carries_the_cube_to_every_goal(fidelity, least):
    count = 400 if fidelity in ("fast", "balanced") else 96
    assert solved(make_vec(count, PICK_AND_PLACE, fidelity=fidelity)) >= least


def test_a_scripted_controller_carries_cubes_of_other_sizes():
    envs = make_vec(128, PICK_AND_PLACE, randomize={"size": (0.8, 1.2), "mass": (0.7, 1.5)})
    observation, _ = envs.reset(seed=0)
    height = observation["achieved_goal"][:, 2]
    assert height.min() == pytest.approx(0.8 * HALF, abs=0.001)
    assert height.max() == pytest.approx(1.2 * HALF, abs=0.001)
    lowest = observation["desired_goal"][:, 2] - height
    assert lowest.min() == pytest.approx(0.0, abs=1e-6)  # on the ground it lies on its face
    assert solved(envs) >= 0.9


def test_a_random_policy_hardly_ever_meets_its_goal():
    envs = make_vec(1000, PICK_AND_PLACE)
    envs.reset(seed=0)
    met = np.zeros(1000, dtype=bool)
    actions = np.random.default_rng(0).uniform(-1, 1, (EPISODE - 1, 1000, 4))
    for *_, info in steps_of(envs, actions):
        met |= info["is_success"]
    assert met.mean() < 0.02


def test_training_can_start_around_the_cube():
    envs = make_vec(500, PICK_AND_PLACE, near_grasp_start_prob=0.5)
    observation, info = envs.reset(seed=0)
    offset = np.abs(observation["observation"][:, 24:27])
    near = offset.max(axis=1) < 0.031
    assert near.mean() == pytest.approx(0.5, abs=0.07)
    assert offset[~near].max(axis=1).min() > 0.1
    assert info["grasp"].mean() < 0.15  # the fingers are open, a few by less than 2.5 mm
    for _ in range(6):  # close the fingers where the cube is between them
        actions = np.zeros((500, 4))
        actions[:, :3] = np.clip(20.0 * observation["observation"][:, 24:27], -1.0, 1.0)
        actions[:, 3] = -1.0
        observation, *_, info = envs.step(actions)
    assert info["grasp"][near].mean() > 0.9
    with pytest.raises(ValueError, match="near_grasp_start_prob"):
        make(PICK_AND_PLACE, near_grasp_start_prob=1.5)


def test_starts_around_a_cube_of_another_size_leave_the_pads_outside():
    rng, task = np.random.default_rng(0), PickAndPlace(near_grasp_start_prob=1.0)
    world = World(task.scene(), "balanced", 400, per_world_parameters=True)
    world.set_parameters(size=rng.uniform(0.5, 1.3, (400, 1)))
    task.start(world, np.ones(400, dtype=bool), rng.random((400, task.draw_count)))
    half = HALF * world.parameters.size[:, :, None]
    between = np.abs(world.drive_position - world.position)
    assert (Hand.PAD + half - between).min(axis=2).max() < 1e-6
    assert world.drive_position[:, :, 2].min() > Hand.PAD


def test_the_dense_reward_leads_to_the_cube_and_to_the_goal():
    env = make(PICK_AND_PLACE, reward_type="dense")
    env.reset(seed=2)
    observation, reward, _, _, info = env.step(env.action_space.sample())
    away = np.linalg.norm(observation["desired_goal"] - observation["achieved_goal"])
    hand = np.linalg.norm(observation["observation"][24:27])
    assert away > THRESHOLD
    assert reward == pytest.approx(-10.0 * away - 5.0 * hand, abs=1e-4)
    assert info["reach"] == pytest.approx(-hand, abs=1e-6)
