"""Many worlds behave as many single environments, in all three autoreset modes of Gymnasium."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from rigid_envs import RigidEnv, RigidVectorEnv
from tests.rigid_envs.rollout import (
    EPISODE,
    IDS,
    PRESETS,
    PUSH,
    REWARDS,
    THROW,
    assert_same,
    assert_untouched,
    make,
    make_vec,
    one_world,
    push_blindly,
    put_cubes_on_goals,
    random_actions,
    some_worlds,
    steps_of,
)

SEED = 1000
# for each seed used below, so that the actions of a world do not depend on its index in a batch
NOISE = np.random.default_rng(0).uniform(-1.0, 1.0, (EPISODE, 300, 3)).astype(np.float32)
NEXT_STEP, SAME_STEP, DISABLED = (
    AutoresetMode.NEXT_STEP,
    AutoresetMode.SAME_STEP,
    AutoresetMode.DISABLED,
)


# --- contract -----------------------------------------------------------------------------------


@pytest.mark.parametrize("env_id", IDS)
def test_make_vec_gives_the_native_environment(env_id):
    envs = make_vec(5, env_id)
    assert type(envs) is RigidVectorEnv
    assert envs.spec.id == env_id
    assert envs.num_envs == 5
    assert envs.metadata["autoreset_mode"] is NEXT_STEP
    observation, _ = envs.reset(seed=0)
    assert envs.observation_space.contains(observation)
    assert envs.single_observation_space == gym.make(env_id).observation_space
    assert envs.single_action_space == gym.make(env_id).action_space


def test_a_module_prefix_in_the_id_imports_the_package():
    assert type(gym.make_vec(f"rigid_envs:{PUSH}", num_envs=2)) is RigidVectorEnv


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_metadata_names_the_autoreset_mode_of_this_environment_alone(mode):
    for name in (mode, mode.name, mode.value):
        assert make_vec(1, autoreset_mode=name).metadata["autoreset_mode"] is mode
    assert make_vec(1).metadata["autoreset_mode"] is NEXT_STEP


@pytest.mark.parametrize("reward_type", REWARDS)
@pytest.mark.parametrize("fidelity", PRESETS)
def test_observations_lie_in_the_space(fidelity, reward_type):
    envs = make_vec(128, fidelity=fidelity, reward_type=reward_type)
    observation, _ = envs.reset(seed=0)
    assert envs.observation_space.contains(observation)
    for result in steps_of(envs, random_actions(110, 128)):
        assert envs.observation_space.contains(result[0])
        assert [part.dtype for part in result[1:4]] == [np.float64, bool, bool]
        assert [part.shape for part in result[1:4]] == [(128,)] * 3


@pytest.mark.parametrize("steps", [7, 50, -1])
def test_the_episode_length_can_be_set(steps):
    envs = make_vec(2, max_episode_steps=steps)
    envs.reset(seed=0)
    truncated = [bool(result[3].all()) for result in steps_of(envs, random_actions(60, 2))]
    assert truncated.index(True) + 1 == steps if steps > 0 else not any(truncated)


def test_every_info_has_a_mask():
    envs = make_vec(3)
    for info in (envs.reset(seed=0)[1], envs.step(np.zeros((3, 3)))[4]):
        names = {name for name in info if not name.startswith("_")}
        assert names == {"is_success", "success", "out_of_bounds", "reach"}
        for name in names:
            assert info[name].shape == (3,)
            np.testing.assert_array_equal(info[f"_{name}"], [True] * 3)


def test_returned_arrays_are_not_written_again():
    envs = make_vec(3, autoreset_mode=SAME_STEP, max_episode_steps=5)
    envs.reset(seed=0)
    results = list(steps_of(envs, random_actions(5, 3)))
    kept = copy.deepcopy(results[3:])
    list(steps_of(envs, random_actions(12, 3)))
    assert_same(results[3:], kept)


# --- one world of many is a single environment --------------------------------------------------


def two_episodes_alone(seed, **kwargs):
    """All results of the single environment in the first two episodes of a seed."""
    env = RigidEnv(max_episode_steps=EPISODE, **kwargs)
    results = []
    for start in ({"seed": seed}, {}):
        observation, info = env.reset(**start)
        results.append((observation, info))
        for noise in NOISE[:, seed - SEED]:
            results.append(env.step(push_blindly(observation, noise)))
            observation = results[-1][0]
    return results


def two_episodes_together(seeds, **kwargs):
    """All results of a vector environment in these episodes."""
    envs = make_vec(len(seeds), **kwargs)
    results = [envs.reset(seed=seeds)]
    for _ in range(2):
        for noise in NOISE[:, np.array(seeds) - SEED]:
            results.append(envs.step(push_blindly(results[-1][0], noise)))
        results.append(envs.step(NOISE[0, : len(seeds)]))
    return results[:-1]


def assert_worlds_are_same(few, many, worlds):
    """Results of a vector environment equal those of some worlds of another one."""
    for one, other in zip(few, many, strict=True):
        assert_same(one, some_worlds(other, worlds))


@pytest.fixture(scope="module")
def together():
    return two_episodes_together(list(range(SEED, SEED + 300)), threads=1)


@pytest.mark.parametrize("world", [0, 1, 63, 64, 127, 299])
def test_a_world_of_many_is_bitwise_identical_to_the_single_environment(together, world):
    alone = two_episodes_alone(SEED + world)
    assert len(alone) == len(together) == 2 * EPISODE + 2
    for step, (one, many) in enumerate(zip(alone, together, strict=True)):
        if step == EPISODE + 1:  # the second reset of one is a step of the others
            observation, reward, terminated, truncated, info = one_world(many, world)
            assert (reward, terminated, truncated) == (0.0, False, False)
            assert_same((observation, info), one)
        else:
            assert_same(one_world(many, world), one)


@pytest.mark.parametrize("fidelity", ["fast", "accurate"])
@pytest.mark.parametrize("reward_type", REWARDS)
def test_this_holds_at_other_presets_and_rewards(fidelity, reward_type):
    kwargs = {"fidelity": fidelity, "reward_type": reward_type}
    together = two_episodes_together(list(range(SEED, SEED + 5)), **kwargs)
    alone = two_episodes_alone(SEED + 3, **kwargs)
    for one, many in zip(alone[: EPISODE + 1], together[: EPISODE + 1], strict=True):
        assert_same(one_world(many, 3), one)


def test_the_cube_is_pushed_in_those_episodes(together):
    start, end = (together[step][0]["achieved_goal"] for step in (0, EPISODE))
    assert (np.abs(start - end).max(axis=1) > 0.01).mean() > 0.5


@pytest.mark.parametrize(
    ("first", "count", "threads"),
    [(0, 1, 1), (0, 2, 2), (60, 7, 1), (10, 65, 2), (100, 129, 2), (0, 300, 2), (0, 300, 5)],
)
def test_batch_size_index_and_threads_change_no_bit(together, first, count, threads):
    part = two_episodes_together(list(range(SEED + first, SEED + first + count)), threads=threads)
    assert_worlds_are_same(part, together, np.arange(first, first + count))


def test_the_other_worlds_change_no_bit(together):
    seeds = [SEED + 200, SEED + 5, SEED + 150, SEED + 150]
    assert_worlds_are_same(two_episodes_together(seeds), together, np.array(seeds) - SEED)


def test_a_seed_for_all_counts_up_by_world(together):
    assert_same(make_vec(300).reset(seed=SEED), together[0])


def test_a_seed_restarts_the_episodes_whatever_came_before(together):
    envs = make_vec(20)
    envs.reset(seed=77)
    list(steps_of(envs, random_actions(70, 20)))
    results = [envs.reset(seed=SEED)]
    for noise in NOISE[:, :20]:
        results.append(envs.step(push_blindly(results[-1][0], noise)))
    assert_worlds_are_same(results, together[: EPISODE + 1], np.arange(20))


def test_every_world_has_a_seed_of_its_own():
    envs = make_vec(3)
    assert envs.np_random_seed == (-1, -1, -1)
    envs.reset(seed=[5, 9, 7])
    assert envs.np_random_seed == (5, 9, 7)
    envs.reset(seed=[None, 2, None])
    assert envs.np_random_seed == (5, 2, 7)


def test_a_world_whose_seed_is_none_starts_its_next_episode():
    """As in Gymnasium's vector of single environments."""
    native, sync = make_vec(4), make_vec(4, vectorization_mode="sync")
    for seed in (SEED, [7, None, SEED, None], [None] * 4, None):
        assert_same(native.reset(seed=seed), sync.reset(seed=seed))
        for actions in random_actions(3, 4):
            assert_same(native.step(actions), sync.step(actions))


