"""Distributes worlds over threads.

Kernels release the GIL, so Python threads run them in parallel. Each thread takes the next block of
lane groups as soon as it is free. The same kernel serves one world and thousands of worlds.

Kernels with their own thread runtime (numba's `parallel=True`) have limits that this design avoids.
It works after a fork, because each process creates its thread pool on first use. Several Python
threads can call it at the same time. The number of threads is independent of the number of cores.
"""

import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

from physics.scene.validation import integer

# lane groups in a block, at least; with fewer groups only the caller's thread runs, because waking
# another thread costs tens of microseconds
_BLOCK = 8

_pools: dict[int, ThreadPoolExecutor] = {}
# of threads that wait for each other. One call at a time has them, or two could wait for ever, each
# for threads that the other has
_teams: dict[int, ThreadPoolExecutor] = {}
_team_lock = threading.Lock()


def _after_fork() -> None:
    """Threads of the parent process don't exist in the child."""
    global _team_lock
    _pools.clear()
    _teams.clear()
    _team_lock = threading.Lock()


if hasattr(os, "register_at_fork"):  # Windows has no fork
    os.register_at_fork(after_in_child=_after_fork)


def default_threads() -> int:
    """Number of cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_threads(threads: int | None) -> int:
    """The requested number of threads; the number of cores if None.

    Raises:
        TypeError, ValueError: not an integer, or below 1.
    """
    return default_threads() if threads is None else integer("threads", threads, low=1)


def run_in_blocks(run: Callable[[int, int], int], count: int, threads: int) -> int:
    """Calls run(first, last) for blocks of lane groups and returns the sum of the results.

    Args:
        run: processes the groups first <= g < last.
        count: number of groups; the blocks cover 0 <= g < count.
        threads: largest number of threads, the caller's included.
    """
    threads = min(threads, -(-count // _BLOCK))
    if threads == 1:
        return run(0, count)
    block = max(_BLOCK, -(-count // (8 * threads)))
    firsts = iter(range(0, count, block))

    def run_blocks() -> int:
        # the threads share `firsts`: next() on a range iterator is atomic under the GIL
        return sum(run(first, min(first + block, count)) for first in firsts)

    if threads not in _pools:
        _pools[threads] = ThreadPoolExecutor(threads - 1, thread_name_prefix="worlds")
    futures = [_pools[threads].submit(run_blocks) for _ in range(threads - 1)]
    try:
        total = run_blocks()
    finally:  # all threads must have stopped writing before an error reaches the caller
        wait(futures)
    return total + sum(future.result() for future in futures)


def run_together(run: Callable[[int], object], threads: int) -> None:
    """Calls run(0), run(1), ... run(threads - 1) at the same time, the first in this thread.

    They may wait for each other. If the machine has fewer cores, they take turns.
    """
    if threads == 1:
        run(0)
        return
    with _team_lock:
        if threads not in _teams:
            _teams[threads] = ThreadPoolExecutor(threads - 1, thread_name_prefix="team")
        futures = [_teams[threads].submit(run, thread) for thread in range(1, threads)]
        try:
            run(0)
        finally:
            wait(futures)
        for future in futures:
            future.result()
