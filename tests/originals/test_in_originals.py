"""Twins beside their originals. `make twins` installs these and names their interpreter."""

import os
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from scipy.stats import ks_2samp

from benchmarks.twins.recordings import KINDS, Recording, load_starts, record, starts
from rigid_envs.twins import TWINS
from training.commands import cli
from training.results.originals import Originals

PYTHON = os.environ.get("TWINS_PYTHON")
pytestmark = pytest.mark.skipif(PYTHON is None, reason="see make twins")
STARTS = 10_000
SIGNIFICANCE = 0.01


def test_starts_and_goals_have_the_distributions_of_the_originals():
    found = []
    for twin in TWINS.values():
        there = starts(twin.original, Path(PYTHON), STARTS)
        recorded = load_starts(twin.original)
        assert there.description["spaces"] == recorded.description["spaces"]
        envs = gym.make_vec(f"RigidEnvs/{twin.__name__}-v0", num_envs=STARTS)
        here, _ = envs.reset(seed=0)
        envs.close()
        for key in ("observation", "desired_goal"):
            # many goals have one height, which differs by round-off
            a, b = (x.astype(float).round(5) for x in (here[key], getattr(there, key)))
            for c in np.flatnonzero(np.ptp(b, axis=0) > 1e-4):
                found.append((ks_2samp(a[:, c], b[:, c]).pvalue, twin.original, key, c))
    for rank, (p, *what) in enumerate(sorted(found)):
        assert p > SIGNIFICANCE / (len(found) - rank), what


@pytest.mark.parametrize("name", ["fetch-axes", "panda-axes", "panda-pushes"])
def test_the_originals_still_do_what_was_recorded(name):
    again, recorded = record(KINDS[name], Path(PYTHON)), Recording.load(name)
    assert again.actions == pytest.approx(recorded.actions, abs=1e-6)
    assert again.observations == pytest.approx(recorded.observations, abs=1e-4)


def test_a_policy_that_was_trained_here_acts_there(tmp_path, capsys):
    for name, version in (("FetchReach", 4), ("PandaReach", 3)):
        words = ["--env", f"RigidEnvs/{name}-v0", "-f", str(tmp_path), "-n", "120000"]
        assert cli.main(["train", *words]) == 0
        there = ["--in", f"{name}-v{version}", "--python", PYTHON, "-n", "60"]
        assert cli.main(["evaluate", *words[:4], *there]) == 0
        shown = capsys.readouterr().out
        assert f"environment  {name}-v{version}" in shown
        success = next(line for line in shown.splitlines() if "success at any time" in line)
        assert float(success.split("│")[2].strip().rstrip("%")) >= 95.0, success


def test_frames_of_the_originals_are_pictures():
    with Originals("PandaReach-v3", 1, python=Path(PYTHON), render=True) as envs:
        envs.reset([0])
        frame = envs.frame()
        assert frame.shape == (480, 720, 3)
        assert frame.std() > 5.0
