"""The single environment follows Gymnasium's contract, names errors, and can be copied."""

import copy
import itertools
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

from physics import Fidelity, SimulationDiverged
from rigid_envs import RigidEnv, RigidVectorEnv, Runner
from tests.rigid_envs.rollout import (
    DENSE_IDS,
    EPISODE,
    IDS,
    PRESETS,
    PUSH,
    STACK,
    THROW,
    assert_same,
    assert_untouched,
    make,
    put_cubes_on_goals,
    random_actions,
    steps_of,
    toward_cube,
)

ACTIONS = random_actions(EPISODE, 1)[:, 0]
ZERO = np.zeros(3, dtype=np.float32)


@pytest.fixture
def env():
    env = make()
    env.reset(seed=0)
    yield env
    env.close()


# --- contract -----------------------------------------------------------------------------------


OTHER_PRESETS = [name for name in PRESETS if name != "balanced"]


@pytest.mark.parametrize(
    ("env_id", "fidelity", "render_mode"),
    [*itertools.product([*IDS, *DENSE_IDS], ["balanced"], [None]),
     *itertools.product(IDS, ["balanced"], ["rgb_array"]),
     *itertools.product([PUSH, STACK, THROW], OTHER_PRESETS, [None])],
)  # fmt: skip
@pytest.mark.parametrize("check", [check_env, check_env_for_sb3], ids=["gymnasium", "sb3"])
def test_the_checkers_accept_every_id_without_a_warning(check, env_id, fidelity, render_mode):
    env = make(env_id, fidelity=fidelity, render_mode=render_mode)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check(env)
    env.close()


@pytest.mark.parametrize(
    "option",
    [
        {"terminate_on_success": True},
        {"show_forces": True},
        {"target_yaw": True, "obstacles": 2, "render_mode": "rgb_array"},
        {"block": "t", "render_mode": "rgb_array"},
    ],
)
@pytest.mark.parametrize("check", [check_env, check_env_for_sb3], ids=["gymnasium", "sb3"])
def test_the_checkers_accept_other_options(check, option):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check(make(**option))


def test_a_module_prefix_in_the_id_imports_the_package():
    assert gym.make(f"rigid_envs:{PUSH}").spec.id == PUSH


@pytest.mark.parametrize("env_id", IDS)
def test_spaces_are_flat_dicts_of_finite_float32_boxes(env_id):
    env = make(env_id)
    assert set(env.observation_space) == {"observation", "achieved_goal", "desired_goal"}
    for space in (*env.observation_space.values(), env.action_space):
        assert space.dtype == np.float32
        assert space.is_bounded()
    assert env.action_space.low.min() == env.action_space.low.max() == -1.0
    assert env.action_space.high.min() == env.action_space.high.max() == 1.0


def test_values_are_python_numbers_and_the_info_is_that_of_one_world(env):
    _, reward, terminated, truncated, info = env.step(ZERO)
    assert [type(x) for x in (reward, terminated, truncated)] == [float, bool, bool]
    assert {name: type(value) for name, value in info.items()} == {
        "is_success": bool,
        "success": bool,
        "out_of_bounds": bool,
        "reach": float,
    }


def test_gym_make_truncates_an_episode_after_fifty_steps():
    env = gym.make(PUSH)
    env.reset(seed=0)
    ends = [(terminated, truncated) for _, _, terminated, truncated, _ in steps_of(env, ACTIONS)]
    assert ends == [(False, step == EPISODE) for step in range(1, EPISODE + 1)]


def test_gym_make_accepts_another_episode_length():
    env = gym.make(PUSH, max_episode_steps=7)
    env.reset(seed=0)
    assert [step[3] for step in steps_of(env, ACTIONS[:7])] == [False] * 6 + [True]


def test_the_environment_counts_its_own_steps():
    env = RigidEnv(max_episode_steps=7)
    for _ in range(2):
        env.reset(seed=0)
        assert [step[3] for step in steps_of(env, ACTIONS[:7])] == [False] * 6 + [True]


@pytest.mark.parametrize("terminate", [False, True])
def test_success_terminates_an_episode_only_with_terminate_on_success(terminate):
    env = make(terminate_on_success=terminate)
    env.reset(seed=0)
    put_cubes_on_goals(env)
    _, reward, terminated, truncated, info = env.step(ZERO)
    assert info["is_success"]
    assert reward == 0.0
    assert terminated is terminate
    assert not truncated


def test_success_is_that_of_the_current_step(env):
    put_cubes_on_goals(env)
    assert env.step(ZERO)[4]["is_success"]
    put_cubes_on_goals(env, shift=0.06)
    assert not env.step(ZERO)[4]["is_success"]


