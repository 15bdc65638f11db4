"""Evaluation in the originals of twins, and what it refuses before a process starts."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from training.commands import cli
from training.policies.policy import Policy
from training.results import originals
from training.results.originals import Originals, check_twin, evaluate_original
from training.settings.errors import UsageError

POLICY = Policy(lambda observation: np.zeros((len(observation["observation"]), 4)),
                "RigidEnvs/FetchReach-v0", "still")  # fmt: skip

# a stand-in for the worker: episodes of five steps, which end in success where the seed is even
WORKER = """
import json, sys
for line in sys.stdin:
    request = json.loads(line)
    if "make" in request:
        reply = {"spaces": {}, "max_episode_steps": 5, "versions": {"mujoco": "3"}}
    else:
        if "reset" in request:
            seeds, step = request["reset"], 0
        else:
            step += 1
        n = len(seeds)
        reply = {"observation": [[0.0] * 10] * n, "achieved_goal": [[0.0] * 3] * n,
                 "desired_goal": [[0.0] * 3] * n}
        if step:
            reply.update(reward=[-0.5] * n, terminated=[False] * n, truncated=[step == 5] * n,
                         is_success=[step == 5 and s % 2 == 0 for s in seeds])
    print(json.dumps(reply), flush=True)
"""


def test_the_policy_must_be_of_the_twin():
    for env_id in ("FetchReach-v4", "FetchReach-v2", "FetchReachDense-v4"):
        check_twin(POLICY, env_id)
    check_twin(replace(POLICY, env_id="RigidEnvs/FetchReachDense-v0"), "FetchReach-v4")
    with pytest.raises(UsageError, match="trained on RigidEnvs/FetchReach-v0; only one of "
                       "RigidEnvs/PandaReach-v0 acts in PandaReach-v3"):  # fmt: skip
        check_twin(POLICY, "PandaReach-v3")
    with pytest.raises(UsageError, match="trained on RigidEnvs/Push-v0; only one of"):
        check_twin(replace(POLICY, env_id="RigidEnvs/Push-v0"), "FetchPush-v4")
    message = (
        r"has no twin here; did you mean 'PandaReach-v3'\? There are twins of FetchPickAndPlace"
    )
    with pytest.raises(UsageError, match=message):
        check_twin(POLICY, "HandReach-v3")


def test_episodes_are_counted_as_at_home(tmp_path, monkeypatch):
    worker = tmp_path / "worker.py"
    worker.write_text(WORKER)
    monkeypatch.setattr(originals, "WORKER", worker)
    monkeypatch.setattr(originals, "WORLDS", 3)
    policy, result, versions = evaluate_original(POLICY, "FetchReach-v4", 20, seed=7)
    assert policy.env_id == "FetchReach-v4"
    assert result.success_at_end.tolist() == [seed % 2 == 0 for seed in range(7, 27)]
    assert result.length.tolist() == [5] * 20
    assert versions == {"mujoco": "3"}
    assert result.episode_return == pytest.approx(np.full(20, -2.5))


def test_what_is_missing_is_named_with_the_command_that_installs_it(tmp_path, monkeypatch):
    monkeypatch.setattr(originals, "INTERPRETER", tmp_path / "none")  # `make twins` may have run
    with pytest.raises(
        UsageError, match=r"lacks it; run `make twins`, or `.*pip install panda-gym"
    ):
        Originals("PandaReach-v3", 1)
    with pytest.raises(UsageError, match="which is no file; `make twins` makes one"):
        Originals("PandaReach-v3", 1, python=tmp_path / "python")
    text = tmp_path / "text"
    text.write_text("no program")
    with pytest.raises(UsageError, match=r"text can't run: Permission denied"):
        Originals("PandaReach-v3", 2, python=text, processes=2)
    with pytest.raises(
        UsageError, match=r"echo is no Python interpreter: it said|echo ended while it ran"
    ):
        Originals("PandaReach-v3", 1, python=Path("/bin/echo"))
    worker = tmp_path / "worker.py"
    failing = {"error": "AssertionError: "}
    worker.write_text(f"print({json.dumps(json.dumps(failing))}, flush=True)\ninput()")
    monkeypatch.setattr(originals, "WORKER", worker)
    with pytest.raises(
        UsageError, match=r"a mujoco that Gymnasium-Robotics 1.4.2 can't use.*3.2.7"
    ):
        Originals("FetchReach-v4", 1)
    worker.write_text("import a_package_that_is_not_there")
    with pytest.raises(UsageError, match=r"FetchReach-v4 can't run: .* lacks it; run `make twins`"):
        Originals("FetchReach-v4", 1)
    worker.write_text("")
    with pytest.raises(UsageError, match="ended while it ran FetchReach-v4"):
        Originals("FetchReach-v4", 1)


def test_the_command_refuses_before_it_starts_anything(capsys):
    words = ["evaluate", "trained", "--env", "RigidEnvs/Push-v0", "--in", "FetchPush-v4"]
    assert cli.main(words) == 2
    assert "only one of RigidEnvs/FetchPush-v0 acts in FetchPush-v4" in capsys.readouterr().err
    assert cli.main([*words, "--fidelity", "fast"]) == 2
    assert "--in has its own environment" in capsys.readouterr().err
    assert sys.executable
