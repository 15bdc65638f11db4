"""Result files: invalid fields are named; names of tasks; the shipped policies act."""

import json

import pytest

from tests.training.results.recorded import PLACE, change, update
from training.policies.policy_file import read_policy
from training.results.evaluate import evaluate
from training.results.result import read_results
from training.results.results import SOURCE
from training.settings.errors import UsageError
from training.settings.seed_ranges import EVALUATION
from training.settings.tasks import task_name


def test_shipped_policies_are_small_and_as_good_as_recorded(stress):
    """Of the policies of a task and an algorithm one is played, with `make stress` all are."""
    played = set()
    for result in read_results(SOURCE):
        file = result.folder(SOURCE) / "policy.safetensors"
        assert file.stat().st_size <= 300_000
        if stress or result.kind not in played:
            played.add(result.kind)
            outcome = evaluate(read_policy(file), 100, seed=EVALUATION, quiet=True)
            assert outcome.success_at_end.mean() >= result.success_at_end["low"] - 0.1, file


def test_other_arguments_make_another_table(repository, runs, quick_ppo):
    first, second = sorted((runs / "ppo").iterdir())
    update(repository, first)
    shorter = quick_ppo.replace(
        seed=4, env_kwargs={"reward_type": "sparse", "max_episode_steps": 5}
    )
    (second / "config.yaml").write_text(shorter.as_yaml())
    assert update(repository, second)[0].startswith("recorded")
    tasks = [result.task for result in read_results(repository)]
    assert tasks == ["Test-Reach-v0", "Test-Reach-v0-max_episode_steps-5"]
    page = (repository / "docs/results.md").read_text()
    assert page.count("## Test/Reach-v0, PPO\n") == 1
    assert page.count("## Test/Reach-v0 with max_episode_steps=5, PPO\n") == 1


def test_names_of_tasks_contain_the_arguments_that_change_the_task():
    arguments = {"randomize": {"size": [0.8, 1.2]}, "fidelity": "fast", "block": "T"}
    name = task_name("RigidEnvs/Push-v0", arguments)
    assert name == "RigidEnvs-Push-v0-block-T-randomize-size-0.8-1.2"
    # neither what is observed nor an argument that is 0 changes the task
    arguments = {"observe_task_guide": True, "partial_tower_start_prob": 0.0, "obstacles": 0}
    assert task_name("RigidEnvs/Stack-v0", arguments) == "RigidEnvs-Stack-v0"
    assert task_name("RigidEnvs/Stack-v0", {"max_episode_steps": 100}) == "RigidEnvs-Stack-v0"
    assert (
        task_name("RigidEnvs/Stack-v0", {"partial_tower_start_prob": 0.5})
        == "RigidEnvs-Stack-v0-partial_tower_start_prob-0.5"
    )


def test_a_task_from_pixels_is_another_one_whatever_the_picture():
    arguments = {"obs_type": "pixels", "pixel_size": 48, "camera": "top"}
    assert task_name("RigidEnvs/Push-v0", arguments) == "RigidEnvs-Push-v0-obs_type-pixels"


def test_dense_id_is_the_same_task():
    arguments = {"reward_type": "dense", "max_episode_steps": 50}
    assert task_name("RigidEnvs/PushDense-v0", arguments) == "RigidEnvs-Push-v0"


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"seeed": 3}, "unknown field 'seeed'; did you mean 'seed'"),
        ({"seed": -1}, "seed is -1, should be an integer of at least 0"),
        ({"algorithm": "pp0"}, "did you mean 'ppo'"),
        ({"env_id": ""}, "env_id is '', should be text"),
        ({"arguments": []}, "arguments is .*, should be a mapping"),
        ({"steps": 0}, "steps is 0"),
        ({"seconds": 0}, "seconds is 0"),
        ({"environment_time_fraction": 1.1}, "environment_time_fraction is 1.1"),
        ({"episodes": 0}, "episodes is 0"),
        ({"first_seed": None}, "first_seed is None"),
        ({"fidelity": 3}, "fidelity is 3, should be text, or null"),
        ({"success_at_end": {"rate": 1.0}}, "success_at_end is .*low, rate and high"),
        ({"success_at_any_time": {"low": 0.5, "rate": 0.4, "high": 1}}, "ascending order"),
        ({"command": 1}, "command is 1"),
        ({"commit": ""}, "commit is ''"),
        ({"resumed": -1}, "resumed is -1"),
        ({"started": None}, "started is None"),
        ({"versions": "new"}, "versions is 'new'"),
    ],
)
@pytest.mark.usefixtures("without_images")
def test_invalid_fields_are_named(repository, runs, changes, complaint):
    update(repository, runs / "ppo" / "Test-Reach-v0_1")
    file = repository / PLACE / "result.json"
    change(file, **changes)
    with pytest.raises(UsageError, match=rf"result\.json: .*{complaint}"):
        update(repository)


def test_damaged_or_misplaced_results_raise(repository, runs):
    update(repository, runs / "ppo" / "Test-Reach-v0_1")
    file = repository / PLACE / "result.json"
    values = json.loads(file.read_text())
    for content, complaint in (
        ("{", "is not JSON"),
        ("[]", "should be a mapping"),
        (json.dumps({k: v for k, v in values.items() if k != "steps"}), "steps is missing"),
        (json.dumps({**values, "seed": 7}), "should be in .*_seed7"),
    ):
        file.write_text(content)
        with pytest.raises(UsageError, match=complaint):
            update(repository)
