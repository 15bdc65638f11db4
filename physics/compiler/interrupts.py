"""Ctrl-C during a compilation: it ends the compilation, and none is lost.

A handler of SIGINT raises an exception wherever Python happens to be. In a finalizer or in a
callback from LLVM, which a compilation runs by the thousand, Python only reports the exception. So
it is kept, and raised again before the next function is compiled.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_raised: list[BaseException] = []  # by the handler, in the block of `interrupts_kept`


@contextmanager
def interrupts_kept() -> Iterator[None]:
    """Exceptions that the handler of SIGINT raises within the block leave the block.

    Only the main thread gets any, and blocks aren't nested.
    """
    before: Any = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    within = True

    def handle(*arguments: Any) -> None:
        try:
            before(*arguments)
        except BaseException as error:
            if within:
                _raised.append(error)
            raise

    _raised.clear()
    try:
        signal.signal(signal.SIGINT, handle)
        try:
            yield
        except Exception:
            raise_lost_interrupt()  # which may be why
            raise
        raise_lost_interrupt()
    finally:
        within = False
        signal.signal(signal.SIGINT, before)
        _raised.clear()


def raise_lost_interrupt() -> None:
    """Raises what the handler of SIGINT raised in this block, if that has not ended the block."""
    if _raised:
        raise _raised.pop()


@contextmanager
def interrupts_deferred() -> Iterator[None]:
    """Handles SIGINT after the block instead of within it, where an exception would do harm."""
    before: Any = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    seen: list[Any] = []
    signal.signal(signal.SIGINT, lambda *arguments: seen.append(arguments))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if seen:
            before(*seen[0])
