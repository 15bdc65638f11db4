"""Each wrapper follows its formula, for single and vector environments and compute_reward."""

import copy
import pickle
import re
from functools import partial
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from rigid_envs import wrappers
from rigid_envs.registration import ENVIRONMENTS
from rigid_envs.tasks.goals import distance
from rigid_envs.wrappers import Stage, goal_potential
from tests.rigid_envs.rollout import (
    EPISODE,
    PUSH,
    REWARDS,
    assert_same,
    make_vec,
    put_cubes_on_goals,
    random_actions,
    steps_of,
)

STAGES = [Stage("reach", -0.4, -0.1), Stage("distance", -0.4, -0.05, 2.0), Stage("success", 0, 1)]
ARGUMENTS = {
    "StagedReward": {"stages": STAGES},
    "PotentialShaping": {"potential": goal_potential, "gamma": 0.9},
    "ActionPenalty": {"weight": 0.1},
    "SmoothnessPenalty": {"weight": 0.03},
    "SuccessBonus": {"bonus": 5.0},
    "TimePenalty": {"penalty": 0.7},
    "ScaleReward": {"scale": 0.3},
    "BoundReward": {"low": -0.9, "high": -0.1},
}
GOAL_RULES = ["SuccessBonus", "TimePenalty", "ScaleReward", "BoundReward"]
# names of wrappers from the inside out; a second one of a kind must not overwrite the terms
STACKS = [
    *((name,) for name in ARGUMENTS),
    tuple(ARGUMENTS),
    ("ActionPenalty", "ScaleReward", "ActionPenalty", "ScaleReward"),
    ("PotentialShaping", "SmoothnessPenalty", "PotentialShaping"),
]
MODES = list(AutoresetMode)
PAGE = (Path(__file__).parents[3] / "docs" / "rewards.md").read_text()


def wrapped(env, names, namespace=wrappers):
    for name in names:
        env = getattr(namespace, name)(env, **ARGUMENTS[name])
    return env


def wrapped_vec(worlds, names, **kwargs):
    return wrapped(make_vec(worlds, **kwargs), names, wrappers.vector)


# --- formulas -----------------------------------------------------------------------------------


def expected(name, reward, before, after, actions, last_actions, info):
    """The formula of each wrapper, written independently, [n]."""
    solved = distance(after["achieved_goal"], after["desired_goal"]) <= 0.05
    if name == "StagedReward":
        reach = np.where(solved, 1, np.clip((info["reach"] + 0.4) / 0.3, 0, 1))
        near = np.where(solved, 1, np.clip((goal_potential(after) + 0.4) / 0.35, 0, 1))
        return np.where(reach == 1, reach + 2 * near, reach) + solved - 4
    return {
        "PotentialShaping": reward + 0.9 * goal_potential(after) - goal_potential(before),
        "ActionPenalty": reward - 0.1 * (actions**2).sum(axis=1),
        "SmoothnessPenalty": reward - 0.03 * ((actions - last_actions) ** 2).sum(axis=1),
        "SuccessBonus": reward + 5 * solved,
        "TimePenalty": np.where(solved, reward, reward - 0.7),
        "ScaleReward": 0.3 * reward,
        "BoundReward": np.clip(reward, -0.9, -0.1),
    }[name]


@pytest.mark.parametrize("kind", REWARDS)
@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_wrapper_follows_its_formula_and_changes_nothing_else(name, kind):
    plain = make_vec(20, reward_type=kind)
    envs = wrapped_vec(20, [name], reward_type=kind)
    before, _ = plain.reset(seed=0)
    assert_same(envs.reset(seed=0)[0], before)
    last_actions = None
    for step, actions in enumerate(random_actions(EPISODE, 20)):
        if step == 20:
            for one in (plain, envs.unwrapped):
                put_cubes_on_goals(one, np.arange(20) % 2 == 0)
        # beyond the space the environment clips, and clipped actions are what is charged
        ours, theirs = envs.step(3.0 * actions), plain.step(3.0 * actions)
        done = np.clip(3.0 * actions, -1.0, 1.0).astype(float)
        last_actions = done if last_actions is None else last_actions
        after, reward, *ends, info = theirs
        assert_same((ours[0], *ours[2:4]), (after, *ends))
        assert_same({key: ours[4][key] for key in info}, info)
        want = expected(name, reward, before, after, done, last_actions, info)
        np.testing.assert_allclose(ours[1], want, rtol=1e-12, atol=1e-12)
        before, last_actions = after, done


