"""Content of the wheel."""

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
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        (source / name).write_bytes((ROOT / name).read_bytes())
    for folder in ("physics", "rigid_envs", "training", "configs", "tests"):
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in (".py", ".yaml", ".typed"):
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
    settings = {str(file.relative_to(ROOT)) for file in (ROOT / "configs").glob("*.yaml")}
    assert {"configs/ppo.yaml", "configs/sac.yaml"} <= settings <= names


def test_wheel_holds_nothing_else(wheel):
    tops = {name.split("/")[0] for name in wheel.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {
        "physics",
        "rigid_envs",
        "training",
        "configs",
    }
    assert not any("__pycache__" in name for name in wheel.namelist())


def test_wheel_installs_the_command(wheel):
    (entry_points,) = [n for n in wheel.namelist() if n.endswith("entry_points.txt")]
    assert "rigid-envs = training.commands.cli:main" in wheel.read(entry_points).decode()
