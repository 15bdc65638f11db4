"""Unknown arguments raise an error that says where they belong."""

import inspect
import re

import gymnasium as gym
import pytest

from rigid_envs import RigidEnv, RigidVectorEnv, Runner
from rigid_envs.episodes.arguments import SINGLE_ARGUMENTS, VECTOR_ARGUMENTS, argument_names
from rigid_envs.tasks import Push
from tests.rigid_envs.rollout import IDS, PUSH, STACK, make, make_vec


def test_the_lists_of_arguments_match_the_signatures():
    """Arguments that Gymnasium's functions use themselves count as those of the kind they make."""
    functions = [set(inspect.signature(f).parameters) for f in (gym.make, gym.make_vec)]
    single, vector = (
        set(argument_names(kind)) | function
        for kind, function in zip((RigidEnv, RigidVectorEnv), functions, strict=True)
    )
    assert vector - single == set(VECTOR_ARGUMENTS)
    assert single - vector == set(SINGLE_ARGUMENTS)


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("name", VECTOR_ARGUMENTS)
def test_a_vector_argument_raises_for_a_single_environment(env_id, name):
    message = f"argument {name!r} belongs to native vector environments: pass it to gym.make_vec"
    with pytest.raises(TypeError, match=re.escape(message)):
        make(env_id, **{name: 2})
    with pytest.raises(TypeError, match=re.escape(message)):
        RigidEnv("push", **{name: 2})


@pytest.mark.parametrize("name", SINGLE_ARGUMENTS)
def test_a_single_argument_raises_for_vectors(name):
    message = f"argument {name!r} belongs to single environments: pass it to gym.make, not to"
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
            "did you mean 'blocks'? "
            "Stack accepts ['blocks', 'partial_tower_start_prob', 'near_grasp_start_prob'], "
            "every task accepts ['",
        ),
        (PUSH, "blocks", "Push accepts ['target_yaw', 'obstacles', 'block'], every"),
        (PUSH, "blocks", "unknown argument 'blocks': it belongs to Stack; Push accepts"),
        (PUSH, "count", "unknown argument 'count'"),  # an argument of the runner only
    ],
)
@pytest.mark.parametrize("build", [make, lambda env_id, **kwargs: make_vec(2, env_id, **kwargs)])
def test_an_unknown_argument_names_the_nearest_known_one(build, env_id, argument, message):
    with pytest.raises(TypeError, match=re.escape(message)):
        build(env_id, **{argument: 1})


def test_a_task_object_accepts_no_arguments():
    with pytest.raises(TypeError, match="unknown argument 'obstacles': task is a Push object"):
        RigidEnv(Push(), obstacles=1)
    with pytest.raises(TypeError, match="unknown argument 'obstacles'"):
        Runner(Push(), 1, obstacles=1)


def test_a_task_may_use_the_names_of_the_runners_arguments():
    class Counting(Push):
        def __init__(self, count: int) -> None:
            super().__init__()
            self.number = count

    assert RigidEnv(Counting, count=3).task.number == 3
    assert RigidVectorEnv(Counting, 2, count=4)._runner.task.number == 4
