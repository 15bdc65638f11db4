"""Compiled code on disk: what it depends on, and the cache of stages.

Numba caches entries. It notices edits of the file that defines an entry, but not of the stages that
it calls. So every entry mentions a local variable of its factory that is `SOURCES`, a hash of all
sources of this package: numba hashes closure cells, and an edit anywhere in the package is a cache
miss. (A hash that ignores comments would cost every process 80 ms when it starts; this one costs
2 ms.)

Most of an entry's compile time goes into its stages, and most of these it has in common with other
entries. They are cached here, as optimised bitcode that callers link. So a scene whose
kernel is new compiles only what no scene before it had, in whatever process.
"""

import hashlib
import os
import pickle
import platform
import zlib
from contextlib import suppress
from pathlib import Path
from types import FunctionType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.caching import FunctionCache

_PACKAGE = Path(__file__).parent


def _hash_sources() -> int:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return int.from_bytes(digest.digest()[:7], "big")  # a numba integer has eight bytes, signed


SOURCES: int = _hash_sources()
_MADE_BY = (
    SOURCES, numba.__version__, llvmlite.__version__, np.__version__, platform.python_version(),
)  # fmt: skip


def is_cacheable(stage: Any) -> bool:
    """Whether a stage is of this package, whose sources are hashed."""
    return str(stage.__module__).startswith(f"{__package__}.")


def _identity(value: Any) -> Any:
    """What tells a stage, or a value in its closure, from others: the same in every process."""
    if isinstance(value, FunctionType):
        cells = [_identity(cell.cell_contents) for cell in value.__closure__ or ()]
        return value.__module__, value.__qualname__, value.__code__.co_firstlineno, cells
    if isinstance(value, tuple):
        return [_identity(part) for part in value]
    if value is None or isinstance(value, int | float | str | np.dtype):
        return repr(value)
    raise TypeError(
        f"the closure of a stage holds {value!r}, which is a {type(value).__name__}: it must be a "
        "function, a number, a string, a dtype, None or a tuple of these"
    )


class StageFile:
    """The file of a stage that is compiled for given types of arguments.

    Attributes:
        digest: of everything that the compiled stage depends on but sources and versions, which
            the file itself states: an edit replaces it.
    """

    def __init__(self, function: Any, types: Any, target: Any) -> None:
        """`target`: what numba's code generator says of the machine."""
        key = repr((_identity(function), types, target))
        self.digest = hashlib.sha256(key.encode()).hexdigest()[:24]
        folder = Path(FunctionCache(_identity).cache_path)  # numba's choice for this package
        self._path = folder / f"{function.__name__}.{self.digest}.stage"

    def load(self) -> Any | None:
        """What was saved; None if nothing was, or by other sources or versions, or is damaged."""
        try:
            made_by, content = pickle.loads(zlib.decompress(self._path.read_bytes()))
        except (OSError, EOFError, zlib.error, pickle.UnpicklingError):
            return None
        return content if made_by == _MADE_BY else None

    def save(self, content: Any) -> None:
        """Writes the file at once: another process sees all of it or nothing."""
        unfinished = self._path.with_suffix(f".{os.getpid()}")
        with suppress(OSError):  # without a cache all works, only slower
            self._path.parent.mkdir(parents=True, exist_ok=True)
            unfinished.write_bytes(zlib.compress(pickle.dumps((_MADE_BY, content)), 1))
            os.replace(unfinished, self._path)