def test_a_world_that_never_had_a_seed_draws_one():
    first, second = (make_vec(5).reset(seed=[None, 3, None, None, 3])[0] for _ in range(2))
    goals = {goal.tobytes() for goal in [*first["desired_goal"], *second["desired_goal"]]}
    assert len(goals) == 7
    np.testing.assert_array_equal(first["desired_goal"][1], second["desired_goal"][4])


def test_a_reset_of_the_other_worlds_leaves_seeded_ones_their_seeds():
    envs = make_vec(3, autoreset_mode=DISABLED)
    masks = np.array([True, False, False]), np.array([False, True, True])
    envs.reset(seed=[5, None, None], options={"reset_mask": masks[0]})
    with pytest.raises(gym.error.ResetNeeded):
        envs.step(np.zeros((3, 3)))
    envs.reset(options={"reset_mask": masks[1]})
    alone = RigidEnv()
    alone.reset(seed=5)
    assert_same(one_world(envs.reset(), 0), alone.reset())


# --- autoreset ----------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("reward_type", REWARDS)
def test_the_native_environment_returns_what_gymnasiums_vector_returns(mode, reward_type):
    """Episodes end at different times: some by success, others by their length."""
    kwargs = {"reward_type": reward_type, "terminate_on_success": True, "max_episode_steps": 20}
    native = make_vec(4, autoreset_mode=mode, **kwargs)
    vector_kwargs = {"autoreset_mode": mode}
    sync = make_vec(4, vectorization_mode="sync", vector_kwargs=vector_kwargs, **kwargs)
    assert_same(native.reset(seed=8), sync.reset(seed=8))
    for step, actions in enumerate(random_actions(50, 4)):
        if step in (8, 26, 33):
            put_cubes_on_goals(native, np.array([False, True, False, step == 26]))
            put_cubes_on_goals(sync.envs[1].unwrapped)
            if step == 26:
                put_cubes_on_goals(sync.envs[3].unwrapped)
        ours, theirs = native.step(actions), sync.step(actions)
        ended = ours[2] | ours[3]
        # where no episode ended, final_info of Gymnasium has zeros, and its mask is False
        np.testing.assert_equal(_masked(ours), _masked(theirs))
        if mode is DISABLED and ended.any():
            options = {"reset_mask": ended}
            one, other = (x.reset(options=dict(options))[0] for x in (native, sync))
            for key in one:
                np.testing.assert_array_equal(one[key][ended], other[key][ended])


