"""Compiled code on disk: damaged files, folders that refuse, several processes, edits."""

import errno
import logging
import os
import shutil
import subprocess
import sys
from collections import namedtuple
from pathlib import Path

import numba
import numpy as np
import pytest

import physics
from physics.compiler.files import code_cache

PACKAGE = Path(physics.__file__).parent

# an entry that calls two stages of the engine, and the smallest kernel that advances worlds
TURN = """
import numpy as np
from physics.compiler.jit import entry
from physics.motion.vectors import cross, rotated_back
@entry
def turn(R, out):
    for i in range(out.shape[0]):
        x, y, z = rotated_back(R, i, 1.0, 2.0, 3.0)
        out[i] = cross(x, y, z, 3.0, 2.0, 1.0)[0]
out = np.zeros(32)
turn(np.arange(288.0).reshape(9, 32), out)
stats = turn.compiled.stats
print(sum(stats.cache_misses.values()), out[5])
"""
FALL = """
from physics import Body, Scene, Sphere, World
from physics.step.time_layers import make_advance
world = World(Scene([Body(Sphere(0.1))]), count=144, threads=2, kernel="special")
world.advance(1.0)
compiled = make_advance(world.features).compiled
print(sum(compiled.stats.cache_misses.values()), world.position[0, 0, 2])
"""


