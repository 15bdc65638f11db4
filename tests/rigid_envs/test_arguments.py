"""Arguments that an environment doesn't take are named, and where they belong."""

import inspect
import re

import gymnasium as gym
import pytest

from rigid_envs import RigidEnv, RigidVectorEnv, Runner
from rigid_envs.episodes.arguments import OF_SINGLES, OF_VECTORS, words
from rigid_envs.tasks import Push
from tests.rigid_envs.rollout import IDS, PUSH, STACK, make, make_vec


def test_the_words_of_one_kind_are_those_that_the_other_does_not_take():
    """And those that Gymnasium's functions take by themselves, which they don't hand on."""
    functions = [set(inspect.signature(f).parameters) for f in (gym.make, gym.make_vec)]
    single, vector = (
        set(words(kind)) | function
        for kind, function in zip((RigidEnv, RigidVectorEnv), functions, strict=True)
    )
    assert vector - single == set(OF_VECTORS)
    assert single - vector == set(OF_SINGLES)


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("name", OF_VECTORS)
def test_what_only_vectors_take_is_refused_for_a_single_environment(env_id, name):
    message = f"argument {name!r} belongs to native vector environments: give it to gym.make_vec"
    with pytest.raises(TypeError, match=re.escape(message)):
        make(env_id, **{name: 2})
    with pytest.raises(TypeError, match=re.escape(message)):
        RigidEnv("push", **{name: 2})


@pytest.mark.parametrize("name", OF_SINGLES)
def test_what_only_single_environments_take_is_refused_for_vectors(name):
    message = f"argument {name!r} belongs to single environments: give it to gym.make alone"
    with pytest.raises(TypeError, match=re.escape(message)):
        make_vec(2, **{name: True})


@pytest.mark.parametrize(
    ("env_id", "argument", "message"),
    [
        (PUSH, "rewardtype", "did you mean 'reward_type'?"),
        (PUSH, "obstacle", "did you mean 'obstacles'?"),
        (
            STACK,
            "bloks",
            "of its own, Stack has ['blocks', 'begun', 'at_hand']; did you mean 'blocks'?",
        ),
        (PUSH, "blocks", "of its own, Push has ['target_yaw', 'obstacles', 'block']"),
        (PUSH, "count", "unknown argument 'count'"),  # which the runner inside has
    ],
)
@pytest.mark.parametrize("build", [make, lambda env_id, **words: make_vec(2, env_id, **words)])
def test_an_unknown_argument_is_told_the_nearest(build, env_id, argument, message):
    with pytest.raises(TypeError, match=re.escape(message)):
        build(env_id, **{argument: 1})


def test_a_task_that_is_made_takes_no_arguments():
    with pytest.raises(TypeError, match="unknown argument 'obstacles': of its own, Push has none"):
        RigidEnv(Push(), obstacles=1)
    with pytest.raises(TypeError, match="unknown argument 'obstacles'"):
        Runner(Push(), 1, obstacles=1)


def test_a_task_may_name_its_arguments_as_the_runner_does():
    class Counting(Push):
        def __init__(self, count: int) -> None:
            super().__init__()
            self.seen = count

    assert RigidEnv(Counting, count=3).task.seen == 3
    assert RigidVectorEnv(Counting, 2, count=4)._runner.task.seen == 4
