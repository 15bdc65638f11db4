"""Functions that numba compiles only into their callers.

Numba compiles every function that a kernel calls into a library of its own: LLVM optimises it and
emits machine code for it. The caller then links the result and optimises all of it again, and so
does the caller's caller. For the deeply nested stages of a substep, that is half of the compile
time, spent on code that never runs by itself. Here such a function is lowered to LLVM's
representation and left at that; only the entry point is optimised and emitted.
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
    """Code that callers link; LLVM only inlines what must be inlined."""

    @property
    def codegen(self) -> Any:
        return _Codegen(self._codegen)

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager(
            loop_vectorize=False, slp_vectorize=False, opt=0
        )
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
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
    """Numba's pipeline with that lowering: for functions that only kernels call."""

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
