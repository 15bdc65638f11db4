"""Invalid input of a vector environment is named, and changes no world."""

import copy
import gc

import gymnasium as gym
import numpy as np
import pytest

from physics import SimulationDiverged
from rigid_envs import RigidVectorEnv
from tests.rigid_envs.rollout import (
    assert_same,
    assert_untouched,
    make_vec,
    random_actions,
    some_worlds,
    steps_of,
)


@pytest.fixture
def envs():
    envs = make_vec(4)
    envs.reset(seed=0)
    list(steps_of(envs, random_actions(10, 4)))
    return envs


def bad_actions(world, component, value=np.nan):
    actions = np.zeros((4, 3))
    actions[world, component] = value
    return actions


@pytest.mark.parametrize(
    ("actions", "match"),
    [
        (bad_actions(2, 1), r"NaN in world 2, component 1 \(finger y\)"),
        (bad_actions(0, 0), r"NaN in world 0, component 0 \(finger x\)"),
        (np.zeros((3, 3)), r"shape \(4, 3\), got \(3, 3\)"),
        (np.zeros(3), r"shape \(4, 3\), got \(3,\)"),
        (None, r"shape \(4, 3\), got \(\)"),
        ([[0.0] * 3] * 3 + [[0.0] * 2], "action must be numbers of shape"),
        ("push", "action must be numbers of shape"),
    ],
)
def test_bad_actions_are_named_and_move_no_world(envs, actions, match):
    before = envs.get_state()
    with pytest.raises(ValueError, match=match):
        envs.step(actions)
    assert_untouched(envs, before)


@pytest.mark.parametrize("size", [1.5, 1e30, np.inf])
def test_actions_out_of_range_are_clipped(envs, size):
    twin = copy.deepcopy(envs)
    signs = np.sign(random_actions(1, 4)[0])
    assert_same(envs.step(size * signs), twin.step(signs))


@pytest.mark.parametrize(
    ("kwargs", "error", "match"),
    [
        ({"num_envs": 0}, ValueError, "num_envs must be at least 1, got 0"),
        ({"num_envs": -3}, ValueError, "num_envs must be at least 1, got -3"),
        ({"num_envs": 1.5}, TypeError, "num_envs must be an integer, got 1.5"),
        ({"num_envs": True}, TypeError, "num_envs must be an integer, got True"),
        ({"threads": 0}, ValueError, "threads must be at least 1, got 0"),
        ({"autoreset_mode": "sometimes"}, ValueError, "autoreset_mode must be one of .*NEXT_STEP"),
        ({"autoreset_mode": None}, ValueError, "autoreset_mode must be one of .*got None"),
    ],
)
def test_an_invalid_argument_of_many_worlds_raises_an_error_that_names_it(kwargs, error, match):
    with pytest.raises(error, match=match):
        RigidVectorEnv(**{"num_envs": 2, **kwargs})


@pytest.mark.parametrize(
    ("seed", "match"),
    [
        (-1, "seed must be at least 0, got -1"),
        (1.5, "seed must be None, an int, or a list of 4 of them, got 1.5"),
        ("abcd", "seed must be None, an int, or a list of 4 of them, got 'abcd'"),
        (True, "seed must be an integer, got True"),
        (2**63, r"seed must be at most 2\*\*62, got 9223372036854775808"),
        ([1, 2, 3], r"seed must be None, an int, or a list of 4 of them, got \[1, 2, 3\]"),
        ([1, 2, -3, 4], r"seed\[2\] must be at least 0, got -3"),
        ([1, 2, 3, "4"], r"seed\[3\] must be an integer, got '4'"),
    ],
)
def test_a_bad_seed_is_named_and_resets_no_world(envs, seed, match):
    before = envs.get_state()
    with pytest.raises((TypeError, ValueError), match=match):
        envs.reset(seed=seed)
    assert_untouched(envs, before)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"mask": 1}, r"options accepts only \"reset_mask\" and \"randomize\", got \['mask'\]"),
        (
            {"reset_mask": np.ones(3, dtype=bool)},
            r"bools of shape \(4,\).*got 3 of shape \(3,\)",
        ),
        ({"reset_mask": np.zeros(4, dtype=bool)}, "at least one of them True"),
    ],
)
def test_bad_options_are_named_and_reset_no_world(envs, options, match):
    before = envs.get_state()
    with pytest.raises(ValueError, match=match):
        envs.reset(options=options)
    assert_untouched(envs, before)


def test_a_mask_of_numbers_is_of_the_wrong_type(envs):
    before = envs.get_state()
    with pytest.raises(TypeError, match=r"reset_mask must be bools of shape \(4,\).*got int64"):
        envs.reset(options={"reset_mask": [1, 0, 0, 0]})
    assert_untouched(envs, before)


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_a_constructor_that_raises_leaves_nothing_that_raises_again():
    with pytest.raises(ValueError, match="fidelity must be one of"):
        make_vec(2, fidelity="quick")
    gc.collect()


def test_stepping_before_the_first_reset_raises():
    with pytest.raises(gym.error.ResetNeeded, match=r"reset\(\) must be called before step"):
        make_vec(2).step(np.zeros((2, 3)))


@pytest.mark.parametrize("state", [None, 3, {}, {"ended": 1}])
def test_an_invalid_state_raises(envs, state):
    before = envs.get_state()
    with pytest.raises(ValueError, match="state must "):
        envs.set_state(state)
    assert_untouched(envs, before)


def test_a_state_of_another_count_raises(envs):
    other = make_vec(5)
    other.reset(seed=0)
    before = envs.get_state()
    with pytest.raises(ValueError, match="it has another count"):
        envs.set_state(other.get_state())
    assert_untouched(envs, before)


def test_a_world_that_diverges_is_named_and_the_others_are_unaffected(envs):
    undisturbed = copy.deepcopy(envs)
    broken = np.array([False, False, True, False])
    far = np.full((1, 1, 3), 1.795e308)
    envs._runner.world.set_state(position=far, linear_velocity=far, worlds=broken)
    actions = random_actions(40, 4, seed=1)
    for action in actions[:2]:  # each step raises until the world is reset
        with pytest.raises(SimulationDiverged, match="world 2: block became non-finite") as error:
            envs.step(action)
        assert error.value.worlds == [2]
        undisturbed.step(action)
    observation, _ = envs.reset(options={"reset_mask": broken})
    assert all(np.isfinite(values).all() for values in observation.values())
    for action in actions[2:]:
        ours, theirs = envs.step(action), undisturbed.step(action)
        assert_same(some_worlds(ours, ~broken), some_worlds(theirs, ~broken))
    assert ours[3].tolist() == [True, True, False, True]
