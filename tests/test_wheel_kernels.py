"""A wheel with kernels: the first step of every task at every preset, and nothing is compiled."""

import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from physics.compiler.files import code_cache
from physics.compiler.files.levels import offered

pytestmark = [
    pytest.mark.packaging,
    pytest.mark.skipif(not offered(), reason="kernels are compiled for x86-64-v3 and above"),
]

ROOT = Path(__file__).resolve().parents[1]

STEPS = """
import logging, sys
logging.getLogger("physics").addHandler(logging.StreamHandler(sys.stdout))
import gymnasium as gym, physics, rigid_envs
assert "site-packages" in physics.__file__, physics.__file__
for name in sys.argv[1:]:
    for preset in ("fast", "balanced", "accurate", "solid"):
        env = gym.make(f"RigidEnvs/{name}-v0", fidelity=preset)
        env.reset(seed=0)
        env.step(env.action_space.sample())
"""
TASKS = ("PickAndPlace", "Push", "PushT", "Reach", "Slide", "Stack", "Throw")


@pytest.fixture(scope="module")
def kernels(tmp_path_factory) -> Path:
    """The general kernels, and those of each task at one preset, for a level of processors."""
    folder = tmp_path_factory.mktemp("kernels")
    command = [sys.executable, "-m", "training.commands.cli", "compile", "--fidelity", "balanced"]
    command += ["--level", offered()[-1], "--into", str(folder)]
    environment = {k: v for k, v in os.environ.items() if k != "RIGID_ENVS_COMPILERS"}
    subprocess.run(command, cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
    return folder


@pytest.fixture(scope="module")
def wheel(kernels, tmp_path_factory) -> Path:
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("dist")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    for folder in ("physics", "rigid_envs", "training", "configs", "results"):
        ignored = shutil.ignore_patterns("__pycache__", "prebuilt")
        shutil.copytree(ROOT / folder, source / folder, ignore=ignored)
    shutil.copytree(kernels, source / "physics" / "prebuilt")
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", out, source],
        check=True,
        capture_output=True,
    )
    return next(out.glob("*.whl"))


def test_its_name_says_which_python_and_which_machines(wheel):
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert f"-{python}-{python}-" in wheel.name
    assert not wheel.name.endswith("-any.whl")
    assert wheel.stat().st_size < 50e6


def test_who_installs_it_compiles_nothing(wheel, tmp_path):
    """In a fresh environment, without pins, with an empty cache."""
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    install = [python, "-m", "pip", "install", "--quiet", wheel]
    subprocess.run(install, check=True, capture_output=True)

    def run(*words, **variables):
        """What is printed; no variable of this process but where programs are."""
        environment = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), **variables}
        done = subprocess.run(
            [python, "-P", "-c", *words], cwd=tmp_path, env=environment, capture_output=True,
            text=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    versions = "from physics.compiler.files.code_cache import versions; print(versions())"
    needed = code_cache.versions()
    if run(versions).strip() != needed:  # newer ones than those that compiled the kernels
        assert f"the kernels of this wheel need {needed}, found" in run(STEPS, *TASKS)
        return
    for task in TASKS:  # each in a process of its own: the first call decides a kernel's types
        assert run(STEPS, task, NUMBA_CACHE_DIR=str(tmp_path / "cache")) == ""
        assert not list((tmp_path / "cache").rglob("*.*"))
    # a processor that lacks the level compiles, and says so
    note = next((tmp_path / "venv").rglob(code_cache.NOTE))
    note.write_text("numba 0.1, llvmlite 0.1, Python 3.1\n")
    for kernel in note.parent.glob("*.kernel"):
        kernel.unlink()
    log = run(STEPS, "Reach")
    assert log.count("the kernels of this wheel need numba 0.1, llvmlite 0.1, Python 3.1") == 1
