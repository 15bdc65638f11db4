"""The reward is one function for steps and for relabelled goals."""

import numpy as np
import pytest

from rigid_envs.tasks.rewards import Reward, distance
from tests.rigid_envs.rollout import (
    IDS,
    PUSH,
    REACH,
    REWARDS,
    STACK,
    THROW,
    make,
    make_vec,
    random_actions,
    steps_of,
)

# the reward of Reach follows from the goals alone
WITH_TERMS = [env_id for env_id in IDS if env_id != REACH]
REWARD = Reward(threshold=0.05, weights={"success": 1.0, "distance": 10.0, "reach": 0.3})
ORIGIN = np.zeros(3, dtype=np.float32)


def goals(*shape: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of goals, some of them within the threshold."""
    random = np.random.default_rng(0)
    return tuple(random.uniform(-0.06, 0.06, (*shape, 3)).astype(np.float32) for _ in range(2))


def info_of(achieved, desired, reach):
    """The info of a step that ends with these goals."""
    return {"reach": reach, "step_goals": np.concatenate([achieved, desired], axis=-1)}


@pytest.mark.parametrize(("goal_distance", "reward"), [(0.0, 0.0), (0.0499, 0.0), (0.0501, -1.0)])
def test_sparse_reward_is_zero_within_the_threshold_and_minus_one_beyond(goal_distance, reward):
    goal = np.array([0.0, goal_distance, 0.0], dtype=np.float32)
    assert REWARD.compute("sparse", ORIGIN, goal, {}) == reward


def test_dense_reward_is_the_sum_of_weighted_terms():
    near = np.array([0.03, 0.0, 0.04], dtype=np.float32)
    far = np.array([0.3, 0.0, 0.4], dtype=np.float32)
    info = info_of(far, ORIGIN, -2.0)
    assert REWARD.compute("dense", far, ORIGIN, info) == pytest.approx(-5.0 - 0.6)
    near *= 0.9
    assert REWARD.compute("dense", near, ORIGIN, info_of(near, ORIGIN, 1.0)) == pytest.approx(0.85)


def test_goal_distance_is_the_largest_distance_of_their_points():
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
    rewards = REWARD.compute(kind, achieved, desired, info_of(achieved, desired, terms))
    assert rewards.shape == shape
    for index in np.ndindex(shape):
        info = info_of(achieved[index], desired[index], terms[index])
        assert rewards[index] == REWARD.compute(kind, achieved[index], desired[index], info)


def test_the_reward_of_one_pair_of_goals_is_a_float_of_numpy():
    """It is a Python float, and has the methods of arrays, which scripts call."""
    for reward in (
        REWARD.compute("sparse", ORIGIN, ORIGIN, {}),
        REWARD.compute("dense", ORIGIN, ORIGIN, info_of(ORIGIN, ORIGIN, 0.0)),
    ):
        assert isinstance(reward, float)
        assert isinstance(reward, np.float64)


@pytest.mark.parametrize("info", [None, {}, [{}] * 7, np.array([{}] * 7), {"reach": np.nan}])
def test_sparse_reward_ignores_the_info(info):
    achieved, desired = goals(7)
    np.testing.assert_array_equal(
        REWARD.compute("sparse", achieved, desired, info),
        np.where(distance(achieved, desired) <= 0.05, 0.0, -1.0),
    )


def test_dense_reward_takes_a_dict_of_arrays_or_a_dict_for_each():
    achieved, desired = goals(7)
    terms = np.linspace(-1.0, 0.0, 7)
    np.testing.assert_array_equal(
        REWARD.compute("dense", achieved, desired, list(map(info_of, achieved, desired, terms))),
        REWARD.compute("dense", achieved, desired, info_of(achieved, desired, terms)),
    )


@pytest.mark.parametrize(
    "info", [None, {}, [{}] * 7, np.array([{}] * 7), {"reech": 0.0}, {"reach": np.zeros(7)}]
)
def test_dense_reward_without_its_terms_names_them_and_suggests_the_sparse_reward(info):
    with pytest.raises(ValueError, match=r"\['reach', 'step_goals'\].*HER.*reward_type=\"sparse\""):
        REWARD.compute("dense", *goals(7), info)


def other_goals(achieved, desired):
    """Pairs of goals that differ from a pair in one number of one row, or in one pair for both."""
    for moved in (0, 1):
        pair = [achieved.copy(), desired.copy()]
        pair[moved][..., -1] = np.nextafter(pair[moved][..., -1], np.float32(2.0))
        yield pair
    yield achieved, achieved  # as HER relabels the last step of an episode
    yield desired, achieved


@pytest.mark.parametrize("env_id", WITH_TERMS)
def test_dense_reward_of_other_goals_than_the_steps_raises(env_id):
    """Even at the same distance, as after a swap: the terms are those of the step's goals."""
    env = make(env_id, reward_type="dense")
    env.reset(seed=3)
    observation, reward, _, _, info = env.step(env.action_space.sample())
    step = observation["achieved_goal"], observation["desired_goal"]
    for pair in other_goals(*step):
        with pytest.raises(ValueError, match=r"other goals than those of the step.*HER.*sparse"):
            env.compute_reward(*pair, info)
    assert env.compute_reward(*step, info) == reward


@pytest.mark.parametrize("env_id", WITH_TERMS)
def test_dense_reward_of_other_goals_raises_for_vectors(env_id):
    envs = make_vec(4, env_id, reward_type="dense")
    envs.reset(seed=3)
    observation, reward, _, _, info = envs.step(envs.action_space.sample())
    step = observation["achieved_goal"], observation["desired_goal"]
    infos = [{key: info[key][i] for key in info} for i in range(4)]
    for given in (info, infos):
        for pair in other_goals(*step):
            with pytest.raises(ValueError, match="other goals than those of the step"):
                envs.compute_reward(*pair, given)
        swapped = [goals[[1, 0, 2, 3]] for goals in step]
        with pytest.raises(ValueError, match="other goals than those of the step"):
            envs.compute_reward(*swapped, given)
        np.testing.assert_array_equal(envs.compute_reward(*step, given), reward)


def test_dense_reward_that_follows_from_the_goals_can_be_relabelled():
    reward = Reward(threshold=0.05, weights={"success": 1.0, "distance": 2.0, "time": -1.0})
    achieved, desired = goals(7)
    assert reward.compute("dense", achieved, achieved, {}).tolist() == [0.0] * 7
    goal_distance = distance(achieved, desired)
    expected = (goal_distance <= 0.05) - 2.0 * goal_distance - 1.0
    np.testing.assert_allclose(reward.compute("dense", achieved, desired, None), expected)


@pytest.mark.parametrize(("env_id", "penalty"), [(PUSH, 0.0), (STACK, 2.0), (THROW, 1.0)])
def test_the_time_penalty_applies_if_success_terminates_the_episode(env_id, penalty):
    paid = []
    for ends in (False, True):
        envs = make_vec(4, env_id, reward_type="dense", terminate_on_success=ends)
        envs.reset(seed=3)
        actions = np.zeros(envs.action_space.shape, dtype=np.float32)
        observation, reward, _, _, info = envs.step(actions)
        goals_of_step = observation["achieved_goal"], observation["desired_goal"]
        np.testing.assert_array_equal(envs.compute_reward(*goals_of_step, info), reward)
        assert envs.reward.weights.get("time", 0.0) == (-penalty if ends else 0.0)
        paid.append(reward)
    np.testing.assert_allclose(paid[0] - paid[1], penalty, rtol=1e-6)


def test_the_last_info_of_an_episode_contains_its_goals():
    envs = make_vec(3, reward_type="dense", max_episode_steps=2, autoreset_mode="SameStep")
    envs.reset(seed=0)
    for _ in range(2):
        _, reward, _, truncated, info = envs.step(np.ones((3, 3), dtype=np.float32))
    assert truncated.all()
    last = [
        np.stack([end[key] for end in info["final_obs"]])
        for key in ("achieved_goal", "desired_goal")
    ]
    np.testing.assert_array_equal(envs.compute_reward(*last, info["final_info"]), reward)


@pytest.mark.parametrize("kind", REWARDS)
def test_goals_of_different_shape_are_refused(kind):
    with pytest.raises(ValueError, match=r"same shape, got \(2, 3\) and \(3,\)"):
        REWARD.compute(kind, np.zeros((2, 3)), ORIGIN, {"reach": 0.0})


@pytest.mark.parametrize("kind", REWARDS)
def test_a_step_returns_the_reward_of_compute_reward(kind):
    env = make(reward_type=kind)
    env.reset(seed=3)
    for observation, reward, _, _, info in steps_of(env, random_actions(50, 1)[:, 0]):
        given = {} if kind == "sparse" else info
        achieved, desired = observation["achieved_goal"], observation["desired_goal"]
        assert type(reward) is float
        assert reward == env.compute_reward(achieved, desired, given)


@pytest.mark.parametrize("kind", REWARDS)
def test_a_step_of_many_worlds_returns_the_rewards_of_compute_reward(kind):
    envs = make_vec(64, reward_type=kind)
    envs.reset(seed=3)
    for observation, reward, _, _, info in steps_of(envs, random_actions(50, 64)):
        given = {} if kind == "sparse" else info
        achieved, desired = observation["achieved_goal"], observation["desired_goal"]
        np.testing.assert_array_equal(reward, envs.compute_reward(achieved, desired, given))
        np.testing.assert_array_equal(info["is_success"], distance(achieved, desired) <= 0.05)
