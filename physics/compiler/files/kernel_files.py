"""The cache that numba asks for the machine code of an entry: files of `code_cache`.

Numba's own cache notices an edit of the file that defines an entry, but not of the stages that the
entry calls; it numbers kernels in an index that processes change without a lock; and it raises an
error where a file is damaged or can't be written.
"""

from typing import Any

from numba.core.caching import _Cache
from numba.core.compiler import CompileResult

from physics.compiler.files.code_cache import CodeFile, folders
from physics.compiler.files.identity import NoIdentityError


class KernelFiles(_Cache):
    """The kernels of an entry, one for each combination of argument types."""

    def __init__(self, function: Any) -> None:
        """`function`: the entry in Python."""
        self._function = function

    @property
    def cache_path(self) -> str:
        """The folder that is asked first."""
        return str(folders()[0])

    def enable(self) -> None:
        """It is always enabled."""

    def disable(self) -> None:
        """It is always enabled."""

    def flush(self) -> None:
        """Nothing is kept in memory."""

    def file(self, signature: Any, target: Any) -> CodeFile | None:
        """The file for these types of arguments; None if nothing tells what the entry can reach."""
        types = getattr(signature, "args", signature)
        try:
            return CodeFile(self._function, types, target.codegen().magic_tuple(), "kernel")
        except NoIdentityError as error:
            if error.own:
                raise
            return None  # a user's function: it is compiled in every process

    def load_overload(self, signature: Any, target: Any) -> Any:
        """The compiled entry, or None."""
        file = self.file(signature, target)
        saved: Any = file.load() if file else None
        if saved is None:
            return None
        target.refresh()  # registers what kernels refer to
        return CompileResult._rebuild(target, *saved)

    def save_overload(self, signature: Any, result: Any) -> None:
        """Writes the compiled entry, unless it contains addresses of this process."""
        file = self.file(signature, result.target_context)
        if file and not result.library.has_dynamic_globals:
            file.save(result._reduce())
