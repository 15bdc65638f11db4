"""The command line: it starts without the train extra, and mistakes give one line."""

import subprocess
import sys

import pytest

from training.commands import cli, extras, handlers

COMMANDS = (
    "train",
    "evaluate",
    "record",
    "export",
    "scripted",
    "plot",
    "tune",
    "demo",
    "view",
    "dataset",
)


def test_starts_without_stable_baselines3_and_torch():
    code = (
        "import sys, training.commands.cli\n"
        "heavy = {'torch', 'stable_baselines3', 'matplotlib', 'imageio', 'yaml', 'rich'}\n"
        "sys.exit(repr(heavy & set(sys.modules)) if heavy & set(sys.modules) else 0)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


def test_help_lists_every_command(capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["--help"])
    assert caught.value.code == 0
    shown = capsys.readouterr().out
    assert all(command in shown for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main([command, "--help"])
    assert caught.value.code == 0
    assert "--env" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ([], "COMMAND"),
        (["trian"], "invalid choice: 'trian'"),
        (["train", "--algo", "pp0"], "did you mean 'ppo'?"),
        (["evaluate", "trained", "--stochastic"], "needs a run folder or a model.zip"),
        (["record", "scripted", "--stochastic"], "needs a run folder or a model.zip"),
        (["train", "--algo", "td3"], "unknown algorithm 'td3'; there are ppo and sac"),
        (
            ["train", "--algo", "sac", "--env", "RigidEnvs/Reach-v0"],
            "no settings for environment 'RigidEnvs/Reach-v0'; there are those of",
        ),
        (
            ["train", "--env", "RigidEnvs/Stack-v0", "--env-kwargs", "observe_task_guide:false"],
            "observe_task_guide is False, but the components in policy_kwargs are those of an",
        ),
        (["train", "--env-kwargs", "obs_type:pixels"], "training.policies.pixels.PixelPolicy of"),
        (["evaluate", "RigidEnvs/Push-v0"], "is an environment, should come after --env"),
        (["evaluate", "--env-kwargs", "obstacles:2", "runs/a"], "goes before --env-kwargs"),
        (
            ["scripted", "--env-kwargs", "max_episode_steps:-1"],
            "max_episode_steps is -1, should be",
        ),
        (["train", "--env", "RigidEnvs/Posh-v0"], "did you mean 'RigidEnvs/Push-v0'?"),
        (["train", "-n", "0"], "should be an integer of at least 1"),
        (["train", "-n", "many"], "should be an integer of at least"),
        (["train", "-n", "-5"], "should be an integer of at least 1"),
        (
            ["train", "--algo", "sac", "--env", "RigidEnvs/Throw-v0"],
            "to use your own settings: --conf",
        ),
        (["train", "--algo", "sac", "-n", "3000"], "learning_starts is 100000, should be less"),
        (["train", "--hyperparams", "policy:MlpPolicy"], "did you mean 'MultiInputPolicy'?"),
        (
            ["train", "--algo", "sac", "--env-kwargs", "reward_type:dense"],
            "HerReplayBuffer computes rewards from goals alone: the dense reward needs",
        ),
        (["train", "--seed", "-1"], "seed"),
        (["train", "--config", "nowhere.yaml"], "nowhere.yaml does not exist; it should be a YAML"),
        (["train", "--hyperparams", "gama:0.9"], "did you mean 'gamma'?"),
        (["train", "--hyperparams", "gamma"], "should be KEY:VALUE"),
        (["train", "--hyperparams", "gamma:2"], "gamma is 2, should be a number above 0"),
        (["train", "--frobnicate"], "unrecognized arguments: --frobnicate"),
        (["evaluate", "-f", "nowhere"], "no run in nowhere; to train one: rigid-envs train"),
        (["record", "-f", "nowhere", "--algo", "sac"], "no run of sac"),
        (["tune", "--algo", "pp0"], "did you mean 'ppo'?"),
        (["tune", "--n-trials", "0"], "should be an integer of at least 1"),
        (["tune", "--env-kwargs", "reward_type:denze"], "RigidEnvs/Push-v0 rejects"),
        (["tune", "--storage", "nosuch://place"], "storage nosuch://place cannot be used"),
        (["scripted", "--env", "RigidEnvs/Pull-v0"], "did you mean 'RigidEnvs/Push-v0'?"),
        (["scripted", "--env", "CartPole-v1"], "no scripted controller for environment"),
        (["scripted", "--env-kwargs", "target_jaw:true"], "did you mean 'target_yaw'?"),
        (["scripted", "--env-kwargs", "blocks:3"], "unknown argument 'blocks'"),
        (
            ["train", "--n-envs", "100000000", "-n", "10000000000"],
            "RigidEnvs/Push-v0: num_envs=100000000: 100000000 worlds of this scene need",
        ),
        (
            ["scripted", "--env-kwargs", "obstacles:many"],
            "obstacles must be an integer, got 'many'",
        ),
        (["scripted", "--env-kwargs", "obstacles:5"], "obstacles must be at most 4, got 5"),
        (["scripted", "--env-kwargs", "target_yaw:1"], "target_yaw must be bool, got 1"),
        (["scripted", "--env-kwargs", "target_yaw"], "'target_yaw' should be KEY:VALUE"),
        (
            ["scripted", "--env-kwargs", "seed:3"],
            "'seed' is not allowed here: use --seed",
        ),
        (
            ["scripted", "--env-kwargs", "max_episode_steps:many"],
            "max_episode_steps must be an int",
        ),
        (["play", "--env-kwargs", "obstacles:5"], "obstacles must be at most 4, got 5"),
        (
            ["play", "--env-kwargs", "render_mode:human"],
            "'render_mode' is not allowed here: the command sets it",
        ),
        (["play", "--env-kwargs", "max_episode_steps:many"], "rejects {"),
        (["evaluate", "scripted", "--env-kwargs", "obstacles:-1"], "obstacles must be at least 0"),
        (["record", "scripted", "--env-kwargs", "randomize:heavy"], "randomize must be a dict"),
    ],
)
def test_mistakes_are_reported_in_one_line(words, complaint, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(words) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("error: ")
    assert shown.err.count("\n") == 1
    assert complaint in shown.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ["train", "--resume", "nowhere"],
        ["evaluate", "nowhere"],
        ["record", "nowhere"],
        ["export", "nowhere"],
        ["plot", "nowhere"],
        ["results", "nowhere"],
        ["results", "--repository", "nowhere"],
        ["train", "--config", "nowhere"],
    ],
)
def test_missing_paths_are_reported_in_the_same_words(words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(words) == 2
    assert capsys.readouterr().err.startswith("error: nowhere does not exist; it should be a ")


@pytest.mark.parametrize("command", ["export", "plot", "results", "evaluate", "record"])
def test_folders_without_a_run_are_reported_in_the_same_words(
    command, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    assert cli.main([command, "empty"]) == 2
    assert capsys.readouterr().err == "error: empty is not a run folder: run.json is missing\n"


def test_missing_packages_name_the_extra(capsys, monkeypatch):
    monkeypatch.setattr(extras, "TRAIN_EXTRA", ("no_such_package",))
    assert cli.main(["scripted"]) == 2
    assert capsys.readouterr().err == (
        "error: this command requires no_such_package; "
        'to install, in a clone: pip install -c constraints.txt -e ".[train]"\n'
    )


def test_bugs_keep_their_traceback(monkeypatch):
    def bug(*_):
        raise ValueError("a bug")

    monkeypatch.setattr(handlers, "scripted", bug)
    with pytest.raises(ValueError, match="a bug"):
        cli.main(["scripted"])


def test_ctrl_c_exits_with_status_130(monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(handlers, "scripted", interrupted)
    assert cli.main(["scripted"]) == 130
    assert capsys.readouterr().err == "interrupted\n"