@pytest.mark.parametrize(
    ("name", "terms"),
    [
        ("StagedReward", {"stages_done", "unstaged_reward", "step_goals"}),
        ("PotentialShaping", {"shaping", "step_goals"}),
        ("ActionPenalty", {"action_square"}),
        ("SmoothnessPenalty", {"action_change"}),
        ("SuccessBonus", {"bonus_paid"}),
        ("TimePenalty", {"time_charged"}),
        ("ScaleReward", {"unscaled_reward"}),
        ("BoundReward", {"unbounded_reward"}),
    ],
)
def test_the_info_of_a_step_contains_the_raw_terms(name, terms):
    env = wrapped(gym.make(PUSH), [name])
    first = env.reset(seed=0)[1]
    assert set(env.step(np.zeros(3))[4]) - set(first) == terms
    envs = wrapped_vec(2, [name])
    envs.reset(seed=0)
    info = envs.step(np.zeros((2, 3)))[4]
    assert set(info) - set(first) - {f"_{key}" for key in info} == terms


def test_a_penalty_counts_the_chosen_components_of_the_action():
    plain, wrapped = gym.make(PUSH), wrappers.ActionPenalty(gym.make(PUSH), 0.5, components=(0, 2))
    plain.reset(seed=0)
    wrapped.reset(seed=0)
    action = np.array([0.5, 1.0, -2.0])
    reward, info = wrapped.step(action)[1::3]
    assert info["action_square"] == 0.5**2 + 1.0
    assert reward == plain.step(action)[1] - 0.5 * 1.25
    assert gym.make(wrapped.spec).rule.components == (0, 2)


def test_a_stage_pays_nothing_before_all_stages_before_it_are_complete():
    envs = wrappers.vector.StagedReward(
        make_vec(3), [Stage("reach", -0.5, -0.0001), Stage("distance", -0.4, -0.05)]
    )
    envs.reset(seed=0)
    for _, reward, _, _, info in steps_of(envs, random_actions(20, 3)):
        assert (info["stages_done"] < 1.0).all()
        progress = np.maximum((info["reach"] + 0.5) / 0.4999, 0.0)
        np.testing.assert_allclose(reward, progress - 2.0)


@pytest.mark.parametrize("terminate", [False, True])
def test_one_stage_of_success_is_the_sparse_reward(terminate):
    plain = make_vec(4, terminate_on_success=terminate)
    envs = wrappers.vector.StagedReward(copy.deepcopy(plain), [Stage("success", 0, 1)])
    for one in (plain, envs):
        one.reset(seed=0)
        put_cubes_on_goals(one.unwrapped, np.arange(4) % 2 == 0)
    for ours, theirs in zip(
        steps_of(envs, random_actions(60, 4)), steps_of(plain, random_actions(60, 4)), strict=True
    ):
        np.testing.assert_array_equal(ours[1], theirs[1])


# --- one world and many -------------------------------------------------------------------------


def masked_entries(result):
    *head, info = result
    return *head, _masked(info)


def _masked(info):
    entries = {}
    for name, value in info.items():
        if isinstance(value, dict):
            entries[name] = _masked(value)
        else:
            entries[name] = value if name.startswith("_") else value[info[f"_{name}"]].tolist()
    return entries


