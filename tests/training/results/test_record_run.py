"""Recording finished runs: what a result contains, and which runs are rejected."""

import csv
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from tests.training.results.recorded import PLACE, change, update
from training.policies.policy import Policy
from training.policies.policy_file import load_policy_file, read_policy
from training.results.evaluate import Evaluation, evaluate
from training.results.record_run import ROWS, _command, _in_original
from training.results.result import read_result, read_results
from training.results.results_page import check_pages
from training.runs.run_folder import RunFolder
from training.sb3.model_state import read_state
from training.settings.config_file import load_config
from training.settings.errors import UsageError
from training.settings.seed_ranges import EVALUATION, ORIGINAL


def test_a_twins_policy_is_evaluated_in_its_original(monkeypatch):
    outcome = Evaluation(*np.zeros((4, 10)), 1.0, EVALUATION, None, {})
    outcome.success_at_end[:3] = 1.0

    def play(policy, env_id, episodes, *, seed):
        assert (env_id, episodes, seed) == ("PandaPush-v3", 10, ORIGINAL)
        return replace(policy, env_id=env_id), outcome, {"pybullet": "3.2.7"}

    monkeypatch.setattr("training.results.record_run.evaluate_original", play)
    policy = Policy(lambda observation: np.zeros((1, 3)), "RigidEnvs/PandaPushDense-v0", "still")
    found = _in_original(policy, 10)
    assert (found["env_id"], found["first_seed"]) == ("PandaPush-v3", ORIGINAL)
    assert found["versions"] == {"pybullet": "3.2.7"}
    assert found["success_at_end"]["rate"] == 0.3
    assert _in_original(replace(policy, env_id="RigidEnvs/Push-v0"), 10) is None


def test_result_contains_what_is_needed_to_judge_and_repeat_the_run(repository, runs, reach):
    lines = update(repository, log_folder=runs)
    verbs = [line.split()[0] for line in lines]
    assert verbs == ["recorded", "recorded", "plotted", "video", *["written"] * 3]
    place = repository / PLACE
    assert {file.name for file in place.iterdir()} == {
        "result.json",
        "config.yaml",
        "progress.csv",
        "policy.safetensors",
    }
    result = read_result(place / "result.json")
    state = read_state(RunFolder(runs / "ppo" / "Test-Reach-v0_1").checkpoint)
    assert (result.algorithm, result.env_id, result.seed) == ("ppo", reach, 3)
    assert result.arguments == {"reward_type": "dense"}
    assert (result.steps, result.episodes, result.first_seed) == (160, 20, EVALUATION)
    assert result.seconds == pytest.approx(state["seconds"], abs=1e-3)
    fraction = state["seconds_in_envs"] / state["seconds"]
    assert result.environment_time_fraction == pytest.approx(fraction, abs=1e-4)
    assert result.versions["stable-baselines3"]
    assert load_config("ppo", reach, place / "config.yaml").seed == 3
    assert result.command == (
        f"rigid-envs train --algo ppo --env {reach} --config {PLACE.as_posix()}/config.yaml"
    )
    outcome = evaluate(read_policy(place / "policy.safetensors"), 20, quiet=True)
    assert result.success_at_end["rate"] == outcome.success_at_end.mean()
    header = load_policy_file(place / "policy.safetensors").header
    assert header.success is not None
    assert header.success.rate == result.success_at_end["rate"]
    check_pages(repository)


def test_recorded_runs_are_not_recorded_again(repository, runs):
    update(repository, log_folder=runs)
    before = (repository / PLACE / "result.json").read_bytes()
    lines = update(repository, log_folder=runs)
    assert all("the run is recorded already, in results/ppo" in line for line in lines)
    assert len(lines) == 2
    assert (repository / PLACE / "result.json").read_bytes() == before


def test_another_run_with_the_same_seed_needs_replace(repository, runs):
    first = runs / "ppo" / "Test-Reach-v0_1"
    update(repository, first)
    description = json.loads((first / "run.json").read_text())
    (first / "run.json").write_text(json.dumps({**description, "started": "later"}))
    (line,) = update(repository, first)
    assert "is another run with the same seed" in line
    assert f"rigid-envs results --replace {first}" in line
    assert read_result(repository / PLACE / "result.json").started != "later"
    lines = update(repository, first, replace=True)
    assert lines[0].startswith("recorded")
    assert read_result(repository / PLACE / "result.json").started == "later"
    with pytest.raises(UsageError, match="--replace requires run folders"):
        update(repository, log_folder=runs, replace=True)


def unfinished(run: RunFolder) -> None:
    change(run.checkpoint / "state.json", finished=False)


