"""A search for settings whose trials run on a Ray cluster."""

# ruff: noqa: E402  (imports after the skip where Ray is missing)

import optuna
import pytest
from optuna.trial import TrialState

ray = pytest.importorskip("ray")

from training.cluster import trials as trials_module
from training.commands import cli
from training.results.trial import Stopped
from training.settings.search_space import SPACES, OneOf

REACH = "RigidEnvs/ReachDense-v0"


@pytest.fixture(autouse=True)
def small_space(monkeypatch):
    values = {"n_steps": (25,), "minibatches": (2,), "n_epochs": (1,), "net_arch": ("8", "8 8")}
    for name, allowed in values.items():
        monkeypatch.setitem(SPACES["ppo"], name, OneOf(allowed))


@pytest.fixture
def words(tmp_path):
    return [
        "tune", "--env", REACH, "-f", str(tmp_path), "-n", "3200", "--n-envs", "64",
        "--n-episodes", "20", "--hyperparams", "batch_size:800",
    ]  # fmt: skip


def study_of(tmp_path) -> optuna.Study:
    path = tmp_path / "ppo" / "RigidEnvs-ReachDense-v0_tuning.db"
    return optuna.load_study(study_name=None, storage=f"sqlite:///{path}")


def states(tmp_path) -> list[TrialState]:
    return [trial.state for trial in study_of(tmp_path).trials]


def test_trials_on_two_nodes_join_the_study_of_local_ones(address, words, tmp_path, capsys):
    assert cli.main([*words, "--n-trials", "1"]) == 0
    capsys.readouterr()
    assert cli.main([*words, "--n-trials", "4", "--ray", address]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("# best of 4 trials: number ")
    assert shown.err.count("success") >= 3
    trials = study_of(tmp_path).trials
    assert {trial.state for trial in trials} == {TrialState.COMPLETE}
    assert len({trial.params["learning_rate"] for trial in trials}) == 4
    assert len(trials[-1].intermediate_values) > 0
    # two ran at the same time, one on each node
    assert trials[2].datetime_start < trials[1].datetime_complete
    before = shown.out
    assert cli.main([*words, "--n-trials", "4", "--ray", address]) == 0
    assert capsys.readouterr().out == before


def test_lost_diverged_and_poor_trials_are_told_apart(
    address, words, tmp_path, monkeypatch, capsys
):
    run_trial = trials_module.run_trial

    def ending(order, driver):
        import os

        if order.number == 0:
            os._exit(1)
        if order.number == 1:
            raise ValueError("not finite")
        if order.number == 2:
            raise Stopped
        return run_trial(order, driver)

    monkeypatch.setattr(trials_module, "run_trial", ending)
    assert cli.main([*words, "--n-trials", "3", "--ray", address]) == 0
    err = capsys.readouterr().err
    assert "trial 0: lost with its worker (WorkerCrashedError)" in err
    assert "trial 1: failed: not finite" in err
    assert "trial 2: stopped early" in err
    # the lost one was repeated
    done = [TrialState.FAIL, TrialState.FAIL, TrialState.PRUNED, TrialState.COMPLETE]
    assert states(tmp_path) == done


def test_trials_that_kill_every_worker_end_the_search(
    address, words, tmp_path, monkeypatch, capsys
):
    def dying(order, driver):
        import os

        os._exit(1)

    monkeypatch.setattr(trials_module, "run_trial", dying)
    assert cli.main([*words, "--n-trials", "3", "--ray", address]) == 2
    assert "4 trials in a row lost their workers (WorkerCrashedError)" in capsys.readouterr().err
    assert TrialState.RUNNING not in states(tmp_path)


def test_a_wrong_address_creates_no_study(words, tmp_path, capsys):
    assert cli.main([*words, "--ray", "127.0.0.1:1"]) == 2
    assert "--ray is '127.0.0.1:1': nothing answers there" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
