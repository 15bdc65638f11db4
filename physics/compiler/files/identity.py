"""What tells a function from others: its code, and all that it can reach.

Compiled code is kept on disk, so an edit must change the name of its file. The identity of a
function covers its own code, the values in its closure, the globals that it names, and so on
through every function among them. So an edit compiles again what can reach it, and nothing else;
comments and docstrings don't count. What numba's own functions do is covered by its version, and
what the compiler package does by a hash of its files (see `code_cache`).
"""

import hashlib
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

import numpy as np

_OWN = ("physics", "rigid_envs")  # packages whose modules are followed
_COMPILER = "physics.compiler"


class NoIdentityError(TypeError):
    """A function can reach a value of which nothing tells whether it has changed.

    Attributes:
        own: whether the function is of the engine or of the environments.
    """

    own = False


class Identity(NamedTuple):
    """What is known of a function.

    Attributes:
        digest: 64 hexadecimal digits, the same in every process.
        names: of all attributes and globals that it and the functions that it can reach read.
    """

    digest: str
    names: frozenset[str]


_known: dict[FunctionType, Identity] = {}


def identify(function: Any) -> Identity:
    """The identity of a function.

    Raises:
        NoIdentityError: it can reach a value whose identity isn't known, such as a list.
    """
    if function not in _known:
        _known[function] = Identity("", frozenset())  # in place of one that calls itself
        names: set[str] = set()
        try:
            text = repr(_describe(function, names))
            digest = hashlib.sha256(text.encode()).hexdigest()
            _known[function] = Identity(digest, frozenset(names))
        finally:
            if not _known[function].digest:
                del _known[function]
    return _known[function]


def _describe(function: Any, names: set[str]) -> Any:
    name = function.__module__, function.__qualname__
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    closure = [(n, _identity(cell.cell_contents, name, names)) for n, cell in cells]
    defaults = _identity(function.__defaults__, name, names)
    return name, defaults, closure, _code(function.__code__, function, names)


def _code(code: CodeType, function: Any, names: set[str]) -> Any:
    constants = [
        _code(c, function, names) if isinstance(c, CodeType) else repr(c) for c in code.co_consts
    ]
    if code is function.__code__ and function.__doc__ and code.co_consts[0] == function.__doc__:
        constants[0] = "documentation"
    names.update(code.co_names)
    known = function.__globals__
    name = function.__module__, function.__qualname__
    reached: list[Any] = []
    for n in code.co_names:  # of globals, and of attributes, which may have the same name
        if n in known:
            value = known[n]
            own = isinstance(value, ModuleType) and value.__name__.partition(".")[0] in _OWN
            if own:  # only what is read from it
                used = [a for a in code.co_names if hasattr(value, a)]
                reached += [(n, a, _identity(getattr(value, a), name, names)) for a in used]
            else:
                reached.append((n, _identity(value, name, names)))
    return code.co_code, constants, code.co_names, code.co_varnames, reached


def _identity(value: Any, name: tuple[str, str], names: set[str]) -> Any:
    """What tells a value from others; `name` is that of the function that can reach it."""
    if isinstance(value, FunctionType):
        found = identify(value)
        names.update(found.names)
        return found.digest
    if isinstance(value, tuple | frozenset):
        return type(value).__name__, [_identity(part, name, names) for part in value]
    if value is None or isinstance(value, bool | int | float | str | bytes | np.dtype | np.generic):
        return type(value).__name__, repr(value)
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, ModuleType | BuiltinFunctionType | np.ufunc):
        return value.__name__
    if isinstance(value, type):
        return value.__module__, value.__qualname__, getattr(value, "_fields", ())
    if value is Any or name[0].startswith(_COMPILER) or _is_compilers(value):
        return repr(type(value)), getattr(value, "__name__", "")
    error = NoIdentityError(
        f"{'.'.join(name)} is compiled, and can reach {value!r}, which is a "
        f"{type(value).__name__}: it must be a function, a number, a string, a dtype, an array, "
        "None or a tuple of these"
    )
    error.own = name[0].partition(".")[0] in _OWN
    raise error


def _is_compilers(value: Any) -> bool:
    """Whether a value was made by this package, such as an atomic operation."""
    return str(getattr(value, "__module__", "")).startswith(_COMPILER)


def hash_files(folder: Path) -> str:
    """A hash of all Python files in a folder and those within it."""
    whole = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        whole.update(str(path.relative_to(folder)).encode() + path.read_bytes())
    return whole.hexdigest()
