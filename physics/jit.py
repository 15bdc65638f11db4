"""How kernels are compiled: the only file that names numba options.

Two kinds of compiled function exist. A `kernel` is inlined or linked into whatever calls it and is
never called from Python. An `entry` is called from Python, releases the GIL and is cached on disk.

Numba's cache notices edits of the file that defines an entry, but not of the kernels that it calls.
Every entry therefore captures `SOURCES`, a hash of all sources of this package, in its closure:
numba hashes closure cells, so an edit anywhere in the package is a miss, and nothing stale runs.

Floating-point licences: `contract` (fused multiply-add) everywhere. Loops over the contacts of a
pair add `reassoc` and `nsz`, without which sums can't run in vector lanes. NaN and infinity keep
their meaning everywhere, and the machine code is the same for every world, batch and thread.
"""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numba.core import config
from numba.extending import register_jitable

_PACKAGE = Path(__file__).parent


def _hash_sources() -> int:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return int.from_bytes(digest.digest()[:7], "big")


SOURCES: int = _hash_sources()

# a sum over vector lanes has eight of them; contacts are stored in chunks of as many
LANES = 8

# Without reference counts: numba would count all arrays of a model and a state up and down, with
# atomic instructions, wherever control flow is too rich for it to see that this is idle. The
# price is that kernels can't allocate; scratch arrays come from Python.
_COMMON: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
_LANES = {"contract", "reassoc", "nsz"}


def kernel(function: Any) -> Any:
    """A function on scalars, or one that is called seldom: compiled by itself."""
    return register_jitable(fastmath={"contract"}, **_COMMON)(function)


def stage(function: Any) -> Any:
    """A stage of a step, merged into its caller: handing over a model and a state costs 20 ns."""
    return register_jitable(fastmath={"contract"}, forceinline=True, **_COMMON)(function)


def lane_inlined(function: Any) -> Any:
    """A formula that is merged into a `lane_kernel`."""
    return register_jitable(fastmath=_LANES, forceinline=True, **_COMMON)(function)


def lane_kernel(function: Any) -> Any:
    """A loop over a chunk of candidates: compiled by itself, with the licences of lanes."""
    return register_jitable(fastmath=_LANES, **_COMMON)(function)


def entry(function: Any) -> Any:
    """A function that Python calls: cached on disk, free of the GIL."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return _on_records(function)
    return njit(cache=True, nogil=True, fastmath={"contract"}, **_COMMON)(function)


def _on_records(function: Any) -> Any:
    """With NUMBA_DISABLE_JIT=1: the same function, on tables whose fields have names."""

    def records(argument: Any) -> Any:
        if isinstance(argument, tuple):
            return type(argument)(*map(records, argument))
        if isinstance(argument, np.ndarray) and argument.dtype.names:
            return argument.view(np.recarray)
        return argument

    return lambda *arguments: function(*map(records, arguments))
