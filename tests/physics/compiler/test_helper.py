"""Two processes compile one kernel together; neither waits for the other for ever."""

import math
import os
import subprocess
import sys
import time

import pytest

from physics.compiler import helper
from physics.compiler.files import claims
from tests.physics.compiler.test_code_cache import FALL, PACKAGE, files, run

# keeps a claim until its input ends
HOLD = """
import sys
from physics.compiler.files.claims import claimed
with claimed(sys.argv[1]):
    print("held", flush=True)
    sys.stdin.read()
"""


def start(program, cache, *arguments):
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), "NUMBA_CACHE_DIR": str(cache)}
    return subprocess.Popen(
        [sys.executable, "-c", program, *arguments], env=environment, cwd=PACKAGE.parent,
        text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache of this process and of those that it starts."""
    monkeypatch.setattr(claims, "folders", lambda: [tmp_path / "rigid-envs"])
    monkeypatch.setattr(claims, "_file", {})
    return tmp_path


@pytest.mark.skipif(claims.fcntl is None, reason="no locks on this system")
@pytest.mark.parametrize("end", ["as it should", "killed"])
def test_a_claim_ends_with_its_process(cache, end):
    digest = "0123456789abcdef" * 2
    holder = start(HOLD, cache, digest)
    assert holder.stdout.readline() == "held\n"
    assert claims.is_claimed(digest)
    assert not claims.is_claimed(digest[::-1])
    holder.kill() if end == "killed" else holder.stdin.close()
    begin = time.monotonic()
    with claims.claimed(digest):  # waits until the other has ended
        assert time.monotonic() - begin < 30.0
    holder.wait()
    assert not claims.is_claimed(digest)


def test_a_kernel_is_compiled_once_by_one_process_or_two(tmp_path):
    """Announced once, however many threads ask for it; the next process compiles nothing."""
    (misses, height), log = run(tmp_path / "alone", FALL, RIGID_ENVS_COMPILERS="1")
    assert misses == 1.0
    assert log.count("compiling kernel 'advance'") == 1
    assert log.count("compiled kernel 'advance' in") == 1
    kept = files(tmp_path / "alone")
    assert len(kept) > 10
    assert run(tmp_path / "alone", FALL) == ([0.0, height], "")
    assert files(tmp_path / "alone") == kept
    together, log = run(tmp_path / "together", FALL, RIGID_ENVS_COMPILERS="2")
    assert together == [1.0, height]
    assert log.count("compiling kernel 'advance'") == 1
    assert "Traceback" not in log
    assert files(tmp_path / "together").keys() == kept.keys()


# kernels of two integrators; the third fidelity is refused
INTEGRATORS = """
from physics import Body, Fidelity, PointSpring, Scene, Sphere, World
from physics.tuning.motion import Course, compile_for
scene = Scene([Body(Sphere(0.1), mass=1.0)], fields=[PointSpring(0, 1.0)])
chosen = [Fidelity(), Fidelity(integrator="euler"), Fidelity(substep=100.0, integrator="rk4")]
compile_for(Course(scene, 1, 0.04, 2), chosen)
for fidelity in chosen[:2]:
    world = World(scene, fidelity, kernel="special")
    world.advance(0.1)
    print(world.position[0, 0, 2])
"""


def test_with_a_helper_for_whole_kernels_the_results_are_the_same(tmp_path):
    printed, log = run(tmp_path, INTEGRATORS, RIGID_ENVS_COMPILERS="2", RIGID_ENVS_KERNEL="special")
    assert "Traceback" not in log
    assert log.count("compiling kernel 'advance'") <= 2
    kept = files(tmp_path).keys()
    assert sum(name.startswith("advance.") for name in kept) == 2
    for path in tmp_path.rglob("advance.*.kernel"):
        path.unlink()
    alone, _ = run(tmp_path, INTEGRATORS, RIGID_ENVS_COMPILERS="1", RIGID_ENVS_KERNEL="special")
    assert alone == printed
    assert files(tmp_path).keys() == kept
    exact = -9.81 * (1.0 - math.cos(0.1))  # a spring that is loaded suddenly
    assert printed[0] == pytest.approx(exact, rel=1e-4)
    assert printed[1] == pytest.approx(exact, rel=0.05)  # Euler's steps


def test_a_helper_ends_with_the_process_that_started_it(cache):
    """Killed while it compiles: nothing is left behind, and the next process works."""
    process = start(FALL, cache)
    while not (cache / "rigid-envs" / "claims").exists():
        time.sleep(0.01)
    time.sleep(0.5)
    process.kill()
    process.wait()
    assert run(cache, FALL)[0][0] == 1.0  # compiled by this one
    assert run(cache, FALL)[0][0] == 0.0


@pytest.mark.parametrize("given", ["0", "two", ""])
def test_a_number_of_compilers_that_makes_no_sense(monkeypatch, given):
    monkeypatch.setenv("RIGID_ENVS_COMPILERS", given)
    with pytest.raises(ValueError, match="RIGID_ENVS_COMPILERS must be a positive integer"):
        helper.processes()
