"""Wrong environments and invalid arguments raise clear errors, and change nothing."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import FilterObservation

from rigid_envs import wrappers
from rigid_envs.wrappers import Stage, goal_potential
from tests.rigid_envs.rollout import (
    PUSH,
    assert_same,
    assert_untouched,
    make,
    make_vec,
    random_actions,
    steps_of,
)
from tests.rigid_envs.wrappers.test_formulas import ARGUMENTS, wrapped, wrapped_vec


@pytest.mark.parametrize("name", ARGUMENTS)
def test_the_wrong_kind_of_environment_names_the_right_wrapper(name):
    with pytest.raises(
        TypeError,
        match=rf"^rigid_envs\.wrappers\.{name} wraps a gymnasium Env, got RigidVectorEnv "
        rf"\({PUSH}\); use rigid_envs\.wrappers\.vector\.{name}$",
    ):
        wrapped(make_vec(2), [name])
    with pytest.raises(
        TypeError,
        match=rf"^rigid_envs\.wrappers\.vector\.{name} wraps a gymnasium VectorEnv, got RigidEnv "
        rf"\({PUSH}\); use rigid_envs\.wrappers\.{name}$",
    ):
        wrapped(gym.make(PUSH), [name], wrappers.vector)


@pytest.mark.parametrize("thing", [None, 3, PUSH, make])
def test_an_object_that_is_no_environment_is_named(thing):
    with pytest.raises(TypeError, match=r"wraps a gymnasium Env, got \w+$"):
        wrappers.ScaleReward(thing, 2.0)
    with pytest.raises(TypeError, match=r"wraps a gymnasium VectorEnv, got \w+$"):
        wrappers.vector.ScaleReward(thing, 2.0)


@pytest.mark.parametrize("name", ARGUMENTS)
def test_environments_without_goals_raise(name):
    with pytest.raises(TypeError, match=r"environments with goals.*CartPole-v1.*TransformReward"):
        wrapped(gym.make("CartPole-v1"), [name])
    with pytest.raises(TypeError, match=r"environments with goals.*CartPole-v1"):
        wrapped(gym.make_vec("CartPole-v1", 2), [name], wrappers.vector)
    with pytest.raises(TypeError, match=r"environments with goals.*observes Dict\('observation'"):
        wrapped(FilterObservation(gym.make(PUSH), ["observation"]), [name])


def test_an_environment_without_a_threshold_raises_if_the_rule_needs_success():
    class Foreign(gym.Env):
        observation_space, action_space = make().observation_space, gym.spaces.Discrete(3)

        def compute_reward(self, achieved, desired, info):
            return 0.0

    with pytest.raises(TypeError, match=r"SuccessBonus .* `reward` .* Foreign does not have"):
        wrappers.SuccessBonus(Foreign(), 1.0)
    with pytest.raises(TypeError, match=r"ActionPenalty .* space is a Box, got Discrete\(3\)"):
        wrappers.ActionPenalty(Foreign(), 1.0)
    wrappers.ScaleReward(Foreign(), 2.0)


@pytest.mark.parametrize("space", [wrappers, wrappers.vector], ids=["single", "vector"])
@pytest.mark.parametrize(
    ("name", "arguments", "error", "match"),
    [
        (
            "ActionPenalty",
            {"weight": -1},
            ValueError,
            "weight must be .*at least 0, got -1",
        ),
        ("ActionPenalty", {"weight": "1"}, TypeError, "weight must be a number, got '1'"),
        ("ActionPenalty", {"weight": 1, "components": 2}, TypeError, "components must be list or"),
        ("ActionPenalty", {"weight": 1, "components": []}, ValueError, "name at least one"),
        ("ActionPenalty", {"weight": 1, "components": [1, 1]}, ValueError, "none twice, got .1, 1"),
        ("ActionPenalty", {"weight": 1, "components": [-1]}, ValueError, r"\[0\] must be"),
        ("ActionPenalty", {"weight": 1, "components": [9]}, ValueError, "be below 3, the size"),
        ("ActionPenalty", {"wieght": 1}, TypeError, "unexpected keyword argument 'wieght'"),
        ("ActionPenalty", {}, TypeError, "missing 1 required positional argument: 'weight'"),
        ("SmoothnessPenalty", {"weight": np.nan}, ValueError, "weight must be finite.*got nan"),
        ("SuccessBonus", {"bonus": -0.1}, ValueError, "bonus must be .*at least 0, got -0.1"),
        ("TimePenalty", {"penalty": True}, TypeError, "penalty must be a number, got True"),
        ("ScaleReward", {"scale": 0}, ValueError, "scale must be finite and above 0, got 0"),
        ("BoundReward", {"low": 1, "high": 0}, ValueError, r"high must be above low, 1\.0, got 0"),
        ("PotentialShaping", {"potential": 3, "gamma": 0.9}, TypeError, "potential must be call"),
        (
            "PotentialShaping",
            {"potential": goal_potential, "gamma": 98},
            ValueError,
            "gamma must be finite and at least 0 and at most 1, got 98",
        ),
        ("StagedReward", {"stages": []}, ValueError, "stages must contain at least one Stage"),
        (
            "StagedReward",
            {"stages": "reach"},
            TypeError,
            "must be list or tuple, got 'reach",
        ),
        (
            "StagedReward",
            {"stages": ["reach"]},
            TypeError,
            r"stages\[0\] must be Stage",
        ),
    ],
)
def test_bad_arguments_are_named(space, name, arguments, error, match):
    env = gym.make(PUSH) if space is wrappers else make_vec(2)
    with pytest.raises(error, match=match):
        getattr(space, name)(env, **arguments)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ((3, 0.0, 1.0), "Stage.term must be str, got 3"),
        (("reach", 0.0, np.inf), "Stage.done must be finite, got inf"),
        (("reach", 1.0, 1.0), "Stage.done must differ from Stage.start, got 1.0"),
        (("reach", 0.0, 1.0, 0.0), "Stage.weight must be finite and above 0"),
        (("time", 0.0, 1.0), "Stage.term must not be 'time'"),
    ],
)
def test_bad_stages_are_named(arguments, match):
    with pytest.raises((TypeError, ValueError), match=match):
        Stage(*arguments)


def test_a_stage_of_an_unknown_term_is_named_at_the_reset():
    for space, env in ((wrappers, gym.make(PUSH)), (wrappers.vector, make_vec(2))):
        staged = space.StagedReward(env, [Stage("reech", 0.0, 1.0)])
        with pytest.raises(ValueError, match=r"needs the term 'reech' .* has \[.*'reach'\]"):
            staged.reset(seed=0)


@pytest.mark.parametrize("value", [np.zeros(3), "high", np.nan])
def test_a_potential_that_returns_no_number_per_world_is_named(value):
    envs = wrappers.vector.PotentialShaping(make_vec(2), lambda observation: value, 0.9)
    with pytest.raises(ValueError, match=r"potential\(observation\) must be"):
        envs.reset(seed=0)


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_step_before_the_wrappers_reset_changes_nothing(name):
    envs = make_vec(2)
    envs.reset(seed=0)
    late, before = wrapped(envs, [name], wrappers.vector), envs.get_state()
    with pytest.raises(gym.error.ResetNeeded, match=rf"reset\(\) of {name} must be called"):
        late.step(np.zeros((2, 3)))
    assert_untouched(envs, before)
    env = wrapped(gym.make(PUSH), [name])
    with pytest.raises(gym.error.ResetNeeded, match=rf"reset\(\) of {name} must be called"):
        env.step(np.zeros(3))


def test_invalid_actions_change_nothing():
    """Neither the environment nor a wrapper's memory of the last step changes."""
    envs, twin = (wrapped_vec(2, tuple(ARGUMENTS)) for _ in range(2))
    actions = random_actions(10, 2)
    for one in (envs, twin):
        one.reset(seed=0)
        list(steps_of(one, actions[:5]))
    for bad in (np.full((2, 3), np.nan), np.zeros((3, 3)), "push", None):
        with pytest.raises(ValueError, match="action must"):
            envs.step(bad)
    assert_same(list(steps_of(envs, actions[5:])), list(steps_of(twin, actions[5:])))


def test_a_state_of_another_stack_is_refused():
    envs, other = wrapped_vec(2, ["ActionPenalty"]), make_vec(2)
    for one in (envs, other):
        one.reset(seed=0)
    with pytest.raises(ValueError, match=r"state must come from get_state of ActionPenalty, got a"):
        envs.set_state(other.get_state())


def test_the_same_wrapper_on_single_environments_and_their_vector_is_refused():
    kwargs = {"weight": 1.0}
    sync = gym.make_vec(
        PUSH,
        num_envs=2,
        vectorization_mode="sync",
        wrappers=[lambda env: wrappers.ActionPenalty(env, **kwargs)],
    )
    envs = wrappers.vector.ActionPenalty(sync, **kwargs)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=r"cannot add 'action_square' .* already has this entry"):
        envs.step(np.zeros((2, 3)))


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_vector_without_an_autoreset_mode_raises(name):
    envs = make_vec(2)
    envs.metadata = {}
    with pytest.raises(ValueError, match=r'metadata\["autoreset_mode"\] must be .* got None'):
        wrapped(envs, [name], wrappers.vector)
