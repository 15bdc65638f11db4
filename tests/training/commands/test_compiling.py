"""Kernels compiled ahead of time from the command line."""

import pytest

from physics.reference.general import GENERAL_KERNELS
from training.commands import compiling
from training.commands.cli import main


def test_it_compiles_general_kernels_and_those_of_environments(capsys, monkeypatch):
    done = []
    monkeypatch.setattr(compiling, "compile_general", done.append)
    monkeypatch.setattr(compiling, "_compile_environment", lambda *job: done.append(job))
    assert main(["compile", "RigidEnvs/Push-v0", "--fidelity", "fast", "solid"]) == 0
    push = "RigidEnvs/Push-v0"
    expected = [
        (push, "balanced", "general"),
        (push, "fast", "special"),
        (push, "solid", "special"),
    ]
    assert done == [*GENERAL_KERNELS, *expected]
    shown = capsys.readouterr().out
    assert "1/8 general kernel, springs ... " in shown
    assert "8/8 RigidEnvs/Push-v0, solid ... " in shown
    assert "8 compiled in " in shown


def test_all_tasks_at_all_presets_by_default(monkeypatch):
    done = []
    monkeypatch.setattr(compiling, "compile_general", done.append)
    monkeypatch.setattr(compiling, "_compile_environment", lambda *job: done.append(job))
    main(["compile", "--general-only"])
    assert len(done) == len(GENERAL_KERNELS) + 7
    main(["compile"])
    assert len(done) == 2 * (len(GENERAL_KERNELS) + 7) + 7 * 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["Push-v0"], "unknown environment 'Push-v0': choose from RigidEnvs/PickAndPlace-v0"),
        (["--fidelity", "best"], "unknown fidelity 'best': choose from fast, balanced"),
        (["--level", "sse"], "--level sse: choose from x86-64-v3, x86-64-v4"),
    ],
)
def test_mistakes_are_named_before_anything_is_compiled(capsys, arguments, message):
    assert main(["compile", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_an_environment_is_made_and_stepped():
    compiling._compile_environment("RigidEnvs/Reach-v0", "balanced", "general")
