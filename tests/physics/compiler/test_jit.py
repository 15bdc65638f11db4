"""Compiled code is kept on disk until a source changes; without numba the stages are Python."""

import contextlib
import io
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import physics
from physics import World
from physics.compiler import code_cache
from physics.reference import scenes

PACKAGE = Path(physics.__file__).parent
ROOT = PACKAGE.parent

# a ball in free flight needs the fewest stages
FALL = """
import logging
from physics import Body, Scene, Sphere, World
from physics.step.time_layers import make_advance
lines = []
logging.getLogger("physics").addFilter(lambda record: lines.append(record.getMessage()))
world = World(Scene([Body(Sphere(0.1))]), count=32, threads=2)  # both wait for one compilation
world.advance(1.0)
stats = make_advance(world.features).compiled.stats
misses = sum(stats.cache_misses.values())
assert sum(line.startswith("compiling kernel 'advance'") for line in lines) == misses
assert sum(line.startswith("compiled kernel 'advance' in") for line in lines) == misses
print(sum(stats.cache_hits.values()), misses, world.position[0, 0, 2])
"""

# falls alike, by another kernel that has most stages in common
FALL_OF_A_BOX = FALL.replace("Sphere(0.1)", "Box((0.1, 0.2, 0.3))").replace("Sphere", "Box")

PUSH = """
from physics import World
from physics.reference import scenes
world = World(scenes.push_like(), per_world_parameters={per_world})
if world.features.per_world_parameters:
    world.set_parameters(mass=0.17, friction=0.3, restitution=0.4)
world.set_state(position=(0.0, 0.0, 0.0199), drive_position=(-0.0349, 0.0, 0.021))
world.command_drives((0.3, 0.1, 0.0))
world.advance(0.02)
values = (world.position, world.orientation, world.linear_velocity, world.angular_velocity)
values += (world.drive_position, world.contacts().force)
print(*[repr(float(x)) for v in values for x in v.ravel()])
"""