def test_leaving_the_bounds_truncates_and_info_shows_the_reason():
    env = make()
    env.reset(seed=0)
    assert not env.step(ZERO)[4]["out_of_bounds"]
    env._runner.world.set_state(position=[[[1.2, 0.0, 0.02]]])
    observation, _, terminated, truncated, info = env.step(ZERO)
    assert info["out_of_bounds"]
    assert truncated
    assert not terminated
    assert env.observation_space.contains(observation)
    env.reset()
    assert not env.step(ZERO)[4]["out_of_bounds"]


# --- seeds and state ----------------------------------------------------------------------------


def rollout(env, actions=ACTIONS):
    return list(steps_of(env, actions))


def in_mid_episode(env_id, env=None):
    """An environment in the middle of an episode, and actions for the rest of it."""
    env = env or make(env_id)
    actions = random_actions(EPISODE, 1, size=env.action_space.shape[0])[:, 0]
    env.reset(seed=0)
    rollout(env, actions[:20])
    return env, actions[20:]


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_seed_gives_the_same_episodes_whatever_came_before(fidelity):
    fresh, used = make(fidelity=fidelity), make(fidelity=fidelity)
    used.reset(seed=99)
    for _ in range(EPISODE):
        observation = used.step(toward_cube(used._runner.observe()[0])[0])[0]
    assert np.abs(observation["observation"][13:19]).max() > 0.0  # it was pushed
    for seed in (5, None):  # the first episode of the seed, and the next one
        assert_same(fresh.reset(seed=seed), used.reset(seed=seed))
        assert_same(rollout(fresh), rollout(used))


def test_other_seeds_and_later_episodes_start_elsewhere(env):
    starts = [env.reset(seed=0)[0], env.reset(seed=1)[0], env.reset()[0], env.reset()[0]]
    assert len({start["desired_goal"].tobytes() for start in starts}) == 4


def test_without_a_seed_two_environments_differ():
    first, second = make().reset()[0], make().reset()[0]
    assert not np.array_equal(first["desired_goal"], second["desired_goal"])


@pytest.mark.parametrize("env_id", IDS)
def test_a_restored_state_continues_bitwise_identically_here_and_elsewhere(env_id):
    env, actions = in_mid_episode(env_id)
    saved = env.get_state()
    kept = pickle.loads(pickle.dumps(saved))
    expected = [rollout(env, actions), env.reset(), rollout(env, actions)]
    for one, state in ((env, saved), (make(env_id), kept)):
        one.set_state(state)
        assert_same([rollout(one, actions), one.reset(), rollout(one, actions)], expected)


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
@pytest.mark.parametrize("env_id", IDS)
def test_a_copy_continues_bitwise_identically(env_id, clone, render_mode):
    env, actions = in_mid_episode(env_id, gym.make(env_id, render_mode=render_mode))
    if render_mode:
        env.render()
    twin = clone(env)
    expected = rollout(env, actions)
    assert_same(rollout(twin, actions), expected)
    if render_mode:
        assert_same(twin.render(), env.render())


def test_returned_arrays_are_not_written_again(env):
    first = env.step(ACTIONS[0])
    kept = copy.deepcopy(first)
    rollout(env, ACTIONS[1:])
    env.reset()
    assert_same(first, kept)


# --- bad input ----------------------------------------------------------------------------------


def assert_raises(env, act, error, match):
    """`act` raises, and the state of the environment has not changed."""
    before = env.get_state()
    with pytest.raises(error, match=match):
        act()
    assert_untouched(env, before)


@pytest.mark.parametrize("component", [0, 1, 2])
def test_nan_in_an_action_names_world_and_component(env, component):
    action = ACTIONS[0].copy()
    action[component] = np.nan
    match = rf"NaN in world 0, component {component} \(finger {'xyz'[component]}\)"
    assert_raises(env, lambda: env.step(action), ValueError, match)


@pytest.mark.parametrize(
    ("action", "match"),
    [
        (np.zeros(4), r"shape \(3,\), got \(4,\)"),
        (np.zeros((1, 3)), r"shape \(3,\), got \(1, 3\)"),
        (0.0, r"shape \(3,\), got \(\)"),
        (None, r"shape \(3,\), got \(\): .*None"),
        (["a", "b", "c"], "action must be numbers"),
    ],
)
def test_an_action_of_the_wrong_kind_raises(env, action, match):
    assert_raises(env, lambda: env.step(action), ValueError, match)


