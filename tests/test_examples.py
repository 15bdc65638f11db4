"""The examples run as they stand."""

import json
import runpy
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def ppo():
    return runpy.run_path(str(EXAMPLES / "ppo.py"))


def test_ppo_runs_for_a_few_updates(ppo, capsys):
    words = ["--num-envs", "64", "--total-steps", "9600", "--batch-size", "1600", "--stop-at", "2"]
    success = ppo["train"](ppo["parse"](words))
    assert 0.0 <= success <= 1.0
    assert capsys.readouterr().out.count("solved") == 3


def test_its_normaliser_has_the_mean_and_variance_of_all_that_it_saw(ppo):
    rng, normalizer = np.random.default_rng(0), ppo["Normalizer"](3)
    batches = [rng.normal(5.0, 2.0, (n, 3)) for n in (1, 10, 300)]
    for batch in batches:
        normalizer.update(batch)
    together = np.concatenate(batches)
    np.testing.assert_allclose(normalizer.mean, together.mean(axis=0), rtol=1e-4)
    np.testing.assert_allclose(normalizer.variance, together.var(axis=0), rtol=1e-2)


def test_the_notebook_runs_from_top_to_bottom(monkeypatch, capsys):
    mpl.use("Agg")
    monkeypatch.chdir(ROOT)  # where README and docs tell to run it
    cells = json.loads((EXAMPLES / "tour.ipynb").read_text())["cells"]
    names: dict = {"__name__": "notebook"}
    for n, cell in enumerate(cells):
        if cell["cell_type"] == "code":
            assert not cell["outputs"]  # which would make the file large
            exec(compile("".join(cell["source"]), f"cell {n}", "exec"), names)
    assert "solved: True" in capsys.readouterr().out
