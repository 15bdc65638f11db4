"""Claims: of several processes that need the same code, one compiles it and the others wait.

A claim is a lock on one byte of a file in the cache's folder, at a place that the code's digest
gives. The system releases it when the process ends, however it ends, so none can be left behind.
Where there are no such locks (Windows, some network drives), every process compiles for itself.

No process can wait for ever: a process that waits for a function compiles one that calls it, so
whoever compiles what it waits for is further down the tree of calls.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from physics.compiler.files.code_cache import folders

fcntl: Any
try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

_NAME = "claims"
# of this process. It stays open, as closing it would give up all claims; a child of a fork holds
# none of its parent's
_file: dict[str, int] = {}


def _descriptor() -> int | None:
    """The file, open; None if it can't be written."""
    if "open" not in _file:
        for folder in folders():
            with suppress(OSError):
                folder.mkdir(parents=True, exist_ok=True)
                _file["open"] = os.open(folder / _NAME, os.O_RDWR | os.O_CREAT, 0o666)
                break
    return _file.get("open")


def _place(digest: str) -> int:
    return int(digest[:15], 16)  # 60 bits: an offset has 63


def can_claim() -> bool:
    """Whether processes can share what they compile."""
    return fcntl is not None and _descriptor() is not None


@contextmanager
def claimed(digest: str) -> Iterator[None]:
    """Waits until no other process has claimed the code with a digest, and claims it."""
    descriptor = _descriptor() if fcntl else None
    held = False
    if descriptor is not None:
        with suppress(OSError):  # without locks every process compiles for itself
            fcntl.lockf(descriptor, fcntl.LOCK_EX, 1, _place(digest))
            held = True
    try:
        yield
    finally:
        if held:
            fcntl.lockf(descriptor, fcntl.LOCK_UN, 1, _place(digest))


def is_claimed(digest: str) -> bool:
    """Whether another process has claimed the code with a digest."""
    descriptor = _descriptor() if fcntl else None
    if descriptor is None:
        return False
    try:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, _place(digest))
    except OSError:
        return True
    fcntl.lockf(descriptor, fcntl.LOCK_UN, 1, _place(digest))
    return False
