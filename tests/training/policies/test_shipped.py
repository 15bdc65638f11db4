"""Policies that come with the package."""

from dataclasses import replace

import pytest

from rigid_envs import RigidEnv
from rigid_envs.episodes.runner import Runner
from rigid_envs.registration import NAMES
from training.commands import cli
from training.policies.policy_file import read_policy
from training.policies.trained_policy import shipped_policy
from training.results.evaluate import evaluate
from training.results.video import record
from training.settings.data_folders import data_folder
from training.settings.errors import UsageError

KINDS = ("", "Dense")


@pytest.mark.parametrize(
    "env_id", [f"RigidEnvs/{name}{kind}-v0" for name in NAMES for kind in KINDS]
)
def test_each_task_has_one(env_id):
    policy = shipped_policy(env_id)
    assert policy.env_id == env_id
    assert policy.folder is None


def test_another_environment_has_none_and_the_message_says_which_do():
    with pytest.raises(
        UsageError, match=r"comes with the package; there are .*RigidEnvs/PickAndPlace-v0, "
    ) as e:
        shipped_policy("RigidEnvs/Pull-v0")
    for env_id in str(e.value).partition("there are ")[2].split(", "):
        assert shipped_policy(env_id).env_id == env_id


def test_it_is_evaluated_by_name(capsys):
    words = ["evaluate", "trained", "--env", "RigidEnvs/Push-v0", "-n", "50"]
    assert cli.main(words) == 0
    assert "trained-Push-v0" in capsys.readouterr().out


def view_of(policy):
    pytest.importorskip("viser", reason="no viser")
    from training.commands.view import serve

    serve(policy.env_id, policy, num_worlds=1, seed=0, host="127.0.0.1", port=0)


PLAYS = {
    "evaluate": lambda policy, _: evaluate(policy, 4),
    "record": lambda policy, folder: record(policy, folder / "film.gif", episodes=1),
    "view": lambda policy, _: view_of(policy),
}


@pytest.mark.parametrize("play", PLAYS)
def test_a_policy_of_another_task_is_refused_before_anything_is_compiled(
    play, tmp_path, monkeypatch
):
    policy = replace(shipped_policy("RigidEnvs/Push-v0"), env_id="RigidEnvs/Stack-v0")

    def fail(*_):
        raise AssertionError("an episode was started")

    monkeypatch.setattr(Runner, "reset", fail)
    with pytest.raises(UsageError, match=r"requires observations of shapes .*\(22,\).*\(43,\)"):
        PLAYS[play](policy, tmp_path)


def test_a_policy_of_the_state_acts_beside_pixels():
    policy = shipped_policy("RigidEnvs/Push-v0")
    both = RigidEnv("push", obs_type="pixels+state").observation_space
    policy.check(both)
    with pytest.raises(UsageError, match="requires observations"):
        policy.check(RigidEnv("push", obs_type="pixels").observation_space)
    with pytest.raises(UsageError, match="requires observations"):
        policy.check(RigidEnv("push", obs_type="flat").observation_space)


def test_a_policy_of_another_task_with_the_same_observations_is_refused():
    """Push and Slide observe 22 numbers each; a dense id is the same task."""
    path = data_folder("shipped", "results") / "ppo/RigidEnvs-Push-v0_seed0/policy.safetensors"
    with pytest.raises(UsageError, match="trained on RigidEnvs/Push-v0, which is another task"):
        read_policy(path, env_id="RigidEnvs/Slide-v0")
    assert read_policy(path, env_id="RigidEnvs/PushDense-v0").env_id == "RigidEnvs/PushDense-v0"
