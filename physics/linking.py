"""How numba compiles the functions of a kernel: quickly, and without machine code that never runs.

A kernel consists of about eighty small functions, nested up to seven deep. By default numba gives
each of them a library of its own, optimises it twice and emits machine code for it; the caller
links the optimised code, inlines it and optimises the whole again. Only the kernel itself runs. So

- only the kernel is emitted; the functions within it are optimised and left at that;
- a function that only calls others isn't even optimised before it is inlined;
- the first of numba's two rounds of optimisation, which prepares for the removal of reference
  counts, is left out: there are none;
- passes that treat language features which kernels don't use are left out.

docs/decisions/0015-linked-functions.md has the compile times.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, Flags
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import (
    AnnotateTypes,
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.untyped_passes import (
    DeadBranchPrune,
    FixupArgs,
    GenericRewrites,
    IRProcessing,
    ReconstructSSA,
    RewriteSemanticConstants,
    TranslateByteCode,
)

# what remains of numba's default pipeline; the lowering comes between the two
_TYPING = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    RewriteSemanticConstants,
    DeadBranchPrune,
    GenericRewrites,
    ReconstructSSA,
    DeadBranchPrune,  # a branch on a constant that is assigned in several places
    NopythonTypeInference,
    PreLowerStripPhis,
    IRLegalization,
    AnnotateTypes,
)


class _Flags(Flags):
    """Numba's flags of a compilation, compared by those that are set.

    Numba compares flags forty thousand times for one kernel, and by default looks up all thirty.
    """

    def __hash__(self) -> int:
        return len(self._values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Flags) and self._values == other._values


class _Codegen:
    """Numba's code generator without the environments of functions that have no address."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Environments serve Python objects, which these functions never touch."""


class _Library(JITCodeLibrary):
    """The code of a kernel, with the functions within it."""

    def _optimize_final_module(self) -> None:
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)


class _LinkedLibrary(_Library):
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


class _SequenceLibrary(_LinkedLibrary):
    """The same, without optimisation of its own."""

    def _optimize_final_module(self) -> None:
        pass


class _Lowering(NativeLowering):
    """Numba's lowering, into a library of another class."""

    _library: type[_Library]

    def run_pass(self, state: Any) -> bool:
        state.library = self._library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(_Lowering):
    _name: Any = "kernel_lowering"
    _library = _Library


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkedLowering(_Lowering):
    _name: Any = "linked_lowering"
    _library = _LinkedLibrary


@register_pass(mutates_CFG=True, analysis_only=False)
class _SequenceLowering(_Lowering):
    _name: Any = "sequence_lowering"
    _library = _SequenceLibrary


class Kernel(CompilerBase):
    """Pipeline of a function that Python calls: it is emitted."""

    lowering: type[_Lowering] = _KernelLowering

    def __init__(self, *arguments: Any) -> None:
        """The arguments are numba's."""
        super().__init__(*arguments)
        self.state.flags = _Flags(self.state.flags)

    def define_pipelines(self) -> list[PassManager]:
        """One pipeline, without a fallback."""
        manager = PassManager("kernel")
        for one in (*_TYPING, self.lowering, NoPythonBackend):
            manager.add_pass(one, one.__name__)
        manager.finalize()
        return [manager]


class Linked(Kernel):
    """Pipeline of a function that only kernels call: it is optimised, and not emitted."""

    lowering = _LinkedLowering


class Sequence(Kernel):
    """Pipeline of a function that only calls others: it is neither optimised nor emitted."""

    lowering = _SequenceLowering
