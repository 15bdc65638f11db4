"""How worlds are shared out over threads.

Kernels release the GIL, so plain Python threads run them side by side, and blocks of groups go to
whichever thread is free. One kernel serves one world and thousands. Unlike a runtime with threads
of its own inside the kernel, this survives a fork (the pool is made on first use, anew in a child),
runs under several Python threads at once, and takes any number of threads on any number of cores.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

from physics.scene.validation import integer

# fewer groups than this run in the caller's thread: waking another costs tens of microseconds
_BLOCK = 8

_pools: dict[int, ThreadPoolExecutor] = {}
os.register_at_fork(after_in_child=_pools.clear)


def default_threads() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_threads(threads: int | None) -> int:
    """Number of threads asked for; all cores if None."""
    return default_threads() if threads is None else integer("threads", threads, low=1)


def run_in_blocks(run: Callable[[int, int], int], count: int, threads: int) -> int:
    """Sum of run(first, last) over blocks that cover the groups 0 <= g < count, on threads."""
    threads = min(threads, -(-count // _BLOCK))
    if threads == 1:
        return run(0, count)
    block = max(_BLOCK, -(-count // (8 * threads)))
    firsts = iter(range(0, count, block))

    def workspace() -> int:
        # next() on a range iterator is atomic under the GIL
        return sum(run(first, min(first + block, count)) for first in firsts)

    if threads not in _pools:
        _pools[threads] = ThreadPoolExecutor(threads - 1, thread_name_prefix="worlds")
    others = [_pools[threads].submit(workspace) for _ in range(threads - 1)]
    try:
        failed = workspace()
    finally:  # no thread may still write when the caller hears of an error
        wait(others)
    return failed + sum(other.result() for other in others)
