"""The page of results and the table of the README: generated from the results alone."""

import dataclasses
import json

import pytest
from PIL import Image

from tests.training.results.recorded import PLACE, update
from training.commands import cli
from training.results.result import parse_result, read_results
from training.results.results import SOURCE
from training.results.results_page import (
    README,
    _section,
    check_pages,
    page_text,
    readme_text,
    twins_text,
)
from training.settings.config_file import load_config
from training.settings.errors import UsageError


def test_pages_are_up_to_date():
    check_pages(SOURCE)


def test_page_and_readme_show_every_seed_and_the_mean(repository, runs):
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
        image = repository / "docs" / "results" / f"ppo-Test-Reach-v0.{suffix}"
        assert image.stat().st_size <= 300_000
        assert f"results/{image.name}" in page
    with Image.open(repository / "docs/results/ppo-Test-Reach-v0.gif") as video:
        assert video.format == "GIF"


def test_pages_name_both_ids_of_a_dense_environment():
    results = [result for result in read_results(SOURCE) if "RigidEnvs/Push-" in result.env_id]
    dense = next(result for result in results if result.algorithm == "ppo")
    by_dense_id = dataclasses.replace(dense, env_id="RigidEnvs/PushDense-v0")
    for result in (dense, by_dense_id):
        page = page_text([result], SOURCE)
        assert "## RigidEnvs/Push-v0, PPO" in page
        assert "`RigidEnvs/PushDense-v0` is `RigidEnvs/Push-v0` with `reward_type: dense`" in page
        table = readme_text("<!-- results -->\n<!-- /results -->\n", [result])
        assert "| RigidEnvs/Push-v0<br>RigidEnvs/PushDense-v0 | <img" in table
    sparse = next(result for result in results if result.algorithm == "sac")
    assert "Dense" not in page_text([sparse], SOURCE)


def test_a_task_with_other_arguments_has_its_own_section_and_no_row_in_the_readme():
    given = next(r for r in read_results(SOURCE) if r.kind == "ppo-RigidEnvs-Push-v0")
    arguments = {**given.arguments, "randomize": {"mass": [0.5, 2.0]}}
    other = dataclasses.replace(given, arguments=arguments)
    page = page_text([given], SOURCE)
    assert "## RigidEnvs/Push-v0, PPO\n" in page
    assert other.task == "RigidEnvs-Push-v0-randomize-mass-0.5-2.0"
    section = _section([other], load_config("ppo", given.env_id))
    assert section.startswith("## RigidEnvs/Push-v0 with randomize, PPO\n")
    tables = [
        readme_text("<!-- results -->\n<!-- /results -->\n", results)
        for results in ([given], [given, other])
    ]
    assert tables[0] == tables[1]


def test_twins_have_their_own_table_with_success_in_their_originals():
    given = next(r for r in read_results(SOURCE) if r.kind == "ppo-RigidEnvs-Push-v0")
    rates = [{"low": rate - 0.02, "rate": rate, "high": rate + 0.01} for rate in (0.9, 0.96)]
    twins = [
        dataclasses.replace(
            given, env_id="RigidEnvs/FetchPush-v0", seed=seed, steps=1_000_000,
            original={"env_id": "FetchPush-v4", "episodes": 1000, "first_seed": 0,
                      "success_at_end": rate, "versions": {"mujoco": "3.2.7"}},
        )
        for seed, rate in enumerate(rates)
    ]  # fmt: skip
    empty = "<!-- results -->\n<!-- /results -->\n"
    assert "No run is recorded" in readme_text(empty, twins)
    assert readme_text(empty, [given, *twins]) == readme_text(empty, [given])
    assert "No run is recorded" in twins_text(empty, [given])
    table = twins_text(empty, [given, *twins])
    assert "\n| FetchPush | PPO | 2 | 1 M | " in table
    assert table.splitlines()[-2].endswith("| 93.0 ± 4.2 % | 90.0 % |")
    section = _section(twins, load_config("ppo", given.env_id))
    assert "| at any time | in FetchPush-v4 | commit |" in section
    assert "| 90.0 % (88.0 to 91.0) |" in section
    assert "| 93.0 ± 4.2 % | |" in section
    for one in (given, *twins):  # results without an original keep their files
        assert parse_result(json.loads(one.as_json()), "file") == one
    assert "original" not in given.as_json()
    with pytest.raises(
        UsageError, match=r"original is .*, should be a mapping of env_id, episodes"
    ):
        parse_result({**json.loads(given.as_json()), "original": {"episodes": 3}}, "file")


