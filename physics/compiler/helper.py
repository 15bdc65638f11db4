"""A second process that helps to compile a kernel, so that two cores work on it.

It infers the types of the same entry, but takes the calls of every function from the last to the
first, and so compiles the stages from the other end. Both processes keep stages on disk and wait
for those that the other has claimed; where they meet, all stages are there. The helper then ends;
the entry is left to the process that called it. It also ends when that process does.

Of several entries it compiles whole ones, from the last to the first, until the two processes meet.

RIGID_ENVS_COMPILERS=1 turns helpers off.
"""

import atexit
import hashlib
import importlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from numba.core import typeinfer

from physics.compiler.files.claims import can_claim, claimed, is_claimed

_START = "import sys; sys.path[:] = {path!r}; from physics.compiler.helper import main; main()"


# module and name of the factory of an entry, and its arguments
Recipe = tuple[str, str, Any]

_started: set[str] = set()  # claims of the helpers that this process has started
_helpers: list[Any] = []  # the last one, if there is any


def processes() -> int:
    """How many processes compile a kernel: RIGID_ENVS_COMPILERS, else one for each core, up to two.

    Raises:
        ValueError: RIGID_ENVS_COMPILERS is not a positive integer.
    """
    given = os.environ.get("RIGID_ENVS_COMPILERS", "2")
    if not given.isdecimal() or int(given) < 1:
        raise ValueError(f"RIGID_ENVS_COMPILERS must be a positive integer, got {given!r}")
    if hasattr(os, "sched_getaffinity"):
        return min(int(given), len(os.sched_getaffinity(0)))
    return min(int(given), os.cpu_count() or 1)


def start(recipe: Recipe, types: Any, digest: str) -> None:
    """Starts a helper that compiles stages of an entry, unless there is one or none is allowed.

    A process has one helper at a time.

    Args:
        recipe: of the entry.
        types: of the entry's arguments.
        digest: of the entry's code.
    """
    claim = hashlib.sha256(f"helper of {digest}".encode()).hexdigest()
    busy = any(process.poll() is None for process in _helpers)
    if processes() > 1 and can_claim() and not (busy or claim in _started or is_claimed(claim)):
        _started.add(claim)
        _start(claim, [(recipe, types)])


def start_whole(entries: Sequence[tuple[Recipe, Any]]) -> None:
    """Starts a helper that compiles whole entries, one after the other; it replaces one at work.

    Args:
        entries: recipe of each, and types of its arguments.
    """
    if processes() > 1 and can_claim():
        for process in _helpers:
            _end(process)
        _start(None, entries)


def _start(claim: str | None, entries: Sequence[tuple[Recipe, Any]]) -> None:
    command = [sys.executable, "-c", _START.format(path=sys.path)]
    with suppress(OSError, TypeError, pickle.PicklingError):  # without a helper it takes longer
        job = pickle.dumps((claim, entries))
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        _helpers[:] = [process]
        atexit.register(_end, process)
        assert process.stdin is not None
        process.stdin.write(job)
        process.stdin.flush()  # and stays open: its end tells the helper that this process ended


def _end(helper: Any) -> None:
    """Ends a helper, if it is still at work."""
    helper.terminate()
    helper.wait()


def main() -> None:
    """What the helper does."""
    claim, entries = pickle.load(sys.stdin.buffer)
    os.environ["RIGID_ENVS_COMPILERS"] = "1"  # helpers have none
    threading.Thread(target=_end_with_parent, daemon=True).start()
    for (module, name, arguments), types in entries:
        entry = getattr(importlib.import_module(module), name)(*arguments)
        with suppress(Exception):
            if claim is None:
                file = entry.file(types)
                if file is None or file.exists() or is_claimed(file.digest):
                    return  # the other process has come so far
                entry.load_types(types)
                continue
            typeinfer.ConstraintNetwork.propagate = _propagate_backwards  # type: ignore[method-assign]
            with claimed(claim):
                entry.compile_stages(types)


def _end_with_parent() -> None:
    sys.stdin.buffer.read()  # returns when the other end is closed
    os._exit(0)


_propagate = typeinfer.ConstraintNetwork.propagate


def _propagate_backwards(network: Any, inference: Any) -> Any:
    network.constraints.reverse()
    try:
        return _propagate(network, inference)
    finally:
        network.constraints.reverse()