def run(program, cache, root=ROOT, **variables):
    """Numbers that a program prints in a process of its own."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(root),
        "NUMBA_CACHE_DIR": str(cache),
        "PYTHONDONTWRITEBYTECODE": "1",
        **variables,
    }
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment, cwd=root, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return [float(x) for x in done.stdout.split()]


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """A copy of the package and a cache that has seen it once."""
    root = tmp_path_factory.mktemp("copy")
    shutil.copytree(PACKAGE, root / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    cache = root / "cache"
    return root, cache, run(FALL, cache, root)


def test_a_second_process_compiles_nothing(copied):
    root, cache, (hits, misses, height) = copied
    assert (hits, misses) == (0, 1)
    files = {p: p.stat().st_mtime_ns for p in cache.rglob("*.nb*")}
    assert files
    assert run(FALL, cache, root) == [1.0, 0.0, height]
    assert {p: p.stat().st_mtime_ns for p in cache.rglob("*.nb*")} == files


def test_an_installed_package_keeps_its_code_with_the_user(tmp_path):
    packages, home = tmp_path / "site-packages", tmp_path / "home"
    shutil.copytree(PACKAGE, packages / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    assert run(FALL, "", packages, XDG_CACHE_HOME=str(home), HOME=str(home))[1] == 1.0
    assert not list(packages.rglob("*.nb*")) + list(packages.rglob("*.stage"))
    if sys.platform == "linux":
        assert list(home.rglob("*.nbc"))
        assert list(home.rglob("*.stage"))


def test_a_second_kernel_takes_its_common_stages_from_the_disk(copied):
    root, cache, (_, _, height) = copied
    before = {p: p.stat().st_mtime_ns for p in cache.rglob("*.stage")}
    assert len(before) > 10
    assert run(FALL_OF_A_BOX, cache, root) == pytest.approx([0.0, 1.0, height], rel=1e-12)
    after = {p: p.stat().st_mtime_ns for p in cache.rglob("*.stage")}
    assert 0 < len(after) - len(before) < len(before) / 2
    assert {p: after[p] for p in before} == before


def test_a_damaged_file_of_a_stage_counts_as_none(tmp_path, monkeypatch):
    monkeypatch.setattr(code_cache, "_folder", lambda: tmp_path)
    file = code_cache.StageFile(code_cache.is_cacheable, "types", "target")
    assert file.load() is None
    file.save("content")
    assert code_cache.StageFile(code_cache.is_cacheable, "types", "target").load() == "content"
    assert code_cache.StageFile(code_cache.is_cacheable, "other types", "target").load() is None
    (path,) = tmp_path.iterdir()
    for broken in (path.read_bytes()[:-9], b"", b"text"):
        path.write_bytes(broken)
        assert file.load() is None
    file.save("content")
    monkeypatch.setattr(code_cache, "_MADE_BY", b"other sources")
    monkeypatch.setattr(code_cache.pickle, "loads", pytest.fail)  # not even looked at
    assert file.load() is None


def test_what_a_stage_closes_over_tells_it_from_others():
    def make(value):
        return lambda: value

    identities = [
        repr(code_cache._identity(make(value)))
        for value in (1, 2, 1.0, True, None, "1", (1, 2), np.dtype("f8"), make(1), make(2))
    ]
    assert len(set(identities)) == len(identities)
    assert code_cache._identity(make((1, make(2)))) == code_cache._identity(make((1, make(2))))
    with pytest.raises(TypeError, match=r"closure of a stage holds \[1\], which is a list"):
        code_cache._identity(make([1]))


def test_an_edit_of_a_kernel_in_another_file_is_compiled(copied):
    root, cache, (_, _, height) = copied
    path = root / "physics" / "motion" / "gravity.py"
    source = path.read_text()
    line = "force[axis, i] = weight[axis, i]"
    assert line in source
    path.write_text(source.replace(line, f"{line} * 2.0"))
    assert run(FALL, cache, root) == pytest.approx([0.0, 1.0, 2.0 * height], rel=1e-12)
    path.write_text(source)
    assert run(FALL, cache, root) == [1.0, 0.0, height]


def test_an_edit_of_any_file_changes_the_key_of_the_cache(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    keys = {code_cache.hash_sources(tmp_path / "physics")}
    files = sorted((tmp_path / "physics").rglob("*.py"))
    for path in files:
        path.write_text(path.read_text() + "# edited\n")
        keys.add(code_cache.hash_sources(tmp_path / "physics"))
    assert len(keys) == len(files) + 1


def test_every_entry_point_carries_the_key_of_the_cache():
    """Numba looks at the values in an entry's closure, and the hash of all sources is one."""
    found = 0
    for path in [*PACKAGE.rglob("*.py"), *(ROOT / "rigid_envs").rglob("*.py")]:
        source = path.read_text()
        entries = source.count("@entry\n") + source.count("@large_entry\n")
        assert source.count("sources = SOURCES\n") == source.count("_ = sources\n") == entries, path
        found += entries
    assert found >= 2
    world = World(scenes.push_like())
    from physics.step.time_layers import make_advance

    function = make_advance(world.features).compiled.py_func
    cells = [c.cell_contents for c in function.__closure__]
    assert code_cache.SOURCES in [c for c in cells if isinstance(c, int)]


def test_only_five_files_know_numba():
    for path in PACKAGE.rglob("*.py"):
        if path.name not in ("atomics.py", "bundles.py", "code_cache.py", "jit.py", "linking.py"):
            assert "numba" not in "".join(
                line for line in path.read_text().splitlines(True) if "import" in line
            ), path


@pytest.mark.parametrize("per_world", [False, True])
def test_without_compilation_the_same_stages_give_the_same_numbers(tmp_path, per_world, stress):
    if per_world and not stress:
        pytest.skip("half a minute in plain Python; see make stress")
    script = PUSH.format(per_world=per_world)
    plain = run(script, tmp_path, NUMBA_DISABLE_JIT="1")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(script, {})  # in this process, which shares kernels with the other tests
    compiled = [float(x) for x in printed.getvalue().split()]
    assert len(plain) == len(compiled) > 20
    np.testing.assert_allclose(plain, compiled, rtol=1e-9, atol=1e-9)
