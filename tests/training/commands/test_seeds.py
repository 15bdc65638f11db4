"""Several seeds in one command, without a cluster."""

import argparse
import json

import pytest

from training.commands import cli, extras, handlers
from training.commands.seeds import seeds
from training.runs.run_folder import RunFolder
from training.sb3 import train as train_module
from training.settings.errors import UsageError


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0", (0,)),
        ("0-3", (0, 1, 2, 3)),
        ("0,3,7", (0, 3, 7)),
        ("0-2,5", (0, 1, 2, 5)),
        ("7, 3-4", (7, 3, 4)),
        ("5-5", (5,)),
    ],
)
def test_seeds_are_numbers_and_ranges(text, expected):
    assert seeds(text) == expected


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "'': '' should be a seed or a range"),
        ("1,", "'1,': '' should be a seed"),
        ("-1", "'-1' should be a seed"),
        ("a-b", "'a-b' should be a seed"),
        ("1.5", "'1.5' should be a seed"),
        ("1-2-3", "'1-2-3' should be a seed"),
        ("٣", "should be a seed"),
        ("9-0", "the range '9-0' is empty, should be 0-9"),
        ("0-3,2", "has seed 2 twice"),
        ("0-99999999", "too many seeds, should have at most 1000"),
        ("4294967296", "should be below 4294967296"),
        ("9" * 5000, "9' should be a seed"),
    ],
)
def test_invalid_seeds_name_the_part_and_what_would_be_right(text, complaint):
    with pytest.raises(argparse.ArgumentTypeError, match=complaint):
        seeds(text)


@pytest.fixture
def words(reach, tmp_path, quick_ppo, write_yaml) -> list[str]:
    config = write_yaml(quick_ppo.as_yaml())
    return ["train", "--env", reach, "-f", str(tmp_path / "runs"), "--config", str(config)]


def test_each_seed_gets_a_run_folder_that_equals_that_of_its_own_command(words, tmp_path, capsys):
    assert cli.main([*words, "--seeds", "4,2"]) == 0
    assert capsys.readouterr().out.count("trained after 160 steps") == 2
    folders = [RunFolder(tmp_path / "runs" / "ppo" / f"Test-Reach-v0_{n}") for n in (1, 2)]
    assert [folder.config().seed for folder in folders] == [4, 2]
    assert json.loads((folders[0].path / "run.json").read_text())["seed"] == 4
    assert cli.main([*words, "--seed", "2"]) == 0
    alone = RunFolder(tmp_path / "runs" / "ppo" / "Test-Reach-v0_3")
    assert alone.policy.read_bytes() == folders[1].policy.read_bytes()


@pytest.mark.parametrize(
    ("more", "complaint"),
    [
        (["--seeds", "3-1"], "argument --seeds: '3-1': the range '3-1' is empty, should be 1-3"),
        (["--seeds", "0-1", "--seed", "1"], "--seed cannot be used with --seeds"),
        (["--seeds", "0-1", "--resume", "x"], "--seeds cannot be used with --resume"),
        (["--seeds", "0-1", "--hyperparams", "seed:3"], "--hyperparams seed cannot be used"),
        (["--seeds", "0-1", "--env-kwargs", "reward_type:denze"], "reward_type is 'denze'"),
    ],
)
def test_mistakes_are_reported_before_any_folder_is_created(
    words, more, complaint, tmp_path, capsys
):
    assert cli.main([*words, *more]) == 2
    shown = capsys.readouterr().err
    assert complaint in shown
    assert shown.count("\n") == 1
    assert not (tmp_path / "runs").exists()


def test_a_seed_that_fails_does_not_stop_the_others(words, tmp_path, monkeypatch, capsys):
    train = train_module.train

    def failing(config, *arguments, **options):
        if config.seed == 1:
            raise UsageError("the disk is full")
        return train(config, *arguments, **options)

    monkeypatch.setattr(train_module, "train", failing)
    assert cli.main([*words, "--seeds", "0-2"]) == 2
    shown = capsys.readouterr()
    assert shown.out.count("trained after") == 2
    assert "1 of 3 runs failed: seed 1: the disk is full" in shown.err
    assert len(list((tmp_path / "runs" / "ppo").iterdir())) == 2


def test_ctrl_c_ends_the_series(words, tmp_path, monkeypatch):
    def interrupted(*_arguments, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("stable_baselines3.PPO.learn", interrupted)
    assert cli.main([*words, "--seeds", "0-2"]) == 130
    assert len(list((tmp_path / "runs" / "ppo").iterdir())) == 1


def test_ctrl_c_after_a_failure_names_the_failure_and_still_counts_as_ctrl_c(
    words, monkeypatch, capsys
):
    errors = iter([UsageError("the disk is full"), KeyboardInterrupt()])

    def fails(*_arguments, **_options):
        raise next(errors)

    monkeypatch.setattr("stable_baselines3.PPO.learn", fails)
    assert cli.main([*words, "--seeds", "0-2"]) == 130
    assert "1 of 3 runs failed: seed 0: the disk is full" in capsys.readouterr().err


def test_ray_names_its_extra_where_it_is_missing(words, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(handlers, "RAY_EXTRA", (*extras.TRAIN_EXTRA, "no_such_package"))
    for more in (["--ray"], ["--ray", "localhost:6379", "--seeds", "0-1"]):
        assert cli.main([*words, *more]) == 2
        assert capsys.readouterr().err == (
            "error: this command requires no_such_package; "
            'to install, in a clone: pip install -c constraints-ray.txt -e ".[ray,tune]", '
            "into a virtual environment of its own\n"
        )
    assert not (tmp_path / "runs").exists()
