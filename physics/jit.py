"""How kernels are compiled: the only file that names numba options.

Two kinds of compiled function exist. A `kernel` is inlined or linked into whatever calls it and is
never called from Python. An `entry` is called from Python, releases the GIL and is cached on disk.

Numba's cache notices edits of the file that defines an entry, but not of the kernels that it calls.
Every entry therefore captures `SOURCES`, a hash of all sources of this package, in its closure:
numba hashes closure cells, so an edit anywhere in the package is a miss, and nothing stale runs.

Floating-point licence: `contract` (fused multiply-add) and no other. Every world runs the same
instructions in a vector lane of its own, so its result is the same to the last bit whatever runs in
the other lanes; NaN and infinity keep their meaning.
"""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit, typeof
from numba.core import config, event, types
from numba.extending import overload, register_jitable

Array = np.ndarray

_PACKAGE = Path(__file__).parent


def _hash_sources() -> int:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return int.from_bytes(digest.digest()[:7], "big")


SOURCES: int = _hash_sources()

# Worlds that a kernel works on side by side, one to a vector lane. Sixteen are two vectors of
# AVX-512 or four of AVX2. LLVM checks before every run of a loop that its arrays don't overlap,
# and thinks one of fewer turns too short to be worth it; and vectors that don't wait for each
# other hide how long a root or a division takes
LANES = 16

# Without reference counts: numba would count all arrays of a model and a state up and down, with
# atomic instructions, wherever control flow is too rich for it to see that this is idle. The
# price is that kernels can't allocate; scratch arrays come from Python.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "fastmath": {"contract"}}
_INLINE: Any = {"forceinline": True, **_OPTIONS}


def kernel(function: Any) -> Any:
    """A function on scalars, or one that is called seldom: compiled by itself."""
    return register_jitable(**_OPTIONS)(function)


def stage(function: Any) -> Any:
    """A stage, or a formula in its loop over lanes: merged into its caller."""
    return register_jitable(**_INLINE)(function)


def at(value: Any, i: int) -> Any:
    """A constant in lane i: the number itself, or the entry of an array with one for each lane.

    Which of them is settled by the type: for a number, nothing of this remains in the code.
    """
    return value[i] if isinstance(value, np.ndarray) else value


@overload(at, jit_options=_INLINE, strict=False)
def _at(value: Any, i: Any) -> Any:
    if isinstance(value, types.Array):
        return lambda value, i: value[i]
    return lambda value, i: value


def entry(function: Any) -> Any:
    """A function that Python calls: cached on disk, free of the GIL."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return _on_records(function)
    compiled = njit(cache=True, nogil=True, **_OPTIONS)(function)
    direct: list[Any] = []

    @wraps(function)
    def call(*arguments: Any) -> Any:
        # Callers see to it that an entry's arguments always have the same types and layout. Asking
        # for those of a dozen arrays of records at every call would take 3 microseconds, a fifth of
        # a single world's frame.
        if direct:
            return direct[0](*arguments)
        result = compiled(*arguments)
        direct.append(compiled.get_overload(tuple(map(typeof, arguments))))
        return result

    call.compiled = compiled  # type: ignore[attr-defined]
    return call


class _Listener(event.Listener):
    """Calls back when a kernel begins to be compiled; one from the disk needs none of it."""

    def __init__(self, tell: Callable[[str], object]) -> None:
        self.tell = tell

    def on_start(self, event: Any) -> None:
        self.tell(event.data["dispatcher"].py_func.__name__)

    def on_end(self, event: Any) -> None:
        pass


@contextmanager
def telling(tell: Callable[[str], object]) -> Iterator[None]:
    """Within it, `tell` is called with the name of each function that begins to be compiled."""
    with event.install_listener("numba:compile", _Listener(tell)):
        yield


def aligned_zeros(shape: int | tuple[int, ...], dtype: np.dtype) -> Array:
    """Zeros that begin at a cache line, as vectors of LANES doubles should."""
    line = 64
    size = int(np.prod(shape)) * dtype.itemsize
    room = np.zeros(size + line, dtype=np.uint8)
    first = -room.ctypes.data % line
    return room[first : first + size].view(dtype).reshape(shape)


def columns(shape: tuple[int, ...], count: int, dtype: Any) -> Array:
    """An empty array [*shape, count or a little more]: a column of worlds for each quantity.

    Columns are an odd number of cache lines long. Else those of a power of two of worlds would all
    begin in the same few sets of the cache, and writing a world's quantities would drive them out.
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

    return lambda *arguments: function(*map(records, arguments))
