"""Twins have spaces, starts, rewards and ends of episodes of their originals, as recorded there."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from scipy.stats import ks_2samp
from stable_baselines3.common.env_checker import check_env as check_for_sb3

from benchmarks.twins.recordings import load_starts
from rigid_envs.twins import TWINS

NAMES = {twin.__name__: twin for twin in TWINS.values()}
# of all components of all twins together, by Holm's method; the draws below are fixed
SIGNIFICANCE = 0.01


@pytest.fixture(params=NAMES)
def twin(request):
    return NAMES[request.param]


def made(twin, dense="", **arguments):
    return gym.make(f"RigidEnvs/{twin.__name__}{dense}-v0", **arguments)


def test_spaces_and_lengths_are_those_of_the_original(twin):
    recorded = load_starts(twin.original).description
    env = made(twin)
    spaces = {**env.observation_space.spaces, "action": env.action_space}
    assert set(spaces) == set(recorded["spaces"])
    for name, space in spaces.items():
        there = recorded["spaces"][name]
        assert list(space.shape) == there["shape"], name
        assert str(space.dtype) == there["dtype"], name
        assert (space.low.min(), space.high.max()) == (there["low"], there["high"]), name
        assert np.all(space.low == space.low.min())
        assert np.all(space.high == space.high.max())
    assert env.spec.max_episode_steps == recorded["max_episode_steps"]


def test_starts_and_goals_have_the_distributions_of_the_original():
    found = []
    for twin in TWINS.values():
        there = load_starts(twin.original)
        envs = gym.make_vec(f"RigidEnvs/{twin.__name__}-v0", num_envs=len(there.observation))
        here, _ = envs.reset(seed=0)
        envs.close()
        for key in ("observation", "desired_goal"):
            # many goals have one height, which differs by round-off
            a, b = (x.astype(float).round(5) for x in (here[key], getattr(there, key)))
            spread = np.ptp(b, axis=0)
            constant = spread < 1e-4
            # what doesn't vary is the same; but Fetch's fingers and FetchSlide's puck move a bit
            names = [name for name, *_ in twin.bounds]
            moving = [
                key == "observation" and twin.original.startswith("Fetch")
                and any(part in name for part in ("finger", "rotation", "angular"))
                for name in names[: a.shape[1]]
            ]  # fmt: skip
            same = np.abs(a - b).max(axis=0) < np.where(moving, 0.02, 1e-4)
            assert same[constant].all(), (twin.original, key)
            for c in np.flatnonzero(~constant):
                found.append((ks_2samp(a[:, c], b[:, c]).pvalue, twin.original, key, c))
                assert np.ptp(a[:, c]) == pytest.approx(spread[c], rel=0.1), found[-1]
    for rank, (p, *what) in enumerate(sorted(found)):
        assert p > SIGNIFICANCE / (len(found) - rank), what
    assert len(found) > 40


def test_rewards_are_those_of_the_original(twin):
    rng = np.random.default_rng(0)
    size = len(twin.goal_bounds)
    achieved, desired = 0.07 * rng.normal(size=(2, 200, size))
    distance = np.linalg.norm(achieved - desired, axis=1)
    sparse, dense = made(twin).unwrapped, made(twin, "Dense").unwrapped
    reward = sparse.compute_reward(achieved, desired, {})
    assert np.array_equal(reward, -(distance > twin.threshold).astype(float))
    assert {-1.0, 0.0} == set(reward)
    assert dense.compute_reward(achieved, desired, {}) == pytest.approx(-distance, rel=1e-12)


def test_success_ends_an_episode_where_it_does_there(twin):
    env = made(twin).unwrapped
    goal = np.zeros(len(twin.goal_bounds))
    ends = twin.original.startswith("Panda")
    assert env.compute_terminated(goal, goal, {}) is ends
    assert env.compute_terminated(goal, goal + 1.0, {}) is False
    env.reset(seed=0)
    for _ in range(3):
        step = env.step(env.action_space.sample())
        assert step[2] == (ends and step[4]["is_success"])


def test_nothing_is_clipped_where_bodies_leave_the_bounds():
    env = gym.make("RigidEnvs/PandaPush-v0").unwrapped
    env.reset(seed=0)
    world = env._runner.world
    world.set_state(linear_velocity=[[[0.0, 0.0, 20.0]]], angular_velocity=[[[30.0, 0.0, 0.0]]])
    env._runner._now = world.read()
    observation, *_, truncated, info = env.step(np.zeros(3))
    assert observation["observation"][14] > 15.0
    assert observation["observation"][15] == pytest.approx(30.0, abs=1.0)
    assert not truncated
    assert not info["out_of_bounds"]


# infinite bounds are the originals'
@pytest.mark.filterwarnings("ignore:.*A Box observation space.*(low|high) is (-)?infinity")
@pytest.mark.filterwarnings("ignore:.*Box (low|high)'s precision lowered")
def test_the_checkers_of_gymnasium_and_stable_baselines_pass(twin):
    check_env(made(twin, disable_env_checker=True).unwrapped, skip_render_check=True)
    check_for_sb3(made(twin).unwrapped, warn=False)


def test_worlds_of_a_vector_environment_are_single_environments(twin):
    name = f"RigidEnvs/{twin.__name__}-v0"
    envs, single = gym.make_vec(name, num_envs=3), gym.make(name)
    many, _ = envs.reset(seed=7)
    one, _ = single.reset(seed=9)
    actions = np.random.default_rng(0).uniform(-1, 1, (12, *single.action_space.shape))
    for action in actions:
        many, *_ = envs.step(np.tile(action, (3, 1)))
        one, *_ = single.step(action)
    for key, values in one.items():
        assert np.array_equal(values, many[key][2]), key
    assert many["observation"].dtype == twin.dtype
    envs.close()


@pytest.mark.parametrize("name", ["FetchPush", "PandaPush"])
def test_attributes_that_scripts_read_and_set(name):
    """As scripts for the originals do: the threshold counts from then on."""
    env = gym.make(f"RigidEnvs/{name}-v0").unwrapped
    observation, _ = env.reset(seed=0)
    np.testing.assert_array_equal(env.goal, observation["desired_goal"])
    assert env.distance_threshold == env.task.distance_threshold == 0.05
    goal = np.zeros(3)
    reward = env.compute_reward(np.array([0.03, 0.0, 0.0]), goal, {})
    assert (reward == 0).astype(np.float32) == 1.0
    env.task.distance_threshold = 0.01
    assert env.distance_threshold == 0.01
    assert env.compute_reward(np.array([0.03, 0.0, 0.0]), goal, {}) == -1.0
    env.distance_threshold = 10.0
    _, reward, terminated, _, info = env.step(env.action_space.sample())
    assert reward == 0.0
    assert info["is_success"]
    assert terminated == (name == "PandaPush")
    with pytest.raises(ValueError, match=r"distance_threshold must be .*, got -1"):
        env.distance_threshold = -1.0