def _masked(result):
    *head, info = result
    return *head, _masked_info(info)


def _masked_info(info):
    entries = {}
    for name, value in info.items():
        mask = info.get(f"_{name}")
        if name.startswith("_"):
            entries[name] = value
        elif isinstance(value, dict):
            entries[name] = _masked_info(value)
        else:
            entries[name] = value[mask].tolist()
    return entries


def test_next_step_resets_in_the_step_after_the_end_and_ignores_its_action():
    envs = make_vec(2, max_episode_steps=3, reward_type="dense")
    other = copy.deepcopy(envs)
    for both in (envs, other):
        both.reset(seed=0)
        for result in steps_of(both, random_actions(3, 2)):
            last = result
        assert last[3].all()
    observation, reward, terminated, truncated, _ = envs.step(np.ones((2, 3)))
    assert_same(observation, other.step(-np.ones((2, 3)))[0])
    assert not np.array_equal(observation["desired_goal"], last[0]["desired_goal"])
    assert reward.tolist() == [0.0, 0.0]
    assert not (terminated | truncated).any()


def test_same_step_returns_the_last_observation_and_info_separately():
    envs = make_vec(3, autoreset_mode=SAME_STEP, terminate_on_success=True)
    goals = envs.reset(seed=0)[0]["desired_goal"]
    solved = np.array([False, True, False])
    put_cubes_on_goals(envs, solved)
    observation, reward, terminated, truncated, info = envs.step(np.zeros((3, 3)))
    np.testing.assert_array_equal(terminated, solved)
    assert not truncated.any()
    assert reward.tolist() == [-1.0, 0.0, -1.0]
    np.testing.assert_array_equal(info["_final_obs"], solved)
    np.testing.assert_array_equal(info["_final_info"], solved)
    np.testing.assert_array_equal(info["final_info"]["_is_success"], solved)
    assert info["final_info"]["is_success"][1]
    assert not info["is_success"][1]  # the new episode's
    assert [last is None for last in info["final_obs"]] == [True, False, True]
    assert envs.single_observation_space.contains(info["final_obs"][1])
    np.testing.assert_array_equal(info["final_obs"][1]["desired_goal"], goals[1])
    assert not np.array_equal(observation["desired_goal"][1], goals[1])
    np.testing.assert_array_equal(observation["desired_goal"][[0, 2]], goals[[0, 2]])


