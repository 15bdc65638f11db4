"""Content of the wheel."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.packaging

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> zipfile.ZipFile:
    """The wheel, built from a copy so that the source tree gets no build folder."""
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        (source / name).write_bytes((ROOT / name).read_bytes())
    for folder in ("physics", "rigid_envs", "training", "configs", "results", "tests"):
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in (".py", ".yaml", ".typed", ".safetensors"):
                copy = source / file.relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                copy.write_bytes(file.read_bytes())
    out = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", out, source],
        check=True,
        capture_output=True,
    )
    (path,) = out.glob("*.whl")
    return zipfile.ZipFile(path)


def test_wheel_holds_every_module_and_setting(wheel):
    names = set(wheel.namelist())
    for folder in ("physics", "rigid_envs", "training"):
        modules = {str(file.relative_to(ROOT)) for file in (ROOT / folder).rglob("*.py")}
        assert modules
        assert modules <= names
        assert f"{folder}/py.typed" in names
    settings = {f"training/configs/{file.name}" for file in (ROOT / "configs").glob("*.yaml")}
    assert {"training/configs/ppo.yaml", "training/configs/sac.yaml"} <= settings <= names
    for task in ("PickAndPlace", "Push", "PushT", "Reach", "Slide", "Stack", "Throw"):
        assert f"training/shipped/ppo/RigidEnvs-{task}-v0_seed0/policy.safetensors" in names


def test_wheel_holds_nothing_else(wheel):
    tops = {name.split("/")[0] for name in wheel.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {
        "physics",
        "rigid_envs",
        "training",
    }
    assert not any("__pycache__" in name for name in wheel.namelist())


def test_wheel_installs_the_command(wheel):
    (entry_points,) = [n for n in wheel.namelist() if n.endswith("entry_points.txt")]
    assert "rigid-envs = training.commands.cli:main" in wheel.read(entry_points).decode()


def test_who_installed_the_wheel_films_a_trained_policy(wheel, tmp_path):
    """Only what the wheel holds is imported: in another folder, without the source tree."""
    wheel.extractall(tmp_path / "site")
    program = (
        "import sys\n"
        f"sys.path.insert(0, {str(tmp_path / 'site')!r})\n"
        "from training.commands import cli\n"
        "import physics, training\n"
        f"assert training.__file__.startswith({str(tmp_path)!r}), training.__file__\n"
        "sys.exit(cli.main(sys.argv[1:]))\n"
    )
    words = ["record", "trained", "--env", "RigidEnvs/Push-v0", "-n", "1", "-o", "film.gif"]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-P", "-c", program, *words], cwd=tmp_path, env=environment,
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "film.gif").stat().st_size > 1000