def run(cache, program=TURN, root=PACKAGE.parent, **variables):
    """A process of its own: the numbers that it prints, and what it writes to stderr."""
    environment = {
        **os.environ, "PYTHONPATH": str(root), "NUMBA_CACHE_DIR": str(cache),
        "PYTHONDONTWRITEBYTECODE": "1", **variables,
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment, cwd=root, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return [float(x) for x in done.stdout.split()], done.stderr


def files(cache):
    """Names of what is kept, with the time at which each was written."""
    kept = [*Path(cache).rglob("*.kernel"), *Path(cache).rglob("*.stage")]
    return {path.name: path.stat().st_mtime_ns for path in kept}


@pytest.fixture(scope="module")
def used(tmp_path_factory):
    """A copy of the package, a cache that has seen `TURN` once, and its result."""
    root = tmp_path_factory.mktemp("copy")
    shutil.copytree(PACKAGE, root / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    (misses, result), _ = run(root / "cache", root=root)
    assert misses == 1
    return root, root / "cache", result


@pytest.fixture
def copied(used, tmp_path):
    """The same, for a test that changes them."""
    root, _, result = used
    shutil.copytree(root, tmp_path / "all")
    return tmp_path / "all", tmp_path / "all" / "cache", result


def test_damaged_files_are_compiled_again(copied):
    """One is empty, one has lost its end, one is of another program."""
    root, cache, result = copied
    damages = (lambda b: b"", lambda b: b[:-9], lambda b: b"foreign" * 99)
    kept = [path for path in cache.rglob("*.*") if path.suffix in (".kernel", ".stage")]
    for turn in range(3):  # each file is damaged in each way
        for path, n in zip(kept, range(turn, 99), strict=False):
            path.write_bytes(damages[n % 3](path.read_bytes()))
        assert run(cache, root=root)[0] == [1.0, result]
    assert run(cache, root=root)[0] == [0.0, result]


def test_what_refers_to_a_module_that_is_not_here_is_compiled_again(tmp_path):
    """As the code of a page or a cell, in which a user defines a stage."""
    (tmp_path / "page.txt").write_text(TURN)
    program = "exec(compile(open({0!r}).read(), {0!r}, 'exec'), {{'__name__': 'elsewhere'}})"
    program = program.format(str(tmp_path / "page.txt"))
    first, again = (run(tmp_path / "cache", program)[0] for _ in range(2))
    assert first == again


def test_a_complete_cache_may_be_read_only(copied):
    root, cache, result = copied
    for path in [*cache.rglob("*"), cache]:
        path.chmod(0o555 if path.is_dir() else 0o444)
    try:
        assert run(cache, root=root) == ([0.0, result], "")
    finally:
        for path in [cache, *cache.rglob("*")]:
            path.chmod(0o755)


def test_a_folder_that_cannot_be_made_is_named_once(used, tmp_path):
    root, _, result = used
    (tmp_path / "file").write_text("not a folder")
    (misses, again), log = run(tmp_path / "file", root=root)
    assert (misses, again) == (1.0, result)
    assert log.count("can't be kept in") == 1
    assert str(tmp_path / "file") in log
    assert "Traceback" not in log


def test_a_full_disk_is_reported_once(tmp_path, monkeypatch, caplog):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    code_cache._warn_once.cache_clear()
    monkeypatch.setattr(code_cache, "folders", lambda: [tmp_path])
    monkeypatch.setattr(code_cache.os, "replace", full)
    file = code_cache.CodeFile(files, "types", "target", "stage")
    with caplog.at_level(logging.WARNING, "physics"):
        file.save("content")
        file.save("content")
    assert [r.getMessage() for r in caplog.records] == [
        f"compiled kernels can't be kept in {tmp_path} ([Errno 28] No space left on device), so "
        "the next process compiles them again; NUMBA_CACHE_DIR names another folder"
    ]
    assert list(tmp_path.iterdir()) == []
    assert file.load() is None


def test_a_file_is_read_by_what_made_it_only(tmp_path, monkeypatch):
    def file(types="types", target="target"):
        return code_cache.CodeFile(files, types, target, "stage")

    monkeypatch.setattr(code_cache, "folders", lambda: [tmp_path])
    assert file().load() is None
    file().save("content")
    assert file().load() == "content"
    assert file(types="others").load() is None
    assert file(target="another processor").load() is None
    monkeypatch.setattr(code_cache, "_MADE_BY", b"other versions")
    assert file().load() is None
    (path,) = tmp_path.iterdir()
    path.rename(tmp_path / file().name)  # as if it had been made by these
    monkeypatch.setattr(code_cache.pickle, "loads", pytest.fail)  # not even looked at
    assert file().load() is None


def test_the_order_of_a_named_tuple_s_fields_counts():
    """Whose types may be the same: an old kernel would take one array for the other."""
    column = numba.typeof(np.zeros(3))
    digests = {
        code_cache.CodeFile(
            files,
            (numba.types.NamedUniTuple(column, 2, namedtuple("Memory", names)),),
            "",
            "kernel",
        ).digest
        for names in ("near far", "far near", "near far")
    }
    assert len(digests) == 2


def test_processes_that_compile_the_same_kernel_at_once_agree(used, tmp_path):
    root, _, result = used
    both = [
        subprocess.Popen(
            [sys.executable, "-c", TURN], cwd=root, text=True, stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": str(root), "NUMBA_CACHE_DIR": str(tmp_path)},
        )
        for _ in range(2)
    ]  # fmt: skip
    printed = [process.communicate(timeout=300)[0].split() for process in both]
    assert [float(printed_) for _, printed_ in printed] == [result, result]
    assert run(tmp_path, root=root)[0] == [0.0, result]
    kept = os.listdir(tmp_path / "rigid-envs")
    assert all(name == "claims" or name.endswith((".kernel", ".stage")) for name in kept)


def test_an_installed_package_keeps_its_code_with_the_user(tmp_path):
    packages, home = tmp_path / "site-packages", tmp_path / "home"
    shutil.copytree(PACKAGE, packages / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    run("", root=packages, XDG_CACHE_HOME=str(home), HOME=str(home))
    assert not files(packages)
    if sys.platform == "linux":
        assert files(home)


# --- edits --------------------------------------------------------------------------------------


def edit(root, file, line, other):
    path = root / "physics" / file
    source = path.read_text()
    assert line in source
    path.write_text(source.replace(line, other))


def test_an_edit_of_a_stage_in_another_file_is_compiled(copied):
    root, cache, result = copied
    before = files(cache)
    line = "return ay * bz - az * by"
    edit(root, "motion/vectors.py", line, f"{line} + 1.0")
    (misses, more), _ = run(cache, root=root)
    assert (misses, more) == (1.0, result + 1.0)
    new = {name.split(".")[0] for name in files(cache).keys() - before.keys()}
    assert new == {"cross", "turn"}
    edit(root, "motion/vectors.py", f"{line} + 1.0", line)
    assert run(cache, root=root)[0] == [0.0, result]


def test_an_edit_that_no_kernel_can_reach_compiles_nothing(copied):
    root, cache, result = copied
    edit(root, "motion/vectors.py", "The cross product", "Edited: the cross product")
    edit(root, "tuning/tune.py", "import math\n", "import math\n\nEDITED = 1\n")
    with (root / "physics" / "motion" / "vectors.py").open("a") as file:
        file.write("EDITED = 1\n")
    assert run(cache, root=root) == ([0.0, result], "")


def test_an_edit_of_the_compiler_compiles_everything(copied):
    root, cache, result = copied
    edit(root, "compiler/fusion.py", "import re\n", "import re\n\nEDITED = 1\n")
    assert run(cache, root=root)[0] == [1.0, result]