def test_same_step_returns_no_final_entries_while_no_episode_ends():
    envs = make_vec(3, autoreset_mode=SAME_STEP)
    envs.reset(seed=0)
    assert not [name for name in envs.step(np.zeros((3, 3)))[4] if "final" in name]


def test_disabled_refuses_to_step_worlds_that_have_ended():
    envs = make_vec(3, autoreset_mode=DISABLED, terminate_on_success=True)
    envs.reset(seed=0)
    put_cubes_on_goals(envs, np.array([False, True, False]))
    ended = envs.step(np.zeros((3, 3)))[2]
    before = envs.get_state()
    with pytest.raises(gym.error.ResetNeeded, match=r"worlds \[1\] have ended: call reset"):
        envs.step(np.zeros((3, 3)))
    assert_untouched(envs, before)
    envs.reset(options={"reset_mask": ended})
    envs.step(np.zeros((3, 3)))


@pytest.mark.parametrize("seed", [None, 42])
def test_a_partial_reset_leaves_the_other_worlds_alone(seed):
    envs, undisturbed = make_vec(5, autoreset_mode=DISABLED), make_vec(5, autoreset_mode=DISABLED)
    for both in (envs, undisturbed):
        both.reset(seed=SEED)
        list(steps_of(both, random_actions(20, 5)))
    mask = np.array([True, False, False, True, False])
    observation, info = envs.reset(seed=seed, options={"reset_mask": mask})
    alone = RigidEnv()
    alone.reset(seed=SEED + 3 if seed is None else seed + 3)
    expected = alone.reset() if seed is None else alone.reset(seed=seed + 3)
    assert_same(one_world((observation, info), 3), expected)
    for actions in random_actions(30, 5, seed=1):
        one, other = envs.step(actions), undisturbed.step(actions)
        assert_same(some_worlds(one, ~mask), some_worlds(other, ~mask))
        assert_same(one_world(one, 3)[0], alone.step(actions[3])[0])
    assert one[3].tolist() == (~mask).tolist()


# --- state --------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [NEXT_STEP, SAME_STEP])
@pytest.mark.parametrize("env_id", IDS)
def test_a_restored_state_continues_bitwise_identically(env_id, mode):
    envs = make_vec(70, env_id, autoreset_mode=mode, max_episode_steps=EPISODE)
    envs.reset(seed=0)
    actions = random_actions(120, 70, size=envs.single_action_space.shape[0])
    list(steps_of(envs, actions[:EPISODE]))  # in NEXT_STEP mode the next step is a reset
    saved = pickle.loads(pickle.dumps(envs.get_state()))
    expected = list(steps_of(envs, actions[EPISODE:]))
    envs.set_state(saved)
    assert_same(list(steps_of(envs, actions[EPISODE:])), expected)


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
@pytest.mark.parametrize("env_id", IDS)
def test_a_copy_continues_bitwise_identically(env_id, clone):
    envs = make_vec(130, env_id, threads=2)
    envs.reset(seed=0)
    actions = random_actions(60, 130, size=envs.single_action_space.shape[0])
    list(steps_of(envs, actions[:20]))
    twin = clone(envs)
    expected = list(steps_of(envs, actions[20:]))
    assert_same(list(steps_of(twin, actions[20:])), expected)


@pytest.mark.parametrize("env_id", [PUSH, THROW])
def test_the_task_guide_is_appended_to_the_observation(env_id):
    kwargs = {"randomize": {"mass": (0.5, 2.0)}, "observe_parameters": True}
    plain, envs = (
        make_vec(7, env_id, observe_task_guide=guide, **kwargs) for guide in (False, True)
    )
    before, (observation, _) = plain.reset(seed=0)[0], envs.reset(seed=0)
    split = before["observation"].shape[1]
    np.testing.assert_array_equal(observation["observation"][:, :split], before["observation"])
    to_go = observation["desired_goal"] - observation["achieved_goal"]
    np.testing.assert_array_equal(observation["observation"][:, split:], to_go)
    single = make(env_id, observe_task_guide=True, **kwargs)
    assert single.observation_space == envs.single_observation_space
    assert envs.observation_space.contains(observation)
    with pytest.raises(TypeError, match="observe_task_guide must be"):
        make(env_id, observe_task_guide="yes")
