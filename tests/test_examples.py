"""The examples run as they stand."""

import json
import os
import runpy
import subprocess
import sys
import types
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import torch

import rigid_envs  # noqa: F401  (registers the ids)
from training.policies import trained_policy
from training.policies.policy import Policy

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def ppo():
    return runpy.run_path(str(EXAMPLES / "ppo.py"))


def test_ppo_runs_for_a_few_updates(ppo, capsys):
    words = ["--num-envs", "64", "--total-steps", "9600", "--batch-size", "1600", "--stop-at", "2"]
    success = ppo["train"](ppo["parse"](words))
    assert 0.0 <= success <= 1.0
    assert torch.get_num_threads() == 1  # whatever the number of cores
    assert capsys.readouterr().out.count("solved") == 3


def test_ppo_refuses_less_than_one_update(ppo, capsys):
    with pytest.raises(SystemExit):
        ppo["parse"](["--total-steps", "100"])
    assert "--total-steps is 100, should be at least" in capsys.readouterr().err


def test_its_normaliser_has_the_mean_and_variance_of_all_that_it_saw(ppo):
    rng, normalizer = np.random.default_rng(0), ppo["Normalizer"](3)
    batches = [rng.normal(5.0, 2.0, (n, 3)) for n in (1, 10, 300)]
    for batch in batches:
        normalizer.update(batch)
    together = np.concatenate(batches)
    np.testing.assert_allclose(normalizer.mean, together.mean(axis=0), rtol=1e-4)
    np.testing.assert_allclose(normalizer.variance, together.var(axis=0), rtol=1e-2)


def test_a_policy_acts_in_a_script_of_fetch(monkeypatch, capsys):
    """With the twin in place of the original, which is another suite's."""
    original = types.ModuleType("gymnasium_robotics")
    monkeypatch.setitem(sys.modules, "gymnasium_robotics", original)
    monkeypatch.setitem(gym.registry, "FetchPush-v4", gym.spec("RigidEnvs/FetchPush-v0"))
    still = Policy(lambda batch: np.zeros((len(batch["observation"]), 4)), "", "still")
    monkeypatch.setattr(trained_policy, "trained_policy", lambda path: still)
    monkeypatch.setattr(sys, "argv", ["fetch_push.py", "push.safetensors"])
    runpy.run_path(str(EXAMPLES / "fetch_push.py"))
    solved, _, rest = capsys.readouterr().out.partition(" of ")
    assert rest == "20 episodes solved\n"
    assert int(solved) < 8  # goals may be near a cube that rests


def test_the_notebook_runs_from_top_to_bottom_in_any_folder(tmp_path):
    """In a process of its own, in which nothing is imported yet."""
    cells = json.loads((EXAMPLES / "tour.ipynb").read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] for cell in code)  # which would make the file large
    script = "\n".join("".join(cell["source"]) for cell in code)
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True,
        env={**os.environ, "MPLBACKEND": "agg", "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "solved: True" in done.stdout


def test_tqc_learns_from_hindsight_for_a_few_updates(capsys):
    example = runpy.run_path(str(EXAMPLES / "tqc_panda_push.py"))
    rate = example["main"](
        ["--env", "RigidEnvs/PandaReach-v0", "--steps", "3200", "--every", "1600"]
    )
    assert 0.0 <= rate <= 1.0
    assert capsys.readouterr().out.count("solved") == 2
