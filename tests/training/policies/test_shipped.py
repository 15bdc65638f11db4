"""Policies that come with the package."""

import gymnasium as gym
import pytest

import rigid_envs  # noqa: F401  (registers the environments)
from training.commands import cli
from training.policies.trained_policy import shipped_policy
from training.settings.errors import UsageError


@pytest.mark.parametrize("env_id", [name for name in gym.registry if name.startswith("RigidEnvs/")])
def test_each_task_has_one(env_id):
    policy = shipped_policy(env_id)
    assert policy.env_id == env_id
    assert policy.folder is None


def test_another_environment_has_none_and_the_message_says_which_do():
    with pytest.raises(
        UsageError, match=r"comes with the package; there are RigidEnvs/Push-v0, "
    ) as e:
        shipped_policy("RigidEnvs/Pull-v0")
    for env_id in str(e.value).partition("there are ")[2].split(", "):
        assert shipped_policy(env_id).env_id == env_id


def test_it_is_evaluated_by_name(capsys):
    words = ["evaluate", "trained", "--env", "RigidEnvs/Push-v0", "-n", "50"]
    assert cli.main(words) == 0
    assert "trained-Push-v0" in capsys.readouterr().out
