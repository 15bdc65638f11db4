"""What the run with hostile actions calls wrong, that a short run is right, and that it resumes."""

import numpy as np
import pytest

from benchmarks.adversarial import __main__ as command
from benchmarks.adversarial import chunk, failures, report
from benchmarks.adversarial.actions import ACTIONS
from benchmarks.adversarial.balance import Balance
from benchmarks.adversarial.checks import differences, not_finite
from benchmarks.adversarial.chunk import KINDS, Combination, Figures, Run, run_chunk
from benchmarks.adversarial.failures import load
from benchmarks.adversarial.measured_runner import MeasuredRunner
from benchmarks.adversarial.replay import replay
from physics.analysis.load_limits import LoadLimits

PUSH = Combination("push", "balanced", "resets", "scene")
WORLDS = 40


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    monkeypatch.setattr(failures, "FOLDER", tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def runner():
    made = MeasuredRunner("push", "balanced", "scene", WORLDS, 1)
    made.start_episode(seed=3, episode=0)
    return made


def test_what_is_not_finite_or_differs_is_named():
    values = {"observation": np.ones((5, 3)), "reward": np.zeros(5)}
    few = {name: value[:2].copy() for name, value in values.items()}
    assert not_finite(values) == {}
    assert differences(values, few) == ""
    few["observation"][1, 2] += 4e-16
    assert "observation differs between 5 worlds and 2" in differences(values, few)
    values["reward"][4] = np.nan
    assert not_finite(values) == {4: "reward is nan"}


def test_bang_bang_stays_at_the_limits_and_changes_sides(runner):
    source = ACTIONS["bang-bang"](runner, np.random.default_rng(0))
    before, after = source().actions, source().actions
    assert np.array_equal(np.abs(after), np.ones_like(after))
    assert 0.05 < (before != after).mean() < 0.25


def test_ramming_presses_hands_and_resets_meet_worlds_in_contact(runner):
    source, resets = ACTIONS["resets"](runner, np.random.default_rng(1)), 0
    touched = np.zeros(WORLDS, dtype=bool)
    for _ in range(30):
        commands = source()
        assert np.abs(commands.actions).max() <= 1.0
        resets += int(commands.resets.sum())
        runner.step(commands.actions)
        touched |= runner.world.normal_force("finger", "block") > 0.0
    assert touched.mean() > 0.3
    assert resets > 0.02 * 30 * WORLDS


def test_a_short_run_with_resets_finds_nothing():
    figures = run_chunk(PUSH, 0, WORLDS, 60, True)
    assert figures.steps == 60 * WORLDS
    assert figures.episodes > 2 * WORLDS
    assert [getattr(figures, kind) for kind in KINDS] == [0] * len(KINDS)
    assert figures.gain < 1e-3
    assert 0.0 < figures.lowest < 0.02


def test_a_gain_of_energy_is_found(runner):
    world, nobody = runner.world, np.zeros(WORLDS, dtype=bool)
    runner.start_episode(seed=4, episode=0)
    balance = Balance(world)
    runner.step(np.zeros((WORLDS, 3)))
    balance.update(world, nobody)
    assert (balance.gain <= balance.allowed).all()
    world._simulation.state.dynamic["momentum"][7, 0, 2] += 0.1 * 0.2  # 0.2 m/s: 2 mJ
    balance.update(world, nobody)
    assert np.flatnonzero(balance.gain > balance.allowed).tolist() == [7]
    began = nobody.copy()
    began[7] = True
    balance.update(world, began)
    assert not (balance.gain > balance.allowed).any()


def test_a_body_escapes_that_is_below_the_ground_after_two_steps(monkeypatch, folder):
    """The third world is below it for one step, the fourth for two; the fifth in two episodes."""
    below = {7: [2, 3], 8: [3, 4], 9: [4]}

    def marked(world):
        mask = np.zeros(WORLDS, dtype=bool)
        mask[below.get(run._steps, [])] = True
        return mask

    monkeypatch.setattr(chunk, "below_ground", marked)
    monkeypatch.setattr(chunk, "out_of_world", marked)
    run = Run(Combination("push", "balanced", "bang-bang", "scene"), 1, WORLDS)
    run.advance(8)
    run._ended[4] = True  # its next episode starts
    figures = run.advance(4)
    assert (figures.sank, figures.escaped) == (4, 1)


def test_a_failure_is_saved_and_replays_bitwise(monkeypatch, folder, capsys):
    marked = np.arange(WORLDS) == 5

    def below_ground(world):
        return marked if run._steps == 12 else ~marked & False

    monkeypatch.setattr(chunk, "below_ground", below_ground)
    run = Run(PUSH, 1, WORLDS)
    assert run.advance(12).sank == 1
    (path,) = folder.iterdir()
    assert path.name == "push_balanced_resets_scene_1_sank_1.json"
    failure = load(path)
    again = MeasuredRunner("push", "balanced", "scene", 1, 1)
    again.start_episode(failure.seed, failure.episode)
    for action in failure.actions:
        again.step(np.array([action]))
    assert np.array_equal(again.world.read().rows[0], run.runner.world.read().rows[5])
    replay(path)
    shown = capsys.readouterr().out
    assert "push at balanced, scene parameters: the centre of a body" in shown
    assert f"step {len(failure.actions) - 1}\n" in shown
    assert "block on ground: 8 points" in shown


def test_parameters_are_hostile_and_new_in_each_episode():
    made = MeasuredRunner("push", "balanced", "random", 200, 1)
    masses = []
    for episode in range(2):
        made.start_episode(seed=1, episode=episode)
        masses.append(made.world.parameters.mass[0, 0])
    made._seeds[:] = np.arange(200)
    made.reset(np.ones(200, dtype=bool))
    drawn = made.world.parameters
    assert masses[0] != masses[1]
    least = LoadLimits(made.world.scene, made.world.fidelity).least_masses(drawn)
    assert (drawn.mass == least).sum() > 20  # as light as is accepted
    assert drawn.mass.min() < 2e-3
    assert drawn.mass.max() > 30.0
    assert drawn.friction.max() > 9.0
    assert drawn.size.min() < 0.2


def test_a_file_of_chunks_is_resumed(tmp_path, monkeypatch):
    path, calls = tmp_path / "chunks.csv", []

    def counted(combination, number, worlds, steps, compares):
        calls.append(number)
        return Figures(worlds * steps, 1, 0, number, 0, 0, 0, 0.1, 0.2 * number, 1, 0, 0, 1.0)

    monkeypatch.setattr(command, "run_chunk", counted)
    monkeypatch.setattr(command, "CHUNK", 4)
    command.run([PUSH], 8 * 4096, path)
    results = command.run([PUSH], 12 * 4096, path)
    assert calls == [0, 1, 2]
    assert report.load(path) == results
    total = report.total(results.values())
    assert total.deepest == 0.2 * max(number for _, number in results)
    assert report.table(results).rows[-1][0] == "all"


def test_steps_are_divided_by_speed():
    chunks = command.chunks_of([PUSH, PUSH._replace(preset="accurate")], 1e8)
    fast = sum(count for c, _, count in chunks if c.preset == "balanced")
    slow = sum(count for c, _, count in chunks if c.preset == "accurate")
    assert (fast + slow) * command.WORLDS == pytest.approx(1e8, rel=1e-3)
    assert fast > 4 * slow


def test_worlds_of_another_fidelity_measure_work_too():
    runner = MeasuredRunner("push", "fast", "scene", 2, 1)
    runner.reset(np.ones(2, dtype=bool), np.arange(2))
    runner.change_fidelity("balanced")
    assert runner.world.features.measures_work