@pytest.mark.parametrize(
    ("names", "mode"),
    # one wrapper in one mode, and all in a stack in all modes
    [(names, mode) for names in STACKS for mode in MODES if len(names) > 1 or mode is MODES[0]],
    ids=lambda value: "+".join(value) if isinstance(value, tuple) else value.name,
)
def test_a_vector_wrapper_returns_what_wrapped_single_environments_return(names, mode):
    """Episodes end at different times, some by success and others by time."""
    kwargs = {"terminate_on_success": True, "reward_type": "dense", "max_episode_steps": 20}
    native = wrapped_vec(4, names, autoreset_mode=mode, **kwargs)
    sync = gym.make_vec(
        PUSH,
        num_envs=4,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        wrappers=[partial(getattr(wrappers, name), **ARGUMENTS[name]) for name in names],
        **kwargs,
    )
    assert_same(native.reset(seed=8), sync.reset(seed=8))
    for step, actions in enumerate(random_actions(50, 4)):
        if step in (8, 26, 33):
            put_cubes_on_goals(native.unwrapped, np.array([False, True, False, step == 26]))
            put_cubes_on_goals(sync.envs[1].unwrapped)
            if step == 26:
                put_cubes_on_goals(sync.envs[3].unwrapped)
        ours, theirs = native.step(actions), sync.step(actions)
        np.testing.assert_equal(masked_entries(ours), masked_entries(theirs))
        ended = ours[2] | ours[3]
        if mode is AutoresetMode.DISABLED and ended.any():
            for one in (native, sync):
                one.reset(options={"reset_mask": ended.copy()})


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
@pytest.mark.parametrize("many", [False, True], ids=["single", "vector"])
def test_a_copy_continues_bitwise_identically(many, clone):
    names, actions = tuple(ARGUMENTS), random_actions(40, 3)
    env = wrapped_vec(3, names) if many else wrapped(gym.make(PUSH), names)
    actions = actions if many else actions[:, 0]
    env.reset(seed=0)
    list(steps_of(env, actions[:20]))
    twin = clone(env)
    assert_same(list(steps_of(env, actions[20:])), list(steps_of(twin, actions[20:])))


def test_a_restored_state_continues_bitwise_identically():
    envs = wrapped_vec(5, tuple(ARGUMENTS))
    envs.reset(seed=0)
    actions = random_actions(80, 5)
    list(steps_of(envs, actions[:EPISODE]))  # the next step is a reset
    saved = pickle.loads(pickle.dumps(envs.get_state()))
    want = list(steps_of(envs, actions[EPISODE:]))
    envs.set_state(saved)
    assert_same(list(steps_of(envs, actions[EPISODE:])), want)


def test_gym_make_builds_a_wrapped_environment_from_its_spec():
    env = wrapped(gym.make(PUSH), tuple(ARGUMENTS))
    again = gym.make(env.spec)
    assert str(again) == str(env)
    assert_same(again.reset(seed=0), env.reset(seed=0))
    assert_same(again.step(np.ones(3)), env.step(np.ones(3)))


# --- every task, and its documentation -----------------------------------------------------------


@pytest.mark.parametrize(
    ("env_id", "stage"),
    [
        ("RigidEnvs/Push-v0", Stage("reach", -0.4, -0.03)),
        ("RigidEnvs/Stack-v0", Stage("stage", 0.0, 1.0)),
        ("RigidEnvs/Throw-v0", Stage("aim", -1.5, -0.1)),
    ],
)
def test_every_task_can_be_wrapped(env_id, stage):
    names = tuple(ARGUMENTS)[1:]
    envs = wrappers.vector.StagedReward(make_vec(3, env_id), [stage, *STAGES[1:]])
    envs = wrapped(envs, names, wrappers.vector)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(10):
        observation, reward, *_, info = envs.step(envs.action_space.sample())
        assert 0.0 <= info["stages_done"].min() <= info["stages_done"].max() <= 3.0
        goals = observation["achieved_goal"], observation["desired_goal"]
        np.testing.assert_array_equal(reward, envs.compute_reward(*goals, info))


@pytest.mark.parametrize("env_id", list(ENVIRONMENTS))
def test_the_documentation_names_every_term(env_id):
    task = re.sub("RigidEnvs/|Dense|-v0", "", env_id)
    rows = [line for line in PAGE.splitlines() if line.startswith(f"| {task} |")]
    named = {term for row in rows for term in re.findall(r"`(\w+)`", row.split("|")[2])}
    entries = {name for name in make_vec(1, env_id).reset(seed=0)[1] if name[0] != "_"}
    assert entries - {"step_goals"} == named | {"is_success", "success", "out_of_bounds"}


def test_the_examples_of_the_documentation_run():
    names: dict = {}
    for example in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        exec(example, names)
    envs = names["envs"]
    envs.reset(seed=0)
    envs.step(np.zeros((64, 3)))
