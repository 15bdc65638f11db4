"""How kernels are compiled: only this file and `linking` know numba's options.

There are three kinds of compiled functions:
- a `stage` is inlined into its caller: a stage of the substep, or a formula in a loop over lanes;
- a `sequence` is a stage that does little but call others, outside of loops over lanes;
- an `entry` is called from Python, releases the GIL and is cached on disk (see `code_cache`).

Products are fused with sums as `fusion` says; LLVM has no other licence to change floating-point
arithmetic. Every world runs the same operations in its own vector lane, so its result is bitwise
independent of its lane and of the other lanes; NaN and infinity keep their meaning.
"""

import gc
import logging
import os
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import cache, wraps
from typing import Any

import numpy as np
from numba import njit, typeof
from numba.core import config, event, types
from numba.core.compiler_lock import global_compiler_lock
from numba.extending import overload, register_jitable

from physics.compiler import helper, linking
from physics.compiler.files.claims import claimed
from physics.compiler.files.code_cache import report_unused_kernels
from physics.compiler.files.kernel_files import KernelFiles
from physics.compiler.interrupts import interrupts_kept
from physics.compiler.linking import EntryPipeline, SequencePipeline, StagePipeline
from physics.compiler.views import View

Array = np.ndarray

# "compiling ..." when a kernel isn't in the cache, and how long it took
LOGGER = logging.getLogger("physics")

# Worlds that a kernel works on side by side, one per vector lane: two vectors of AVX-512 or four of
# AVX2. LLVM checks before every run of a loop that its arrays don't overlap, and doesn't vectorise
# shorter loops; and independent vectors hide the latency of roots and divisions
LANES = 16

# `_nrt: False` turns off reference counts: numba would count all arrays of a model and a state with
# atomic instructions in every call. The price is that kernels can't allocate; working memory comes
# from Python
_OPTIONS: Any = {"error_model": "numpy", "_nrt": False}
_ENTRY: Any = {
    "pipeline_class": EntryPipeline, "nogil": True, "no_cfunc_wrapper": True, **_OPTIONS,
}  # fmt: skip
_INLINE: Any = {"forceinline": True, "no_cfunc_wrapper": True, **_OPTIONS}
_STAGE: Any = {"pipeline_class": StagePipeline, **_INLINE}


def stage(function: Any) -> Any:
    """Inlines a function into what calls it. From Python it runs as plain Python."""
    return register_jitable(**_STAGE)(function)


def sequence(function: Any) -> Any:
    """A stage that is optimised only as part of its caller, which compiles faster."""
    return register_jitable(pipeline_class=SequencePipeline, **_INLINE)(function)


def at(value: Any, i: int) -> Any:
    """A constant in lane i: the number itself, or the entry of an array with one per lane.

    The type decides, so for a number nothing of this remains in the compiled code.
    """
    return value[i] if isinstance(value, np.ndarray) else value


@overload(at, jit_options=_STAGE, strict=False)
def _at(value: Any, i: Any) -> Any:
    if isinstance(value, types.Array | View):
        return lambda value, i: value[i]
    return lambda value, i: value


# Held while an entry is compiled or read, so that a compilation is logged once. A fork takes it
# first, then numba's lock, as a compilation does: a child process would wait for a thread that it
# lacks. What is registered last is called first before a fork
_first_call = threading.RLock()
if hasattr(os, "register_at_fork"):  # Windows has no fork
    for _lock in (global_compiler_lock, _first_call):
        os.register_at_fork(
            before=_lock.acquire,
            after_in_parent=_lock.release,
            after_in_child=_lock.release,
        )


def entry(function: Any) -> Any:
    """A function that Python calls: cached on disk, without the GIL."""
    return _entry(function, logging.INFO)


def large_entry(function: Any) -> Any:
    """An entry that takes seconds to compile: logged as a warning, which shows by default."""
    return _entry(function, logging.WARNING)


