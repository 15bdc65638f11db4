"""The registered ids, their rewards and the length of their episodes."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest

import rigid_envs
from rigid_envs import RigidEnv, RigidVectorEnv, Runner
from rigid_envs.registration import NAMES, TWIN_NAMES, register
from rigid_envs.tasks import TASKS, Push
from tests.rigid_envs.rollout import DENSE_IDS, IDS, PUSH, STACK, assert_same, make, make_vec

STEPS = {
    "pick_and_place": 50,
    "push": 50,
    "push_t": 100,
    "reach": 25,
    "slide": 50,
    "stack": 100,
    "throw": 50,
}


def steps_of_an_episode(env, limit=250):
    """Steps until an episode is truncated; None if it is not within the limit."""
    env.reset(seed=0)
    many = isinstance(env, gym.vector.VectorEnv)
    actions = np.zeros(env.action_space.shape, dtype=np.float32)
    for step in range(1, limit + 1):
        truncated = env.step(actions)[3]
        if truncated.all() if many else truncated:
            return step
    return None


class Short(Push):
    """A custom task."""

    max_episode_steps = 3


@pytest.fixture
def custom_ids():
    """Ids of a custom task: with the arguments in the documentation, and with its own length."""
    ids = {"Custom/Short-v0": {"task": Short}, "Custom/Explicit-v0": {"task": Short}}
    ids["Custom/Explicit-v0"]["max_episode_steps"] = 6
    for env_id, kwargs in ids.items():
        gym.register(
            env_id,
            entry_point="rigid_envs:RigidEnv",
            vector_entry_point="rigid_envs:RigidVectorEnv",
            max_episode_steps=Short.max_episode_steps,
            kwargs=kwargs,
        )
    yield list(ids)
    for env_id in ids:
        del gym.registry[env_id]


def test_ids_are_registered_and_registering_again_changes_nothing():
    specs = {env_id: gym.registry[env_id] for env_id in gym.registry if env_id[:5] == "Rigid"}
    twins = {f"RigidEnvs/{name}{kind}-v0" for name in TWIN_NAMES for kind in ("", "Dense")}
    assert set(specs) == {*IDS, *DENSE_IDS, *twins}
    register()
    gym.register_envs(rigid_envs)
    assert all(gym.registry[env_id] is spec for env_id, spec in specs.items())


@pytest.mark.parametrize(("sparse_id", "dense_id"), list(zip(IDS, DENSE_IDS, strict=True)))
def test_a_dense_id_is_the_sparse_id_with_the_dense_reward(sparse_id, dense_id):
    dense, same, sparse, other = (
        make_vec(3, dense_id),
        make_vec(3, sparse_id, reward_type="dense"),
        make_vec(3, sparse_id),
        make_vec(3, dense_id, reward_type="sparse"),
    )
    actions = np.ones(dense.action_space.shape, dtype=np.float32)
    for one, twin in ((dense, same), (sparse, other)):
        assert_same(one.reset(seed=1), twin.reset(seed=1))
        assert_same(one.step(actions), twin.step(actions))
    single = make(dense_id)
    single.reset(seed=1), dense.reset(seed=1)
    assert single.step(actions[0])[1] == dense.step(actions)[1][0]
    assert gym.spec(dense_id).max_episode_steps == gym.spec(sparse_id).max_episode_steps


@pytest.mark.parametrize(("name", "task"), NAMES.items())
def test_an_episode_has_the_length_of_its_task_however_it_is_made(name, task):
    env_id, steps = f"RigidEnvs/{name}-v0", STEPS[task]
    assert TASKS[task].max_episode_steps == gym.spec(env_id).max_episode_steps == steps
    assert steps_of_an_episode(RigidEnv(task)) == steps
    assert steps_of_an_episode(RigidEnv(TASKS[task]())) == steps
    assert steps_of_an_episode(RigidVectorEnv(task, 2)) == steps
    assert steps_of_an_episode(gym.make(env_id)) == steps
    assert steps_of_an_episode(make_vec(2, env_id)) == steps
    assert steps_of_an_episode(make_vec(2, env_id, vectorization_mode="sync")) == steps
    assert Runner(task, 1).max_episode_steps == steps


@pytest.mark.parametrize("steps", [7, 110])
def test_max_episode_steps_replaces_the_length_of_the_task(steps):
    kwargs = {"max_episode_steps": steps}
    for env in (
        RigidEnv("stack", **kwargs),
        RigidVectorEnv("stack", 2, **kwargs),
        gym.make(STACK, **kwargs),
        make_vec(2, STACK, **kwargs),
        make_vec(2, STACK, vectorization_mode="sync", **kwargs),
    ):
        assert steps_of_an_episode(env) == steps


def test_an_episode_without_a_limit_is_never_truncated():
    kwargs = {"max_episode_steps": -1}
    for env in (
        RigidEnv(**kwargs),
        RigidVectorEnv(num_envs=2, **kwargs),
        gym.make(PUSH, **kwargs),
        make_vec(2, **kwargs),
    ):
        assert steps_of_an_episode(env) is None


def test_none_is_the_length_of_the_task():
    for env in (
        gym.make(STACK, max_episode_steps=None),
        make_vec(2, STACK, max_episode_steps=None),
    ):
        assert steps_of_an_episode(env) == 100


def test_the_environment_inside_gym_make_has_no_limit_of_its_own():
    assert steps_of_an_episode(make()) is None
    assert steps_of_an_episode(make_vec(1, vectorization_mode="sync").envs[0].unwrapped) is None


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_copies_keep_the_length(clone):
    assert steps_of_an_episode(clone(gym.make(PUSH, max_episode_steps=60))) == 60
    assert steps_of_an_episode(clone(RigidEnv())) == 50
    assert clone(gym.make(PUSH)).spec.id == PUSH


def test_a_custom_task_has_its_own_length(custom_ids):
    short, explicit = custom_ids
    assert steps_of_an_episode(RigidEnv(Short)) == 3
    assert steps_of_an_episode(RigidVectorEnv(Short, 2)) == 3
    for env_id, steps in ((short, 3), (explicit, 6)):
        assert steps_of_an_episode(make_vec(2, env_id)) == steps
    assert steps_of_an_episode(gym.make(short)) == 3
    assert steps_of_an_episode(gym.make(short, max_episode_steps=5)) == 5
    assert steps_of_an_episode(make(short)) is None
    assert steps_of_an_episode(make(explicit)) == 6


def test_an_invalid_length_of_a_task_is_named():
    class Endless(Push):
        max_episode_steps = 0

    with pytest.raises(ValueError, match=r"Endless\.max_episode_steps must be at least 1, or -1"):
        RigidEnv(Endless)