def enlarge(run: RunFolder) -> None:
    with run.policy.open("ab") as file:
        file.write(b"\0" * 300_000)


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (unfinished, "the run is not finished; to finish it: rigid-envs train --resume"),
        (lambda run: shutil.rmtree(run.checkpoint), "the run has no checkpoint yet"),
        (lambda run: (run.path / "run.json").unlink(), "is not a run folder: run.json is missing"),
        (lambda run: (run.path / "run.json").write_text("{"), "run.json is damaged"),
        (lambda run: (run.path / "run.json").write_text("[]"), "run.json is damaged"),
        (lambda run: (run.path / "versions.json").unlink(), "versions.json is damaged"),
        (lambda run: (run.path / "versions.json").write_text("3"), "versions.json is damaged"),
        (lambda run: (run.path / "config.yaml").unlink(), "config.yaml does not exist"),
        (lambda run: (run.path / "progress.csv").unlink(), "progress.csv is missing"),
        (lambda run: run.policy.unlink(), "policy.safetensors is missing"),
        (lambda run: run.policy.write_bytes(b"no"), "is not a policy file"),
        (enlarge, "bytes, should have at most 300,000"),
        (lambda run: (run.checkpoint / "state.json").write_text("{}"), "state.json is damaged"),
        (lambda run: (run.checkpoint / "state.json").write_text("[]"), "state.json is damaged"),
        (
            lambda run: change(run.checkpoint / "state.json", seconds_in_envs=None),
            "the run did not record the time spent in the environments",
        ),
        (
            lambda run: change(run.checkpoint / "state.json", seconds_in_envs=1e9),
            "state.json is damaged: seconds_in_envs is 1000000000.0 of",
        ),
        (lambda run: change(run.checkpoint / "state.json", seconds=0), "state.json is damaged"),
        (lambda run: change(run.checkpoint / "state.json", steps="many"), "steps is 'many'"),
        (lambda run: change(run.path / "run.json", started=None), "started is None"),
        (lambda run: change(run.path / "run.json", git_commit=7), "git_commit|commit is 7"),
        (lambda run: change(run.path / "run.json", resumed="often"), "resumed is 'often'"),
        (lambda run: change(run.path / "run.json", seed=5), "seed is 5, but config.yaml has 3"),
    ],
)
@pytest.mark.usefixtures("without_images")
def test_runs_that_cannot_be_recorded_are_skipped_with_a_reason(
    repository, runs, damage, complaint
):
    damage(RunFolder(runs / "ppo" / "Test-Reach-v0_1"))
    lines = update(repository, log_folder=runs)
    assert lines[0].startswith(f"skipped  {runs / 'ppo' / 'Test-Reach-v0_1'}: ")
    assert any(part in lines[0] for part in complaint.split("|"))
    assert "\n" not in lines[0]
    assert lines[1].startswith("recorded")
    assert [result.seed for result in read_results(repository)] == [4]
    assert not list((repository / "results").glob("**/*.tmp"))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"env_kwargs": {"reward_type": "sparse"}}, "its env_kwargs is {'reward_type': 'sparse'}"),
        ({"gamma": 0.5}, "its gamma is 0.5"),
    ],
)
def test_runs_with_other_settings_are_skipped(repository, runs, quick_ppo, change, complaint):
    first, second = sorted((runs / "ppo").iterdir())
    update(repository, first)
    (second / "config.yaml").write_text(quick_ppo.replace(seed=4, **change).as_yaml())
    (line,) = update(repository, second)
    assert f"{complaint}, but results/ppo/Test-Reach-v0_seed3, in the same table, has" in line
    assert [result.seed for result in read_results(repository)] == [3]


def test_same_seed_with_other_settings_does_not_suggest_replace(repository, runs, quick_ppo):
    first = sorted((runs / "ppo").iterdir())[0]
    update(repository, first)
    (first / "config.yaml").write_text(quick_ppo.replace(gamma=0.5).as_yaml())
    change(first / "run.json", started="2026-01-01T00:00:00+00:00")
    (line,) = update(repository, first)
    assert "its gamma is 0.5" in line
    assert "--replace" not in line


def test_command_is_the_shortest_that_repeats_the_training():
    config = load_config("ppo", "RigidEnvs/Push-v0")
    words = "rigid-envs train --algo ppo --env RigidEnvs/Push-v0"
    assert _command(config.replace(seed=7)) == f"{words} --seed 7"
    assert _command(config.replace(seed=7, n_timesteps=1000)) == f"{words} --seed 7 -n 1000"
    stack = load_config("ppo", "RigidEnvs/Stack-v0").replace(seed=7)
    assert _command(stack.with_steps(9_000_000)).endswith("Stack-v0 --seed 7 -n 9000000")
    assert "--config" in _command(stack.replace(n_timesteps=9_000_000))
    assert _command(config.replace(seed=7, gamma=0.5)) == (
        f"{words} --config results/ppo/RigidEnvs-Push-v0_seed7/config.yaml"
    )
    dense = load_config("ppo", "RigidEnvs/PushDense-v0").replace(seed=7)
    assert _command(dense) == "rigid-envs train --algo ppo --env RigidEnvs/PushDense-v0 --seed 7"


@pytest.mark.parametrize("option", [["--num-threads", "1"], ["--num-threads=1"]])
def test_command_contains_the_number_of_threads(repository, runs, option):
    first = sorted((runs / "ppo").iterdir())[0]
    change(first / "run.json", command=["rigid-envs", "train", *option, "--seed", "3"])
    update(repository, first)
    assert read_results(repository)[0].command.endswith("--num-threads 1")


def test_long_learning_curve_keeps_its_first_and_last_row(repository, runs):
    run = runs / "ppo" / "Test-Reach-v0_1"
    header = "rollout/success_rate,time/total_timesteps,time/wall_time,train/loss\n"
    rows = "".join(f"0.5,{80 * n},{n},0.1\n" for n in range(1, 1001))
    (run / "progress.csv").write_text(header + rows)
    update(repository, run)
    with (repository / PLACE / "progress.csv").open() as file:
        recorded = list(csv.DictReader(file))
    assert len(recorded) == ROWS
    assert (recorded[0]["time/wall_time"], recorded[-1]["time/wall_time"]) == ("1", "1000")
    assert "train/loss" not in recorded[0]
