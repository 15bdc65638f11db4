"""The reward is one function for steps and for relabelled goals."""

import numpy as np
import pytest

from rigid_envs.rewards import Reward, distance
from tests.rigid_envs.rollout import REWARDS, make, make_vec, random_actions, steps_of

REWARD = Reward(threshold=0.05, weights={"success": 1.0, "distance": 10.0, "reach": 0.3})
ORIGIN = np.zeros(3, dtype=np.float32)


def goals(*shape: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of goals, some of them within the threshold."""
    random = np.random.default_rng(0)
    return tuple(random.uniform(-0.06, 0.06, (*shape, 3)).astype(np.float32) for _ in range(2))


@pytest.mark.parametrize(("apart", "reward"), [(0.0, 0.0), (0.0499, 0.0), (0.0501, -1.0)])
def test_sparse_reward_is_zero_within_the_threshold_and_minus_one_beyond(apart, reward):
    goal = np.array([0.0, apart, 0.0], dtype=np.float32)
    assert REWARD.compute("sparse", ORIGIN, goal, {}) == reward


def test_dense_reward_is_the_sum_of_weighted_terms():
    near = np.array([0.03, 0.0, 0.04], dtype=np.float32)
    far = np.array([0.3, 0.0, 0.4], dtype=np.float32)
    assert REWARD.compute("dense", far, ORIGIN, {"reach": -2.0}) == pytest.approx(-5.0 - 0.6)
    assert REWARD.compute("dense", 0.9 * near, ORIGIN, {"reach": 1.0}) == pytest.approx(0.85)


def test_goals_are_as_far_apart_as_their_farthest_points():
    one, other = np.zeros((1, 7)), np.array([[0.03, 0.0, 0.04, 0.0, 0.06, 0.08, 0.02]])
    assert distance(one, other)[0] == pytest.approx(0.1)
    other[0, 6] = -1.0  # what is left over is a point of one component
    assert distance(one, other)[0] == 1.0
    other[0, 1] = np.nan
    assert np.isnan(distance(one, other)[0])


def test_distance_of_a_row_does_not_depend_on_how_many_rows_there_are():
    achieved, desired = goals(1000)
    alone = [distance(a, d) for a, d in zip(achieved, desired, strict=True)]
    np.testing.assert_array_equal(distance(achieved, desired), alone)


@pytest.mark.parametrize("kind", REWARDS)
@pytest.mark.parametrize("shape", [(7,), (4, 5), (2, 3, 4)])
def test_rewards_are_vectorised_over_leading_axes(kind, shape):
    achieved, desired = goals(*shape)
    terms = np.random.default_rng(1).uniform(-1.0, 0.0, shape)
    rewards = REWARD.compute(kind, achieved, desired, {"reach": terms})
    assert rewards.shape == shape
    for index in np.ndindex(shape):
        info = {"reach": terms[index]}
        assert rewards[index] == REWARD.compute(kind, achieved[index], desired[index], info)


def test_the_reward_of_one_pair_of_goals_is_a_python_float():
    assert type(REWARD.compute("sparse", ORIGIN, ORIGIN, {})) is float
    assert type(REWARD.compute("dense", ORIGIN, ORIGIN, {"reach": 0.0})) is float


@pytest.mark.parametrize("info", [None, {}, [{}] * 7, np.array([{}] * 7), {"reach": np.nan}])
def test_sparse_reward_does_not_look_at_the_info(info):
    achieved, desired = goals(7)
    np.testing.assert_array_equal(
        REWARD.compute("sparse", achieved, desired, info),
        np.where(distance(achieved, desired) <= 0.05, 0.0, -1.0),
    )


def test_dense_reward_takes_a_dict_of_arrays_or_a_dict_for_each():
    achieved, desired = goals(7)
    terms = np.linspace(-1.0, 0.0, 7)
    np.testing.assert_array_equal(
        REWARD.compute("dense", achieved, desired, [{"reach": x} for x in terms]),
        REWARD.compute("dense", achieved, desired, {"reach": terms}),
    )


@pytest.mark.parametrize("info", [None, {}, [{}] * 7, np.array([{}] * 7), {"reech": 0.0}])
def test_dense_reward_without_its_terms_names_them_and_the_way_out(info):
    with pytest.raises(ValueError, match=r"\['reach'\].*HER.*reward_type=\"sparse\""):
        REWARD.compute("dense", *goals(7), info)


@pytest.mark.parametrize("kind", REWARDS)
def test_goals_of_different_shape_are_refused(kind):
    with pytest.raises(ValueError, match=r"same shape, got \(2, 3\) and \(3,\)"):
        REWARD.compute(kind, np.zeros((2, 3)), ORIGIN, {"reach": 0.0})


@pytest.mark.parametrize("kind", REWARDS)
def test_a_step_pays_what_compute_reward_says_of_what_it_returns(kind):
    env = make(reward_type=kind)
    env.reset(seed=3)
    for observation, reward, _, _, info in steps_of(env, random_actions(50, 1)[:, 0]):
        told = {} if kind == "sparse" else info
        achieved, desired = observation["achieved_goal"], observation["desired_goal"]
        assert type(reward) is float
        assert reward == env.compute_reward(achieved, desired, told)


@pytest.mark.parametrize("kind", REWARDS)
def test_a_step_of_many_worlds_pays_what_compute_reward_says(kind):
    envs = make_vec(64, reward_type=kind)
    envs.reset(seed=3)
    for observation, reward, _, _, info in steps_of(envs, random_actions(50, 64)):
        told = {} if kind == "sparse" else info
        achieved, desired = observation["achieved_goal"], observation["desired_goal"]
        np.testing.assert_array_equal(reward, envs.compute_reward(achieved, desired, told))
        np.testing.assert_array_equal(info["is_success"], distance(achieved, desired) <= 0.05)