def test_pages_without_results(repository, tmp_path):
    lines = update(repository, log_folder=tmp_path / "nowhere")
    assert lines == ["written  docs/results.md", "written  README.md", "written  docs/twins.md"]
    assert "No run is recorded yet" in (repository / "docs/results.md").read_text()
    assert "No run is recorded yet" in (repository / README).read_text()
    assert update(repository, log_folder=tmp_path / "nowhere") == []


def test_images_are_updated_after_ctrl_c(repository, runs, monkeypatch):
    first, second = sorted((runs / "ppo").iterdir())
    update(repository, first)

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("training.results.results._update_images", interrupted)
        with pytest.raises(KeyboardInterrupt):
            update(repository, second)
    lines = update(repository, log_folder=runs / "nothing")
    # the video shows the lowest seed, which has not changed
    assert [line.split()[0] for line in lines] == ["plotted", "written", "written"]


def test_page_shows_the_arguments_before_fine_tuning(repository, runs, quick_ppo):
    first = sorted((runs / "ppo").iterdir())[0]
    longer = {"reward_type": "dense", "max_episode_steps": 9}
    config = quick_ppo.replace(
        env_kwargs=longer, finetune_timesteps=80, finetune_env_kwargs={"max_episode_steps": 10}
    )
    (first / "config.yaml").write_text(config.as_yaml())
    update(repository, first)
    page = (repository / "docs/results.md").read_text()
    stage = "Trained with `max_episode_steps: 9` until the fine-tuning stage, which starts after 8"
    assert stage in page


def test_check_names_files_that_are_out_of_date(repository, runs, capsys):
    where = ["results", "--repository", str(repository)]
    assert cli.main([*where, "-f", str(runs), "-n", "10"]) == 0
    assert cli.main([*where, "--check"]) == 0
    capsys.readouterr()
    for name, old, new in (
        ("docs/results.md", "| 160 |", "| 170 |"),
        ("README.md", "PPO: success", "PPO: failure"),
        (f"{PLACE}/result.json", '"steps": 160', '"steps": 170'),
    ):
        file = repository / name
        before = file.read_text()
        assert old in before
        file.write_text(before.replace(old, new))
        assert cli.main([*where, "--check"]) == 2
        assert "is out of date; to generate it: rigid-envs results" in capsys.readouterr().err
        file.write_text(before)
    for name in ("docs/results/ppo-Test-Reach-v0.gif", f"{PLACE}/policy.safetensors"):
        (repository / name).rename(repository / "moved")
        assert cli.main([*where, "--check"]) == 2
        assert f"{name} is missing" in capsys.readouterr().err
        (repository / "moved").rename(repository / name)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["nowhere"], "nowhere does not exist; it should be a run folder"),
        (["--replace"], "--replace requires run folders"),
        (["--check", "--replace"], "--check records nothing"),
        (["--check", "run"], "--check records nothing"),
        (["--repository", "docs"], "docs has no README.md"),
        (["--repository", "docs", "--check"], "docs has no README.md"),
        (["--repository", "elsewhere", "--check"], "elsewhere does not exist"),
        (["-n", "0"], "should be an integer of at least 1"),
    ],
)
def test_mistakes_are_reported_in_one_line(repository, words, complaint, capsys, monkeypatch):
    monkeypatch.chdir(repository)
    where = [] if "--repository" in words else ["--repository", "."]
    assert cli.main(["results", *where, *words]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1


def test_readme_without_markers_raises(repository):
    (repository / README).write_text("# name\n")
    with pytest.raises(UsageError, match=r"README\.md has no lines <!-- results -->"):
        update(repository)


def test_shipped_policies_can_be_evaluated_and_recorded(repository, runs, tmp_path, capsys):
    update(repository, runs / "ppo" / "Test-Reach-v0_1")
    policy = str(repository / PLACE / "policy.safetensors")
    assert cli.main(["evaluate", policy, "-n", "10"]) == 0
    assert "10 episodes" in capsys.readouterr().out
    assert cli.main(["record", policy, "-n", "1", "-o", str(tmp_path / "video.gif")]) == 0
    assert (tmp_path / "video.gif").exists()
