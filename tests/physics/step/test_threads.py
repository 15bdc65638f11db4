"""Blocks cover every world once, on as many threads as asked for, in a forked child as well."""

import multiprocessing
import subprocess
import sys
import threading

import pytest

from physics import World
from physics.reference import scenes
from physics.step.threads import check_threads, default_threads, run_in_blocks


@pytest.mark.parametrize("count", [1, 63, 64, 65, 1000, 4096])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_blocks_cover_every_world_once(count, threads):
    seen, lock = [], threading.Lock()

    def run(first, last):
        with lock:
            seen.extend(range(first, last))
        return last - first

    assert run_in_blocks(run, count, threads) == count
    assert sorted(seen) == list(range(count))


def test_an_error_in_any_thread_is_raised():
    def run(first, last):
        if last == 1000:
            raise ValueError("the last block")
        return 0

    with pytest.raises(ValueError, match="the last block"):
        run_in_blocks(run, 1000, 4)


def test_all_cores_are_used_unless_told_otherwise():
    assert check_threads(None) == default_threads() >= 1
    assert check_threads(3) == 3


def fall(count=200):
    world = World(scenes.push_like(), count=count, threads=2)
    world.advance(0.01)
    return float(world.position[-1, 0, 2])


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_child_runs_threads_of_its_own():
    if "fork" not in multiprocessing.get_all_start_methods():
        pytest.skip("no fork on this platform")
    here = fall()
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(fall).get(timeout=60) == here


def test_several_python_threads_advance_worlds_at_once():
    heights = []
    workers = [threading.Thread(target=lambda: heights.append(fall())) for _ in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(timeout=60)
    assert heights == [fall()] * 4


def test_a_system_without_fork_can_import_the_package():
    """As Windows; the libraries have their own tests for that."""
    program = "import os, numba, gymnasium; del os.register_at_fork; import physics, rigid_envs"
    subprocess.run([sys.executable, "-c", program], check=True)
