"""The number of threads of environments that are made for training."""

import pytest

from training.settings.environments import environment_threads, make_vector_env

REACH = "RigidEnvs/Reach-v0"


def threads_of(envs) -> int:
    try:
        return envs.unwrapped.runner.world.threads
    finally:
        envs.close()


def test_environments_get_the_number_of_threads_of_their_surroundings():
    outside = threads_of(make_vector_env(REACH, 16))
    with environment_threads(outside + 1):
        assert threads_of(make_vector_env(REACH, 16)) == outside + 1
        with environment_threads(1):
            assert threads_of(make_vector_env(REACH, 16)) == 1
        assert threads_of(make_vector_env(REACH, 16, threads=3)) == 3  # the user's own
    assert threads_of(make_vector_env(REACH, 16)) == outside


def test_an_environment_of_others_is_left_as_it_is(reach):
    with environment_threads(1):
        make_vector_env(reach, 2).close()


def test_the_number_is_restored_after_an_error():
    outside = threads_of(make_vector_env(REACH, 16))
    with pytest.raises(RuntimeError), environment_threads(outside + 1):
        raise RuntimeError
    assert threads_of(make_vector_env(REACH, 16)) == outside
