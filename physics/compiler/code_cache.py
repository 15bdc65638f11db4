"""Compiled code on disk: what it depends on, and the cache of stages.

Numba caches entries. It notices edits of the file that defines an entry, but not of the stages that
it calls. So every entry mentions a local variable of its factory that is `SOURCES`, a hash of all
sources of the engine: numba hashes closure cells, and an edit anywhere in the engine is a cache
miss. (A hash that ignores comments would cost every process 80 ms when it starts; this one costs
2 ms.)

Numba numbers the files of an entry by an index that it reads, changes and writes without a lock.
Two processes could give the same number to kernels for different types, and one of them would later
run the code of the other. So each file is named by a hash of the types that its kernel is for.

Most of an entry's compile time goes into its stages, and most of these it has in common with other
entries. They are cached here, as optimised bitcode that callers link. So a scene whose
kernel is new compiles its entry, its sequences and those stages that no scene before it had.

An edit leaves files behind that nothing reads any more; `make clean` removes them.
"""

import hashlib
import os
import pickle
import platform
import zlib
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any
from uuid import uuid4

import llvmlite
import numba
import numpy as np
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.misc.appdirs import AppDirs

_PACKAGE = Path(__file__).parents[1]


def hash_sources(folder: Path) -> int:
    """A hash of all Python files in a folder and below it."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes())
    return int.from_bytes(digest.digest()[:7], "big")  # a numba integer has eight bytes, signed


SOURCES: int = hash_sources(_PACKAGE)

# settings of numba, by environment variables, that change the code
_SETTINGS = (
    "OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DEBUGINFO_DEFAULT", "USING_SVML",
)  # fmt: skip
_MADE_BY = repr((
    SOURCES, numba.__version__, llvmlite.__version__, np.__version__, platform.python_version(),
    [getattr(numba.config, name, None) for name in _SETTINGS],
)).encode()  # fmt: skip


class EntryFiles(IndexDataCacheFile):
    """The files of an entry: an index, and one file for each kernel, named by its key."""

    def save(self, key: Any, data: Any) -> None:
        """Writes a kernel. If another process writes the index at once, one is compiled again."""
        name = self._data_name(int(hashlib.sha256(repr(key).encode()).hexdigest()[:16], 16))
        kernels = self._load_index()
        if kernels.get(key) != name:
            kernels[key] = name
            self._save_index(kernels)
        self._save_data(name, data)


def name_files_by_key(entry: Any) -> None:
    """Lets an entry that numba caches keep its kernels in `EntryFiles`."""
    files = entry._cache._cache_file
    base = files._index_name.removesuffix(".nbi")
    folder = _outside_packages(files._cache_path)
    entry._cache._cache_file = EntryFiles(folder, base, files._source_stamp)


def _outside_packages(folder: str) -> str:
    """Where to keep compiled code that numba would keep in `folder`.

    For a package that pip has installed, a folder of the user's: pip removes only files that it
    knows, and what it leaves would count as a package and hide one that is installed later.
    """
    if getattr(numba.config, "CACHE_DIR", "") or "site-packages" not in _PACKAGE.parts:
        return folder
    name = hashlib.sha256(folder.encode()).hexdigest()[:16]
    own = Path(AppDirs("rigid-envs", appauthor=False).user_cache_dir) / name
    try:
        own.mkdir(parents=True, exist_ok=True)
    except OSError:
        return folder
    return str(own)


def is_cacheable(stage: Any) -> bool:
    """Whether a stage is of the engine, whose sources are hashed."""
    return str(stage.__module__).startswith(f"{_PACKAGE.name}.")


def _identity(value: Any) -> Any:
    """What tells a stage, or a value in its closure, from others: the same in every process."""
    if isinstance(value, FunctionType):
        code = value.__code__
        constants = [repr(x) for x in code.co_consts if not isinstance(x, CodeType)]
        cells = [_identity(cell.cell_contents) for cell in value.__closure__ or ()]
        name = (value.__module__, value.__qualname__, _identity(value.__defaults__))
        return name, code.co_code, constants, code.co_names, code.co_freevars, cells
    if isinstance(value, tuple):
        return [_identity(part) for part in value]
    if value is None or isinstance(value, int | float | str | np.dtype):
        return repr(value)
    raise TypeError(
        f"the closure of a stage holds {value!r}, which is a {type(value).__name__}: it must be a "
        "function, a number, a string, a dtype, None or a tuple of these"
    )


@cache
def _folder() -> Path:
    """Where numba keeps the compiled code of this package."""
    return Path(_outside_packages(FunctionCache(_identity).cache_path))


class StageFile:
    """The file of a stage that is compiled for given types of arguments.

    It starts with a hash of itself and of what made it, so that nothing is read that other sources
    or versions wrote, or that is damaged.

    Attributes:
        digest: of everything that the compiled stage depends on but sources, versions and settings.
    """

    def __init__(self, function: Any, types: Any, target: Any) -> None:
        """`target`: what numba's code generator says of the machine."""
        key = repr((_identity(function), types, target))
        self.digest = hashlib.sha256(key.encode()).hexdigest()[:24]
        self._path = _folder() / f"{function.__name__.strip('<>')}.{self.digest}.stage"

    def load(self) -> Any | None:
        """What was saved; None if nothing was, or by other sources or versions, or is damaged."""
        try:
            data = self._path.read_bytes()
        except OSError:
            return None
        hashed, body = data[:_HASH_SIZE], data[_HASH_SIZE:]
        return pickle.loads(zlib.decompress(body)) if hashed == _hash(body) else None

    def save(self, content: Any) -> None:
        """Writes the file at once: another process sees all of it or nothing."""
        body = zlib.compress(pickle.dumps(content), 1)
        unfinished = self._path.with_suffix(f".{uuid4().hex}")
        with suppress(OSError):  # without a cache all works, only slower
            try:
                unfinished.write_bytes(_hash(body) + body)
                os.replace(unfinished, self._path)
            finally:
                unfinished.unlink(missing_ok=True)


def _hash(body: bytes) -> bytes:
    return hashlib.sha256(_MADE_BY + body).digest()


_HASH_SIZE = len(_hash(b""))
