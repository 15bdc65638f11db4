"""Compiled code on disk: kernels as machine code, and stages as bitcode that callers link.

Most of a kernel's compile time goes into its stages, and most of these it has in common with other
kernels. So a scene whose kernel is new compiles its entry and those stages that no scene before it
had. A file is named by a digest of all that the code depends on: what the function can reach (see
`identity`), the types of its arguments, the processor, this package, and the versions and settings
of what compiles. Nothing else can be read by mistake, and an edit compiles only what it can reach.

Without a folder that can be written to all works, only every process compiles. An edit leaves files
behind that nothing reads any more; `make clean` removes them.
"""

import hashlib
import logging
import os
import pickle
import sys
import zlib
from functools import cache
from pathlib import Path
from typing import Any
from uuid import uuid4

import llvmlite
import numba
import numpy as np
from numba.core.types import NamedTuple, NamedUniTuple
from numba.misc.appdirs import AppDirs

from physics.compiler.files.identity import hash_files, identify
from physics.compiler.files.levels import LEVELS, offered

LOGGER = logging.getLogger("physics")

_PACKAGE = Path(__file__).parents[2]

# settings of numba, by environment variables, that change the code
_SETTINGS = (
    "OPT", "BOUNDSCHECK", "LOOP_VECTORIZE", "SLP_VECTORIZE", "DEBUGINFO_DEFAULT", "USING_SVML",
)  # fmt: skip
_MADE_BY = repr((
    hash_files(Path(__file__).parents[1]), numba.__version__, llvmlite.__version__,
    np.__version__.split(".")[0], sys.version_info[:2], sys.implementation.cache_tag,
    [getattr(numba.config, name, None) for name in _SETTINGS],
)).encode()  # fmt: skip


# kernels that a wheel brings, compiled for the levels of `levels`; none in a source tree. A note
# beside them says what they need
PREBUILT = _PACKAGE / "prebuilt"
NOTE = "needs.txt"


@cache
def folders() -> list[Path]:
    """Where compiled code is looked for; it is written to the first of these that allows it.

    NUMBA_CACHE_DIR, if it is set. Else, in a source tree, the package's own cache of byte code. For
    a package that pip has installed, a folder of the user's: pip removes only files that it knows,
    and what it leaves would count as a package and hide one that is installed later.
    """
    given = getattr(numba.config, "CACHE_DIR", "")
    if given:
        return [Path(given) / "rigid-envs"]
    users = Path(AppDirs("rigid-envs", appauthor=False).user_cache_dir)
    installed = "site-packages" in _PACKAGE.parts
    return [users] if installed else [_PACKAGE / "__pycache__" / "kernels", users]


def _seen(kind: Any, names: frozenset[str]) -> Any:
    """What the code of a function that reads these names depends on, of the type of an argument."""
    if hasattr(kind, "seen_by"):  # of a bundle not how the rest is laid out
        return kind.seen_by(names)
    # numba's name of a named tuple has the types of its fields and not what they are called
    return (kind.fields, kind) if isinstance(kind, NamedTuple | NamedUniTuple) else kind


class CodeFile:
    """The file of a function that is compiled for given types of arguments.

    It starts with a hash of itself, so that nothing damaged is read.

    Attributes:
        digest: of everything that the compiled function depends on.
    """

    def __init__(self, function: Any, types: Any, target: Any, kind: str) -> None:
        """`target`: what numba's code generator says of the machine; `kind`: "kernel" or "stage".

        Raises:
            NoIdentityError: the function can reach a value whose identity isn't known.
        """
        identity = identify(function)
        own = identity.digest, [_seen(kind, identity.names) for kind in types]
        name = function.__name__.strip("<>")

        def digest_for(target: Any) -> str:
            key = repr((*own, target)).encode()
            return hashlib.sha256(_MADE_BY + key).hexdigest()[:32]

        self.digest = digest_for(target)
        self.name = f"{name}.{self.digest}.{kind}"
        self._paths = [folder / self.name for folder in folders()]
        if kind == "kernel" and PREBUILT.is_dir():
            names = (f"{name}.{digest_for((target[0], level, ''))}.{kind}" for level in offered())
            self._paths += [PREBUILT / name for name in names]

    def exists(self) -> bool:
        """Whether there is a file, which may be damaged."""
        return any(path.exists() for path in self._paths)

    def load(self) -> Any | None:
        """What was saved; None if nothing was, or it is damaged or of a module that isn't here."""
        for path in self._paths:
            try:
                data = path.read_bytes()
            except OSError:
                continue
            hashed, body = data[:_HASH_SIZE], data[_HASH_SIZE:]
            if hashed == _hash(body):
                try:
                    return pickle.loads(zlib.decompress(body))
                except ImportError:  # it refers to what another process has defined
                    continue
        return None

    def save(self, content: Any) -> None:
        """Writes the file at once: another process sees all of it or nothing."""
        body = zlib.compress(pickle.dumps(content), 1)
        reason: OSError | None = None
        for folder in folders():
            unfinished = folder / f"{self.name}.{uuid4().hex}"
            try:
                folder.mkdir(parents=True, exist_ok=True)
                try:
                    unfinished.write_bytes(_hash(body) + body)
                    os.replace(unfinished, folder / self.name)
                finally:
                    unfinished.unlink(missing_ok=True)
                return
            except OSError as error:
                reason = reason or error
        _warn_once(str(folders()[0]), str(reason))


def versions() -> str:
    """What machine code of this process needs: other versions compile their own."""
    python = ".".join(map(str, sys.version_info[:2]))
    return f"numba {numba.__version__}, llvmlite {llvmlite.__version__}, Python {python}"


@cache
def report_unused_kernels() -> None:
    """Logs once why the kernels of a wheel can't be used, if there are any."""
    note = PREBUILT / NOTE
    if not note.is_file():
        return
    needs = note.read_text(encoding="utf-8").strip()
    if needs != versions():
        LOGGER.warning("the kernels of this wheel need %s, found %s: compiling", needs, versions())
    elif not offered():
        LOGGER.warning("the kernels of this wheel need a processor of level %s: compiling",
                       LEVELS[0])  # fmt: skip


@cache
def _warn_once(folder: str, reason: str) -> None:
    LOGGER.warning(
        "compiled kernels can't be kept in %s (%s), so the next process compiles them again; "
        "NUMBA_CACHE_DIR names another folder", folder, reason,
    )  # fmt: skip


def _hash(body: bytes) -> bytes:
    return hashlib.sha256(_MADE_BY + body).digest()


_HASH_SIZE = len(_hash(b""))
