"""Recorded runs: what is kept of them, and the texts that are made of it alone."""

import csv
import json
import shutil
from pathlib import Path

import pytest
from PIL import Image

from training.commands import cli
from training.policies.policy_file import load_policy_file, read_policy
from training.results.evaluate import FIRST_SEED, evaluate
from training.results.recording import ROWS, _command
from training.results.result import read_result, read_results, task_name
from training.results.results import SOURCE, update_results
from training.results.results_page import README, check_pages
from training.runs.run_folder import RunFolder
from training.sb3.model_state import read_state
from training.sb3.train import train
from training.settings.config import TrainConfig, load_config
from training.settings.errors import UsageError

PLACE = Path("results/ppo/Test-Reach-v0_seed3")


@pytest.fixture
def repository(tmp_path) -> Path:
    """A clone without results."""
    (tmp_path / "clone" / "docs").mkdir(parents=True)
    text = "# name\n<!-- results -->\nold\n<!-- /results -->\nmore\n"
    (tmp_path / "clone" / README).write_text(text)
    return tmp_path / "clone"


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished run of PPO, trained once; to be copied before it is harmed."""
    kept: dict[int, Path] = {}

    def run(config: TrainConfig) -> Path:
        if config.seed not in kept:
            folder = tmp_path_factory.mktemp("runs")
            kept[config.seed or 0] = train(config, folder, quiet=True).folder.path
        return kept[config.seed or 0]

    return run


@pytest.fixture
def runs(tmp_path, quick_ppo, finished) -> Path:
    """A folder of two finished runs, of seeds 3 and 4."""
    for number, seed in ((1, 3), (2, 4)):
        to = tmp_path / "runs" / "ppo" / f"Test-Reach-v0_{number}"
        shutil.copytree(finished(quick_ppo.replace(seed=seed)), to)
    return tmp_path / "runs"


def update(repository: Path, *runs: Path, **options) -> list[str]:
    said: list[str] = []
    update_results(runs, repository=repository, episodes=20, quiet=True, say=said.append, **options)
    return said


def test_the_pages_are_those_of_the_recorded_results():
    check_pages(SOURCE)


def test_shipped_policies_are_small_and_act(tmp_path):
    """None may be there yet; each that is must fit the environments of today."""
    for result in read_results(SOURCE):
        file = result.folder(SOURCE) / "policy.policy"
        assert file.stat().st_size <= 300_000
        outcome = evaluate(read_policy(file), 100, seed=FIRST_SEED, quiet=True)
        assert outcome.success_at_end.mean() >= result.success_at_end["low"] - 0.1


def test_a_finished_run_is_recorded_with_all_that_it_takes_to_judge_it(repository, runs, reach):
    said = update(repository, log_folder=runs)
    assert [line.split()[0] for line in said] == ["recorded"] * 2 + ["drawn", "filmed"] + [
        "written"
    ] * 2
    place = repository / PLACE
    assert {file.name for file in place.iterdir()} == {
        "result.json",
        "config.yaml",
        "progress.csv",
        "policy.policy",
    }
    result = read_result(place / "result.json")
    state = read_state(RunFolder(runs / "ppo" / "Test-Reach-v0_1").checkpoint)
    assert (result.algorithm, result.env_id, result.seed) == ("ppo", reach, 3)
    assert result.arguments == {"reward_type": "dense"}
    assert (result.steps, result.episodes, result.first_seed) == (160, 20, FIRST_SEED)
    assert result.seconds == pytest.approx(state["seconds"], abs=1e-3)
    share = state["seconds_in_envs"] / state["seconds"]
    assert result.environment_share == pytest.approx(share, abs=1e-4)
    assert result.versions["stable-baselines3"]
    assert load_config("ppo", reach, place / "config.yaml").seed == 3
    assert result.command == (
        f"rigid-envs train --algo ppo --env {reach} --config {PLACE.as_posix()}/config.yaml"
    )
    outcome = evaluate(read_policy(place / "policy.policy"), 20, quiet=True)
    assert result.success_at_end["rate"] == outcome.success_at_end.mean()
    header = load_policy_file(place / "policy.policy").header
    assert header.success is not None
    assert header.success.rate == result.success_at_end["rate"]
    check_pages(repository)


def test_the_page_and_the_readme_show_every_seed_and_their_mean(repository, runs):
    update(repository, log_folder=runs)
    page = (repository / "docs" / "results.md").read_text()
    assert "## Test/Reach-v0, PPO" in page
    assert page.count("\n| 3 | 160 |") == page.count("\n| 4 | 160 |") == 1
    assert "\n| mean | 160 ± 0 |" in page
    readme = (repository / README).read_text()
    assert readme.startswith("# name\n<!-- results -->\n| environment |")
    assert readme.endswith("<!-- /results -->\nmore\n")
    assert "old" not in readme
    for suffix in ("png", "gif"):
        picture = repository / "docs" / "results" / f"ppo-Test-Reach-v0.{suffix}"
        assert picture.stat().st_size <= 300_000
        assert f"results/{picture.name}" in page
    with Image.open(repository / "docs/results/ppo-Test-Reach-v0.gif") as film:
        assert film.format == "GIF"


def test_nothing_recorded_makes_sensible_pages(repository, tmp_path):
    said = update(repository, log_folder=tmp_path / "nowhere")
    assert said == ["written  docs/results.md", "written  README.md"]
    assert "No run is recorded yet" in (repository / "docs/results.md").read_text()
    assert "No run is recorded yet" in (repository / README).read_text()
    assert update(repository, log_folder=tmp_path / "nowhere") == []


def test_what_is_recorded_already_is_left_alone(repository, runs):
    update(repository, log_folder=runs)
    before = (repository / PLACE / "result.json").read_bytes()
    said = update(repository, log_folder=runs)
    assert all("it is recorded already, in results/ppo" in line for line in said)
    assert len(said) == 2
    assert (repository / PLACE / "result.json").read_bytes() == before


def test_another_run_of_a_seed_replaces_only_when_told(repository, runs):
    first = runs / "ppo" / "Test-Reach-v0_1"
    update(repository, first)
    description = json.loads((first / "run.json").read_text())
    (first / "run.json").write_text(json.dumps({**description, "started": "later"}))
    (said,) = update(repository, first)
    assert "holds another run of its seed" in said
    assert f"rigid-envs results --replace {first}" in said
    assert read_result(repository / PLACE / "result.json").started != "later"
    said = update(repository, first, replace=True)
    assert said[0].startswith("recorded")
    assert read_result(repository / PLACE / "result.json").started == "later"
    with pytest.raises(UsageError, match="--replace takes the run folders"):
        update(repository, log_folder=runs, replace=True)


def test_pictures_follow_even_if_ctrl_c_came_before_them(repository, runs, monkeypatch):
    first, second = sorted((runs / "ppo").iterdir())
    update(repository, first)

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("training.results.results._draw", interrupted)
        with pytest.raises(KeyboardInterrupt):
            update(repository, second)
    said = update(repository, log_folder=runs / "nothing")
    # the film is of the lowest seed, which is as before
    assert [line.split()[0] for line in said] == ["drawn", "written", "written"]


def unfinished(run: RunFolder) -> None:
    change(run.checkpoint / "state.json", finished=False)


def change(file: Path, **values) -> None:
    file.write_text(json.dumps({**json.loads(file.read_text()), **values}))


def grow(run: RunFolder) -> None:
    with run.policy.open("ab") as file:
        file.write(b"\0" * 300_000)


@pytest.mark.parametrize(
    ("harm", "complaint"),
    [
        (unfinished, "it is not finished: rigid-envs train --resume"),
        (lambda run: shutil.rmtree(run.checkpoint), "it has no checkpoint yet"),
        (lambda run: (run.path / "run.json").unlink(), "is no run folder: run.json is missing"),
        (lambda run: (run.path / "run.json").write_text("{"), "run.json is damaged"),
        (lambda run: (run.path / "run.json").write_text("[]"), "run.json is damaged"),
        (lambda run: (run.path / "versions.json").unlink(), "versions.json is damaged"),
        (lambda run: (run.path / "versions.json").write_text("3"), "versions.json is damaged"),
        (lambda run: (run.path / "config.yaml").unlink(), "config.yaml: No such file"),
        (lambda run: (run.path / "progress.csv").unlink(), "progress.csv is missing"),
        (lambda run: run.policy.unlink(), "policy.policy is missing"),
        (lambda run: run.policy.write_bytes(b"no"), "is no policy file"),
        (grow, "bytes, should be at most 300,000"),
        (lambda run: (run.checkpoint / "state.json").write_text("{}"), "state.json is damaged"),
        (lambda run: (run.checkpoint / "state.json").write_text("[]"), "state.json is damaged"),
        (
            lambda run: change(run.checkpoint / "state.json", seconds_in_envs=None),
            "how much of its time the environments took is not known",
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
def test_runs_that_cannot_be_recorded_are_skipped_with_a_reason(
    repository, runs, harm, complaint, request
):
    harm(RunFolder(runs / "ppo" / "Test-Reach-v0_1"))
    said = update(repository, log_folder=runs)
    assert said[0].startswith(f"skipped  {runs / 'ppo' / 'Test-Reach-v0_1'}: ")
    assert any(part in said[0] for part in complaint.split("|"))
    assert "\n" not in said[0]
    assert said[1].startswith("recorded")
    assert [result.seed for result in read_results(repository)] == [4]
    assert not list((repository / "results").glob("**/*.tmp"))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"env_kwargs": {"reward_type": "sparse"}}, "its env_kwargs is {'reward_type': 'sparse'}"),
        ({"gamma": 0.5}, "its gamma is 0.5"),
    ],
)
def test_runs_of_other_settings_are_refused(repository, runs, quick_ppo, change, complaint):
    first, second = sorted((runs / "ppo").iterdir())
    update(repository, first)
    (second / "config.yaml").write_text(quick_ppo.replace(seed=4, **change).as_yaml())
    (said,) = update(repository, second)
    assert f"{complaint}, but results/ppo/Test-Reach-v0_seed3, of the same table, has" in said
    assert [result.seed for result in read_results(repository)] == [3]


def test_what_differs_and_has_its_seed_is_told_that_it_differs(repository, runs, quick_ppo):
    first = sorted((runs / "ppo").iterdir())[0]
    update(repository, first)
    (first / "config.yaml").write_text(quick_ppo.replace(gamma=0.5).as_yaml())
    change(first / "run.json", started="2026-01-01T00:00:00+00:00")
    (said,) = update(repository, first)
    assert "its gamma is 0.5" in said
    assert "--replace" not in said


def test_the_page_says_on_what_a_run_began(repository, runs, quick_ppo):
    first = sorted((runs / "ppo").iterdir())[0]
    longer = {"reward_type": "dense", "max_episode_steps": 9}
    config = quick_ppo.replace(
        env_kwargs=longer, finish_timesteps=80, finish_env_kwargs={"max_episode_steps": 10}
    )
    (first / "config.yaml").write_text(config.as_yaml())
    update(repository, first)
    page = (repository / "docs/results.md").read_text()
    assert "Trained with `max_episode_steps: 9` until the last part, of 80 steps." in page


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
    assert (repository / "docs/results.md").read_text().count("## Test/Reach-v0, PPO") == 2


def test_names_of_tasks_are_names_of_folders():
    arguments = {"randomize": {"size": [0.8, 1.2]}, "fidelity": "fast", "block": "T"}
    name = task_name("RigidEnvs/Push-v0", arguments)
    assert name == "RigidEnvs-Push-v0-block-T-randomize-size-0.8-1.2"
    # what is observed makes no other task, and 0 asks for nothing
    arguments = {"guided": True, "begun": 0.0, "obstacles": 0}
    assert task_name("RigidEnvs/Stack-v0", arguments) == "RigidEnvs-Stack-v0"
    assert task_name("RigidEnvs/Stack-v0", {"max_episode_steps": 100}) == "RigidEnvs-Stack-v0"
    assert task_name("RigidEnvs/Stack-v0", {"begun": 0.5}) == "RigidEnvs-Stack-v0-begun-0.5"


def test_the_command_is_the_shortest_that_trains_the_same():
    config = load_config("ppo", "RigidEnvs/Push-v0")
    words = "rigid-envs train --algo ppo --env RigidEnvs/Push-v0"
    assert _command(config.replace(seed=7)) == f"{words} --seed 7"
    assert _command(config.replace(seed=7, n_timesteps=1000)) == f"{words} --seed 7 -n 1000"
    assert _command(config.replace(seed=7, gamma=0.9)) == (
        f"{words} --config results/ppo/RigidEnvs-Push-v0_seed7/config.yaml"
    )


@pytest.mark.parametrize("told", [["--num-threads", "1"], ["--num-threads=1"]])
def test_the_command_says_how_many_threads_a_run_was_told(repository, runs, told):
    first = sorted((runs / "ppo").iterdir())[0]
    change(first / "run.json", command=["rigid-envs", "train", *told, "--seed", "3"])
    update(repository, first)
    assert read_results(repository)[0].command.endswith("--num-threads 1")


def test_a_long_learning_curve_is_thinned_to_its_ends(repository, runs):
    run = runs / "ppo" / "Test-Reach-v0_1"
    header = "rollout/success_rate,time/total_timesteps,time/wall_time,train/loss\n"
    rows = "".join(f"0.5,{80 * n},{n},0.1\n" for n in range(1, 1001))
    (run / "progress.csv").write_text(header + rows)
    update(repository, run)
    with (repository / PLACE / "progress.csv").open() as file:
        kept = list(csv.DictReader(file))
    assert len(kept) == ROWS
    assert (kept[0]["time/wall_time"], kept[-1]["time/wall_time"]) == ("1", "1000")
    assert "train/loss" not in kept[0]


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
        ({"environment_share": 1.1}, "environment_share is 1.1"),
        ({"episodes": 0}, "episodes is 0"),
        ({"first_seed": None}, "first_seed is None"),
        ({"fidelity": 3}, "fidelity is 3, should be text, or null"),
        ({"success_at_end": {"rate": 1.0}}, "success_at_end is .*low, rate and high"),
        ({"success_at_any_time": {"low": 0.5, "rate": 0.4, "high": 1}}, "rising order"),
        ({"command": 1}, "command is 1"),
        ({"commit": ""}, "commit is ''"),
        ({"resumed": -1}, "resumed is -1"),
        ({"started": None}, "started is None"),
        ({"versions": "new"}, "versions is 'new'"),
    ],
)
def test_results_that_cannot_be_are_refused_by_field(repository, runs, changes, complaint):
    update(repository, runs / "ppo" / "Test-Reach-v0_1")
    file = repository / PLACE / "result.json"
    change(file, **changes)
    with pytest.raises(UsageError, match=rf"result\.json: .*{complaint}"):
        update(repository)


def test_results_that_are_damaged_or_misplaced_are_named(repository, runs):
    update(repository, runs / "ppo" / "Test-Reach-v0_1")
    file = repository / PLACE / "result.json"
    values = json.loads(file.read_text())
    for content, complaint in (
        ("{", "is not JSON"),
        ("[]", "should be a mapping"),
        (json.dumps({k: v for k, v in values.items() if k != "steps"}), "steps is missing"),
        (json.dumps({**values, "seed": 7}), "should lie in .*_seed7"),
    ):
        file.write_text(content)
        with pytest.raises(UsageError, match=complaint):
            update(repository)


def test_check_says_what_is_out_of_date(repository, runs, capsys):
    where = ["results", "--repository", str(repository)]
    assert cli.main([*where, "-f", str(runs), "-n", "10"]) == 0
    assert cli.main([*where, "--check"]) == 0
    capsys.readouterr()
    for name, was, is_now in (
        ("docs/results.md", "| 160 |", "| 170 |"),
        ("README.md", "PPO: success", "PPO: failure"),
        (f"{PLACE}/result.json", '"steps": 160', '"steps": 170'),
    ):
        file = repository / name
        before = file.read_text()
        assert was in before
        file.write_text(before.replace(was, is_now))
        assert cli.main([*where, "--check"]) == 2
        assert "is not what the files under results/ say" in capsys.readouterr().err
        file.write_text(before)
    for name in ("docs/results/ppo-Test-Reach-v0.gif", f"{PLACE}/policy.policy"):
        (repository / name).rename(repository / "aside")
        assert cli.main([*where, "--check"]) == 2
        assert f"{name} is missing" in capsys.readouterr().err
        (repository / "aside").rename(repository / name)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["nowhere"], "nowhere is no run folder"),
        (["--replace"], "--replace takes the run folders"),
        (["--check", "--replace"], "--check records nothing"),
        (["--check", "run"], "--check records nothing"),
        (["--repository", "elsewhere"], "elsewhere has no README.md"),
        (["--repository", "elsewhere", "--check"], "elsewhere has no README.md"),
        (["-n", "0"], "should be an integer of at least 1"),
    ],
)
def test_mistakes_are_told_in_one_line(repository, words, complaint, capsys, monkeypatch):
    monkeypatch.chdir(repository)
    where = [] if "--repository" in words else ["--repository", "."]
    assert cli.main(["results", *where, *words]) == 2
    shown = capsys.readouterr().err
    assert complaint in shown
    assert shown.count("\n") == 1


def test_a_readme_without_a_place_is_named(repository):
    (repository / README).write_text("# name\n")
    with pytest.raises(UsageError, match=r"README\.md has no lines <!-- results -->"):
        update(repository)


def test_shipped_policies_are_evaluated_and_filmed_like_any(repository, runs, tmp_path, capsys):
    update(repository, runs / "ppo" / "Test-Reach-v0_1")
    policy = str(repository / PLACE / "policy.policy")
    assert cli.main(["evaluate", policy, "-n", "10"]) == 0
    assert "10 episodes" in capsys.readouterr().out
    assert cli.main(["record", policy, "-n", "1", "-o", str(tmp_path / "film.gif")]) == 0
    assert (tmp_path / "film.gif").exists()
