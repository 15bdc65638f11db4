"""The search for settings, on a small test environment."""

import sqlite3
from functools import partial

import optuna
import pytest
import yaml
from optuna.trial import TrialState

from training.commands import cli, tuning
from training.commands.tuning import tune
from training.results import trial
from training.settings.config import TrainConfig
from training.settings.config_file import load_config
from training.settings.errors import UsageError
from training.settings.search_space import SPACES, OneOf, draw, with_drawn


def study_of(path) -> optuna.Study:
    return optuna.load_study(study_name=None, storage=f"sqlite:///{path}")


@pytest.fixture(autouse=True)
def small_space(monkeypatch, request):
    """Short trials on one torch thread."""
    if "whole_space" in request.fixturenames:
        return
    ppo = {"n_steps": (5, 10), "minibatches": (1, 2), "n_epochs": (1, 2), "net_arch": ("8", "8 8")}
    for name, values in ppo.items():
        monkeypatch.setitem(SPACES["ppo"], name, OneOf(values))
    sac = {"batch_size": (16, 32), "gradient_steps": (1,), "net_arch": ("8", "8 8")}
    for name, values in sac.items():
        monkeypatch.setitem(SPACES["sac"], name, OneOf(values))
    monkeypatch.setattr(trial, "train", partial(one_thread, trial.train))


def one_thread(train, *arguments, **options):
    return train(*arguments, **{**options, "num_threads": 1})


@pytest.fixture
def whole_space():
    """Keeps the search space unchanged."""


@pytest.fixture
def words(reach, tmp_path, quick_ppo, write_yaml) -> list[str]:
    """A search of two tiny trials."""
    config = write_yaml(quick_ppo.as_yaml())
    tiny = ["--n-trials", "2", "-n", "160", "--n-episodes", "20"]
    return ["tune", "--env", reach, "--config", str(config), "-f", str(tmp_path), *tiny]


def test_best_settings_are_yaml_that_train_accepts(
    words, reach, tmp_path, quick_ppo, write_yaml, capsys
):
    assert cli.main(words) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("# best of 2 trials: number ")
    assert shown.err.count("trial ") >= 2
    (tmp_path / "best.yaml").write_text(shown.out)
    best = load_config("ppo", reach, tmp_path / "best.yaml")
    assert best.n_timesteps == quick_ppo.n_timesteps
    searched = {"learning_rate", "gamma", "n_steps", "batch_size", "n_epochs", "ent_coef"}
    searched |= {"clip_range", "policy_kwargs"}
    for name, value in quick_ppo.as_mapping().items():
        if name not in searched:
            assert best.as_mapping()[name] == value, name
    assert best.policy_kwargs["activation"] == "tanh"
    # trials leave no run folders, only the database
    assert [path.name for path in (tmp_path / "ppo").iterdir()] == ["Test-Reach-v0_tuning.db"]


def test_same_command_continues_the_search(words, tmp_path, capsys):
    assert cli.main(words) == 0
    study = study_of(tmp_path / "ppo" / "Test-Reach-v0_tuning.db")
    assert len(study.trials) == 2
    before = capsys.readouterr().out
    assert cli.main(words) == 0
    assert capsys.readouterr().out == before
    assert len(study.trials) == 2
    words[words.index("--n-trials") + 1] = "3"
    assert cli.main(words) == 0
    assert len(study.trials) == 3
    learning_rates = {trial.params["learning_rate"] for trial in study.trials}
    assert len(learning_rates) == 3


def test_ctrl_c_keeps_complete_trials(words, tmp_path, monkeypatch, capsys):
    success = tuning._success

    def interrupted(config, trial, *rest):
        if trial.number == 1:
            draw(config, trial)
            raise KeyboardInterrupt
        return success(config, trial, *rest)

    with monkeypatch.context() as patched:
        patched.setattr(tuning, "_success", interrupted)
        assert cli.main(words) == 130
    shown = capsys.readouterr()
    assert shown.out.startswith("# best of 1 trials: number 0")
    assert "trial 1: interrupted" in shown.err
    assert cli.main(words) == 0
    study = study_of(tmp_path / "ppo" / "Test-Reach-v0_tuning.db")
    states = [trial.state for trial in study.trials]
    assert states == [TrialState.COMPLETE, TrialState.FAIL, TrialState.COMPLETE]


