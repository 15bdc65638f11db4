"""What the run with hostile actions calls wrong, and that a short run is right."""

import numpy as np
import pytest

from benchmarks import adversarial
from benchmarks.adversarial import ACTIONS, ALONE, problem


def steps(count=ALONE + 4):
    observation = {"observation": np.ones((count, 3)), "achieved_goal": np.ones((count, 3))}
    few = {name: values[:ALONE].copy() for name, values in observation.items()}
    return (observation, np.zeros(count)), (few, np.zeros(ALONE))


def test_problems_are_named():
    whole, alone = steps()
    assert problem(whole, alone, 0.01) == ""
    assert "height of -0.01 m" in problem(whole, alone, -0.01)
    alone[0]["observation"][5, 1] += 1e-16 * 4
    assert "observation differs" in problem(whole, alone, 0.01)
    whole[0]["achieved_goal"][97, 0] = np.nan
    assert "achieved_goal of world 97" in problem(whole, alone, 0.01)


def test_bang_bang_stays_at_the_limits_and_changes_sides():
    actions = ACTIONS["bang-bang"](3)
    before, after = next(actions), next(actions)
    assert np.array_equal(np.abs(after), np.ones_like(after))
    assert 0.1 < (before != after).mean() < 0.2


def test_a_short_run_finds_nothing_and_a_failure_is_saved(monkeypatch, tmp_path):
    row = adversarial.run("push", "balanced", "random", 4 * adversarial.WORLDS)
    assert row[:3] == ["push", "balanced", "random"]
    assert row[column("left the bounds")] == 0
    assert 0.0 < row[column("lowest centre m")] < 0.016
    monkeypatch.setattr(adversarial, "problem", lambda *_: "it is wrong")
    monkeypatch.setattr(adversarial, "ROOT", tmp_path)
    with pytest.raises(AssertionError, match=r"push at balanced, random actions, step 0: it is wr"):
        adversarial.run("push", "balanced", "random", 1e4)
    assert (tmp_path / ".failures" / "push_balanced_random.pickle").exists()


def column(name):
    return adversarial.COLUMNS.index(name)
