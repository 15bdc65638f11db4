"""A second process that helps to compile a kernel, so that two cores work on it.

It infers the types of the same entry, but takes the calls of every function from the last to the
first, and so compiles the stages from the other end. Both processes keep stages on disk and wait
for those that the other has claimed; where they meet, all stages are there. The helper then ends;
the entry is left to the process that called it. It also ends when that process does.

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
from contextlib import suppress
from typing import Any

from numba.core import typeinfer

from physics.compiler.claims import can_claim, claimed, is_claimed

_START = "import sys; sys.path[:] = {path!r}; from physics.compiler.helper import main; main()"


_started: set[str] = set()  # claims of the helpers that this process has started


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


def start(recipe: tuple[str, str, Any], types: Any, digest: str) -> None:
    """Starts a helper for an entry, unless one is at work or isn't allowed.

    Args:
        recipe: module and name of the factory of the entry, and its arguments.
        types: of the entry's arguments.
        digest: of the entry's code.
    """
    name = _claim_of(digest)
    if name in _started or processes() < 2 or not can_claim() or is_claimed(name):
        return
    _started.add(name)
    command = [sys.executable, "-c", _START.format(path=sys.path)]
    with suppress(OSError, TypeError, pickle.PicklingError):  # without a helper it takes longer
        job = pickle.dumps((recipe, types, name))
        helper = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        atexit.register(_end, helper)
        assert helper.stdin is not None
        helper.stdin.write(job)
        helper.stdin.flush()  # and stays open: its end tells the helper that this process has ended


def _end(helper: Any) -> None:
    """Ends a helper, if it is still at work."""
    helper.terminate()
    helper.wait()


def _claim_of(digest: str) -> str:
    return hashlib.sha256(f"helper of {digest}".encode()).hexdigest()


def main() -> None:
    """What the helper does."""
    (module, name, arguments), types, claim = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    typeinfer.ConstraintNetwork.propagate = _propagate_backwards  # type: ignore[method-assign]
    with claimed(claim):
        entry = getattr(importlib.import_module(module), name)(*arguments)
        try:
            entry.compile_stages(types)
        except Exception:
            return


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