def test_ctrl_c_before_the_first_complete_trial_prints_nothing(words, monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(tuning, "_success", interrupted)
    assert cli.main(words) == 130
    assert capsys.readouterr().out == ""


def test_ctrl_c_during_training_ends_the_search(words, monkeypatch, capsys):
    def interrupted(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(trial.IntermediateReports, "_on_step", interrupted)
    assert cli.main(words) == 130
    assert "trial 0: interrupted" in capsys.readouterr().err


def test_poor_trials_are_stopped_early(quick_ppo, tmp_path, monkeypatch, capsys):
    """The median pruner decides at each intermediate report except the last."""
    asked = []
    monkeypatch.setattr(
        optuna.Trial, "should_prune", lambda trial: asked.append(trial.number) or trial.number == 1
    )
    found = tune(quick_ppo.replace(n_timesteps=800), tmp_path, trials=3, episodes=10)
    study = study_of(tmp_path / "ppo" / "Test-Reach-v0_tuning.db")
    states = [trial.state for trial in study.trials]
    assert states == [TrialState.COMPLETE, TrialState.PRUNED, TrialState.COMPLETE]
    assert asked == [0] * 9 + [1] + [2] * 9
    assert list(study.trials[0].intermediate_values) == list(range(1, 10))
    assert "best of 3 trials" in found.summary
    assert "trial 1: stopped early" in capsys.readouterr().err


def test_diverged_trial_does_not_end_the_search(quick_ppo, tmp_path, monkeypatch, capsys):
    success = tuning._success

    def diverging(config, trial, *rest):
        if trial.number == 0:
            raise ValueError("weights are not finite")
        return success(config, trial, *rest)

    monkeypatch.setattr(tuning, "_success", diverging)
    found = tune(quick_ppo, tmp_path, trials=2, episodes=10)
    assert "best of 2 trials: number 1" in found.summary
    assert "trial 0: failed: weights are not finite" in capsys.readouterr().err


def test_search_in_which_all_trials_fail_reports_the_error(quick_ppo, tmp_path, monkeypatch):
    def diverging(*_):
        raise ValueError("weights are not finite")

    monkeypatch.setattr(tuning, "_success", diverging)
    with pytest.raises(UsageError, match="all 2 trials failed; the error of the last one: weights"):
        tune(quick_ppo, tmp_path, trials=2)


def test_search_supports_her(quick_sac, tmp_path):
    found = tune(quick_sac.replace(n_timesteps=100), tmp_path, trials=1, episodes=10)
    assert found.settings is not None
    assert found.settings.replay_buffer_class == "HerReplayBuffer"


@pytest.mark.parametrize("algo", SPACES)
def test_every_row_of_the_table_gives_valid_settings(algo, quick_ppo, quick_sac, whole_space):
    config: TrainConfig = {"ppo": quick_ppo, "sac": quick_sac}[algo]
    config = config.replace(n_envs=64)
    study = optuna.create_study(sampler=optuna.samplers.RandomSampler(seed=0))
    changed = set()
    for _ in range(50):
        found = with_drawn(config, draw(config, study.ask())).as_mapping()
        changed |= {name for name, value in config.as_mapping().items() if found[name] != value}
    rows = {"minibatches": "batch_size", "net_arch": "policy_kwargs"}
    assert changed | {"batch_size"} == {rows.get(name, name) for name in SPACES[algo]} | {
        "batch_size"
    }


def test_study_with_other_settings_raises(words, tmp_path, capsys):
    assert cli.main(words) == 0
    capsys.readouterr()
    for flags, complaint in (
        (["-n", "320"], "n_timesteps is 320, but study 'ppo-Test-Reach-v0' was started with 160"),
        (["--seed", "9"], "seed is 9, but"),
        (["--n-envs", "16"], "n_envs is 16, but"),
        (["--n-episodes", "30"], "episodes is 30, but"),
        (["--env-kwargs", "reward_type:sparse"], "env_kwargs is {'reward_type': 'sparse'}, but"),
    ):
        assert cli.main([*words, *flags]) == 2
        assert complaint in capsys.readouterr().err
    assert cli.main([*words, "--seed", "9", "--study-name", "other", "--n-trials", "1"]) == 0
    where = f"sqlite:///{tmp_path / 'ppo' / 'Test-Reach-v0_tuning.db'}"
    assert set(optuna.get_all_study_names(where)) == {"ppo-Test-Reach-v0", "other"}


def test_storage_is_a_file_or_a_url(quick_ppo, tmp_path):
    for storage in (str(tmp_path / "deep" / "a.db"), f"sqlite:///{tmp_path / 'b.db'}"):
        tune(quick_ppo, tmp_path, trials=1, episodes=10, storage=storage)
    for name in ("deep/a.db", "b.db"):
        with sqlite3.connect(tmp_path / name) as database:
            assert database.execute("select count(*) from trials").fetchone() == (1,)


def test_invalid_storage_raises(quick_ppo, tmp_path):
    file = tmp_path / "notes.db"
    file.write_text("no database, but some text that is longer than a header of one " * 20)
    before = file.read_bytes()
    for storage in (str(file), str(tmp_path), "nosuch://place", str(file / "under.db")):
        with pytest.raises(UsageError, match="cannot be used") as caught:
            tune(quick_ppo, tmp_path, storage=storage)
        assert storage in str(caught.value)
    assert file.read_bytes() == before


def test_steps_are_a_tenth_of_the_settings_unless_given(words, tmp_path, capsys):
    at = words.index("-n")
    assert cli.main(words[:at] + words[at + 2 :]) == 0
    study = study_of(tmp_path / "ppo" / "Test-Reach-v0_tuning.db")
    assert yaml.safe_load(study.user_attrs["settings"])["n_timesteps"] == 16
    assert "n_timesteps: 160" in capsys.readouterr().out


def test_a_search_draws_no_entropy_bonus_where_there_is_none():
    config = load_config("sac", "RigidEnvs/Stack-v0")
    study = optuna.create_study(sampler=optuna.samplers.RandomSampler(seed=0))
    for _ in range(10):
        drawn = draw(config, study.ask())
        assert "ent_coef" not in drawn
        assert with_drawn(config, drawn).ent_coef == "auto"


def test_flags_hold_in_the_last_stage_of_the_best_settings(monkeypatch, capsys):
    monkeypatch.setattr(
        tuning, "tune", lambda config, *_, **__: tuning.Tuned(config, "best", interrupted=False)
    )
    words = ["tune", "--env", "RigidEnvs/Stack-v0", "--env-kwargs", "max_episode_steps:50"]
    assert cli.main([*words, "--hyperparams", "finetune_timesteps:1000000"]) == 0
    best = next(iter(yaml.safe_load(capsys.readouterr().out).values()))
    assert best["n_timesteps"] == load_config("ppo", "RigidEnvs/Stack-v0").n_timesteps
    assert best["finetune_timesteps"] == 1_000_000
    assert best["env_kwargs"]["max_episode_steps"] == 50
    assert best["finetune_env_kwargs"]["max_episode_steps"] == 50
