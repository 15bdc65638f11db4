"""Functions that numba compiles only into their callers.

Numba compiles every function that a kernel calls into a library of its own, and emits machine code
for it. The caller then links the result, inlines it and optimises it again. A stage of the substep
never runs by itself, so its machine code is never used. Here such a function is optimised, and
left at that; only the entry point is emitted. docs/decisions/0015-linked-functions.md has the
compile times.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering


class _Codegen:
    """Numba's code generator without the environments of functions that have no address."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Environments serve Python objects, which these functions never touch."""


class _LinkedLibrary(JITCodeLibrary):
    """Optimised code that callers link, without machine code of its own.

    It is optimised before it is inlined: without that, the impulse law ran at 0.41 of its speed.
    """

    @property
    def codegen(self) -> Any:
        return _Codegen(self._codegen)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        # numba asks for an address, which only emitted functions have; callers link by name
        self._ensure_finalized()
        return 0


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkedLowering(NativeLowering):
    """Numba's lowering, into a library that isn't emitted."""

    _name = "linked_lowering"

    def run_pass(self, state: Any) -> bool:
        codegen = state.targetctx.codegen()
        state.library = _LinkedLibrary(codegen, state.func_id.func_qualname)
        return bool(super().run_pass(state))


class Linked(CompilerBase):
    """Numba's default pipeline with `_LinkedLowering`: for functions that only kernels call."""

    def define_pipelines(self) -> list[PassManager]:
        """The default passes, one of them replaced."""
        manager = PassManager("linked")
        for part in (
            DefaultPassBuilder.define_untyped_pipeline(self.state),
            DefaultPassBuilder.define_typed_pipeline(self.state),
            DefaultPassBuilder.define_nopython_lowering_pipeline(self.state),
        ):
            manager.passes.extend(part.passes)
        manager.passes = [
            (_LinkedLowering, text) if one is NativeLowering else (one, text)
            for one, text in manager.passes
        ]
        manager.finalize()
        return [manager]
