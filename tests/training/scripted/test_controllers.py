"""Scripted controllers: found by task, and they solve nearly all episodes."""

import pytest

from rigid_envs.registration import NAMES
from training.policies.policy import scripted_policy
from training.results.evaluate import evaluate
from training.scripted import CONTROLLERS, controller_for
from training.settings.errors import UsageError


def test_all_ids_of_a_task_have_the_same_controller():
    ids = [f"RigidEnvs/{name}{kind}-v0" for name in NAMES for kind in ("", "Dense")]
    assert {controller_for(env_id) for env_id in ids} == set(CONTROLLERS.values())
    for task in ("Push", "Stack", "Throw"):
        found = controller_for(f"RigidEnvs/{task}Dense-v0")
        assert found is controller_for(f"RigidEnvs/{task}-v0") is CONTROLLERS[task.lower()]


def test_environment_without_controller_raises(reach):
    with pytest.raises(UsageError, match=f"no scripted controller for environment '{reach}'"):
        controller_for(reach)


def test_controller_of_push_solves_nearly_all_episodes():
    policy = scripted_policy("RigidEnvs/Push-v0")
    assert evaluate(policy, 100, quiet=True).success_at_end.mean() >= 0.97