def _entry(function: Any, level: int) -> Any:
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        plain = _on_records(function)
        plain.is_loaded = plain.is_compiled = lambda *_: True
        plain.prepare = plain.load = lambda *_: None
        return plain
    compiled = njit(**_ENTRY)(function)
    compiled._cache = KernelFiles(function)
    direct: list[Any] = []

    def file(types: Any) -> Any:
        return compiled._cache.file(types, compiled.targetctx)

    def load_types(types: Any) -> None:
        """Takes the entry for these types of arguments from disk, or compiles it."""
        with _first_call, ExitStack() as stack:
            if direct:
                return
            saved = file(types)
            if saved and not saved.exists():
                stack.enter_context(interrupts_kept())
                report_unused_kernels()
                start_helper(types)
                stack.enter_context(claimed(saved.digest))  # or waits until it is there
            stack.enter_context(
                event.install_listener("numba:compile", _Announcement(compiled, level))
            )
            stack.enter_context(_without_garbage_collection())
            compiled.compile(types)
            direct.append(compiled.get_overload(types))

    @wraps(function)
    def call(*arguments: Any) -> Any:
        # An entry's arguments always have the same memory layout. Looking up the types of a
        # dozen record arrays at every call would take 3 us, a fifth of a single world's frame
        if not direct:
            load(*arguments)
        return direct[0](*arguments)

    def load(*arguments: Any) -> None:
        load_types(tuple(map(typeof, arguments)))

    def is_compiled(*arguments: Any) -> bool:
        """Whether the entry has been compiled, now or by an earlier process."""
        if direct:
            return True
        saved = file(tuple(map(typeof, arguments)))
        return saved is not None and saved.exists()

    def start_helper(types: Any) -> None:
        saved = file(types)
        if saved is not None and hasattr(call, "recipe"):
            helper.start(call.recipe, types, saved.digest)

    def prepare(*arguments: Any) -> None:
        """Starts a second process that helps to compile the entry, if that is to be done."""
        if not is_compiled(*arguments):
            start_helper(tuple(map(typeof, arguments)))

    def compile_stages(types: Any) -> None:
        """Compiles what the entry calls, and not the entry itself."""
        linking.stop_before_entries = True
        with suppress(linking.Stopped), _without_garbage_collection():
            compiled.compile(types)

    entry: Any = call
    entry.compiled, entry.is_compiled, entry.is_loaded = compiled, is_compiled, direct.__len__
    entry.prepare, entry.compile_stages = prepare, compile_stages
    entry.load, entry.load_types, entry.file = load, load_types, file
    return entry


def load_all(calls: Sequence[tuple[Any, tuple[Any, ...]]]) -> None:
    """Takes entries from disk or compiles them: this process from the first, another from the last.

    Args:
        calls: entries, each with its arguments.
    """
    missing = [call for call in calls if not call[0].is_compiled(*call[1])]
    others = [
        (entry.recipe, tuple(map(typeof, arguments)))
        for entry, arguments in missing[1:]
        if hasattr(entry, "recipe")
    ]
    if others:
        helper.start_whole(others[::-1])
    for entry, arguments in missing:
        entry.load(*arguments)


def factory(make: Any) -> Any:
    """Makes each entry once, and notes how another process can make it."""

    @cache
    @wraps(make)
    def made(*arguments: Any) -> Any:
        entry = make(*arguments)
        entry.recipe = make.__module__, make.__qualname__, arguments
        return entry

    return made


@contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """While an entry is compiled.

    Numba makes millions of objects that live until the end; searching them took 7 % of the time.
    """
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


_being_compiled: list[str] = []


def being_compiled() -> str:
    """Name of the entry that this process compiles now; empty if none."""
    return next(iter(_being_compiled[-1:]), "")


class _Announcement(event.Listener):
    """Logs when an entry starts to compile, and when it is done; silent if it is in the cache."""

    def __init__(self, compiled: Any, level: int) -> None:
        self._compiled, self._level = compiled, level
        self._start = 0.0

    def on_start(self, event: Any) -> None:
        if event.data["dispatcher"] is self._compiled:
            self._start = time.perf_counter()
            name = self._compiled.py_func.__name__
            _being_compiled.append(name)
            LOGGER.log(self._level, "compiling kernel %r; later runs load it from a cache", name)

    def on_end(self, event: Any) -> None:
        if event.data["dispatcher"] is self._compiled:
            seconds = time.perf_counter() - self._start
            name = self._compiled.py_func.__name__
            _being_compiled.remove(name)
            LOGGER.log(self._level, "compiled kernel %r in %.1f s", name, seconds)


def aligned_zeros(shape: int | tuple[int, ...], dtype: np.dtype) -> Array:
    """Zeros that start at a cache line, as vectors of LANES doubles should."""
    line = 64
    size = int(np.prod(shape)) * dtype.itemsize
    room = np.zeros(size + line, dtype=np.uint8)
    first = -room.ctypes.data % line
    return room[first : first + size].view(dtype).reshape(shape)


def columns(shape: tuple[int, ...], count: int, dtype: Any) -> Array:
    """An empty array [*shape, count or a little more]: a column of worlds for each quantity.

    Columns are an odd number of cache lines long. With a power of two of worlds they would all
    start in the same few sets of the cache, and writing a world's quantities would evict them.
    """
    item = np.dtype(dtype).itemsize
    lines = -(-count * item // 64) | 1
    return np.empty((*shape, lines * 64 // item), dtype=dtype)


def _on_records(function: Any) -> Any:
    """With NUMBA_DISABLE_JIT=1: the same function, on tables whose fields have names."""

    def records(argument: Any) -> Any:
        if isinstance(argument, tuple):
            return type(argument)(*map(records, argument))
        if isinstance(argument, np.ndarray) and argument.dtype.names:
            return argument.view(np.recarray)
        return argument

    def call(*arguments: Any) -> Any:
        return function(*map(records, arguments))

    return call