@pytest.mark.parametrize("size", [1.5, 1e30, np.inf])
def test_actions_out_of_range_are_clipped(size):
    envs = make(), make()
    for env in envs:
        env.reset(seed=0)
    action = np.array([1.0, -1.0, 0.5])
    for _ in range(5):
        expected = envs[0].step(action)
        assert_same(envs[1].step(np.where(np.abs(action) == 1.0, size * action, action)), expected)


@pytest.mark.parametrize(
    ("kwargs", "error", "match"),
    [
        ({"reward_type": "spares"}, ValueError, "reward_type.*did you mean 'sparse'"),
        ({"reward_type": None}, ValueError, "reward_type must be one of .*got None"),
        ({"fidelity": "ballanced"}, ValueError, "fidelity.*did you mean 'balanced'"),
        ({"fidelity": 3}, TypeError, "fidelity must be one of .* or a Fidelity, got 3"),
        ({"render_mode": "rgb"}, ValueError, "render_mode must be one of .*got 'rgb'"),
        (
            {"max_episode_steps": 0},
            ValueError,
            "at least 1, or -1 for no limit, got 0",
        ),
        ({"max_episode_steps": 1.5}, TypeError, "max_episode_steps must be an integer, got 1.5"),
        ({"max_episode_steps": -2}, ValueError, "at least 1, or -1 for no limit, got -2"),
        ({"terminate_on_success": 1}, TypeError, "terminate_on_success must be a bool, got 1"),
        ({"show_forces": "yes"}, TypeError, "show_forces must be bool, got 'yes'"),
        ({"task": "pusch"}, ValueError, "task.*did you mean 'push'"),
        ({"task": 1}, ValueError, "task must be one of"),
    ],
)
@pytest.mark.parametrize("kind", [RigidEnv, RigidVectorEnv])
def test_an_invalid_argument_raises_an_error_that_names_it(kind, kwargs, error, match):
    with pytest.raises(error, match=match):
        kind(**kwargs)


def test_a_custom_fidelity_replaces_a_preset():
    env = make(fidelity=Fidelity(substep=1e-3))
    env.reset(seed=0)
    assert np.isfinite(env.step(ACTIONS[0])[1])


@pytest.mark.parametrize("seed", [-1, 1.5, "a", True, 2**63, 2**70], ids=str)
def test_a_bad_seed_raises(env, seed):
    act = lambda: env.reset(seed=seed)  # noqa: E731
    assert_raises(env, act, (TypeError, ValueError), rf"seed must be .*got {seed!r}")


def test_an_unknown_option_raises(env):
    act = lambda: env.reset(options={"goal": 1})  # noqa: E731
    assert_raises(env, act, ValueError, "options accepts only \"randomize\", got {'goal': 1}")


def test_stepping_before_the_first_reset_raises():
    with pytest.raises(gym.error.ResetNeeded, match=r"reset\(\) must be called before step"):
        make().step(ZERO)


@pytest.mark.parametrize("shape", [(2,), (5,), (4, 2), ()])
@pytest.mark.parametrize("name", ["compute_reward", "compute_terminated"])
def test_goals_of_another_size_raise(env, name, shape):
    goal = np.zeros(shape)
    with pytest.raises(ValueError, match=r"achieved_goal must have shape \[\.\.\., 3\], got "):
        getattr(env.unwrapped, name)(goal, goal, {})


@pytest.mark.parametrize("state", [None, {}, 3, {"version": 1}])
def test_an_invalid_state_raises(env, state):
    assert_raises(env, lambda: env.set_state(state), ValueError, "state must be a dict with")


def test_a_state_of_another_version_fidelity_or_count_raises(env):
    state = {**env.get_state(), "version": 99}
    assert_raises(
        env, lambda: env.set_state(state), ValueError, "state must have version 2, got 99"
    )
    for other, what in (
        (Runner("push", 1, fidelity="accurate"), "fidelity"),
        (Runner("push", 2), "count"),
    ):
        other.reset(np.ones(other.count, dtype=bool), np.arange(other.count))
        state = other.get_state()
        assert_raises(env, lambda s=state: env.set_state(s), ValueError, f"another {what}")


def test_a_world_that_diverges_raises_and_recovers_with_the_next_reset(env):
    env._runner.world.set_state(linear_velocity=[[[1e308, 0.0, 0.0]]])
    with pytest.raises(SimulationDiverged, match=r"world 0: block became non-finite at t ="):
        rollout(env)
    fresh = make()
    assert_same(env.reset(seed=4), fresh.reset(seed=4))
    assert_same(rollout(env), rollout(fresh))
