"""How numba compiles the functions of a kernel: quickly, and without machine code that never runs.

A kernel consists of about eighty small functions, nested up to seven deep. By default numba gives
each of them a library of its own, optimises it twice and emits machine code for it; the caller
links the optimised code, inlines it and optimises the whole again. Only the kernel itself runs. So

- only the kernel is emitted; the functions within it are optimised and left at that;
- a function that does little but call others isn't even optimised before it is inlined;
- the first of numba's two rounds of optimisation is left out. It prepares for the removal of
  reference counts, which these functions don't have, and simplifies loops before the second round
  vectorises them; the results are bitwise the same without it;
- of LLVM's passes over each function by itself only three are run: those over the module repeat
  the others;
- passes that treat language features which kernels don't use are left out.

Products are fused with sums before all this, see `fusion`.

docs/decisions/0015-linked-functions.md has the compile times.
"""

from copy import copy
from typing import Any

import llvmlite.binding as llvm
from numba.core import cgutils
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, Flags, compile_result
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.environment import Environment
from numba.core.lowering import Lower
from numba.core.typed_passes import (
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

from physics.compiler.counting import UseCounters
from physics.compiler.files.claims import claimed
from physics.compiler.files.code_cache import CodeFile
from physics.compiler.files.identity import NoIdentityError
from physics.compiler.fusion import fuse_products
from physics.compiler.interrupts import interrupts_deferred, raise_lost_interrupt
from physics.compiler.resolution import RememberingContext

# what remains of numba's default pipeline before the lowering
_BEFORE_LOWERING = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    RewriteSemanticConstants,
    DeadBranchPrune,
    GenericRewrites,
    ReconstructSSA,
    DeadBranchPrune,  # again: variables are now assigned once, so more conditions are constant
    UseCounters,
    NopythonTypeInference,
    PreLowerStripPhis,
)


class _Flags(Flags):
    """Numba's flags of a compilation, compared by those that are set.

    Numba compares flags forty thousand times for one kernel, and by default looks up every option.
    """

    def __hash__(self) -> int:
        return len(self._values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Flags) and self._values == other._values


class _Codegen:
    """Numba's code generator, for functions that aren't emitted: sets no environment.

    Environments serve Python objects, which these functions never touch, and need an address.
    """

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Does nothing."""


class _Library(JITCodeLibrary):
    """The code of a kernel, with the functions within it."""

    def add_ir_module(self, ir_module: Any) -> None:
        """As numba's, with fused products."""
        self._raise_if_finalized()
        text = fuse_products(cgutils.normalize_ir_text(str(ir_module)))
        ll_module = llvm.parse_assembly(text)
        ll_module.name = ir_module.name
        ll_module.verify()
        self.add_llvm_module(ll_module)

    def _optimize_functions(self, ll_module: Any) -> None:
        """Simplifies each new function, with three of the passes that numba runs here.

        Those over the module do the rest. Without any, worlds with parameters of their own differed
        in the last bit from worlds that have these built in.
        """
        ll_module.data_layout = self._codegen._data_layout
        builder = self._codegen._pass_builder()
        manager = llvm.create_new_function_pass_manager()
        manager.add_sroa_pass()
        manager.add_instruction_combine_pass()
        manager.add_simplify_cfg_pass()
        for function in ll_module.functions:
            if not function.is_declaration:
                manager.run(function, builder)

    def _optimize_final_module(self) -> None:
        # Loops that are unrolled first are not vectorised; and a fused product and sum count as one
        # operation, so more loops were short enough to be unrolled. Straight-line code isn't
        # vectorised: loops over lanes are, and looking for more took an eighth of a compilation
        options = llvm.create_pipeline_tuning_options(speed_level=3)
        options.loop_unrolling = False
        options.loop_vectorization, options.slp_vectorization = True, False
        builder = llvm.create_pass_builder(self._codegen._tm, options)
        builder.getModulePassManager().run(self._final_module, builder)

    def _finalize_specific(self) -> None:
        with interrupts_deferred():  # emits machine code, which LLVM then gives to numba
            super()._finalize_specific()


class _LinkedLibrary(_Library):
    """Optimised code that callers link, without machine code of its own.

    It is optimised before it is inlined: without that, the impulse law ran at 0.41 of its speed.
    Once it is done it is kept as bitcode: as modules the stages of a kernel took 50 MB more.
    """

    bitcode: bytes
    is_alone: bool  # whether it defines one function only

    @property
    def codegen(self) -> Any:
        return _Codegen(self._codegen)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        defined = [one for one in self._final_module.functions if not one.is_declaration]
        for function in defined:
            if function.linkage == llvm.Linkage.external:
                function.linkage = "linkonce_odr"  # several callers may bring it along
        self.is_alone = len(defined) == 1
        self.keep(self._final_module.as_bitcode())

    def keep(self, bitcode: bytes) -> None:
        """Ends the library's compilation with this code."""
        self.bitcode = bitcode
        self._final_module.close()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        return llvm.parse_bitcode(self.bitcode)

    def get_pointer_to_function(self, name: str) -> int:
        # numba asks for an address, which only emitted functions have; callers link by name
        self._ensure_finalized()
        return 0


class _SequenceLibrary(_LinkedLibrary):
    """The same, without optimisation of its own."""

    def _optimize_final_module(self) -> None:
        """Left to the caller, which inlines it."""


class _Lower(Lower):
    """Numba's lowering of a function, without code for reference counts, which kernels lack.

    Numba reads each variable before it is written, and clears it after its last use, to count
    references; and it asks LLVM for the size of each, for debuggers.
    """

    def alloca_lltype(self, name: str, lltype: Any, datamodel: Any = None) -> Any:
        """Room for a variable."""
        return cgutils.alloca_once(self.builder, lltype, name=name, zfill=False)

    def storevar(self, value: Any, name: str, argidx: Any = None) -> None:
        """Stores a value into a variable."""
        self._alloca_var(name, self.typeof(name))
        if name in self._singly_assigned_vars:
            self._blk_local_varmap[name] = value
        else:
            self.builder.store(value, self.getvar(name))

    def lower_expr(self, resty: Any, expr: Any) -> Any:
        """Lowers an expression; numba takes a pair apart in memory."""
        if expr.op in ("pair_first", "pair_second"):
            pair = self.loadvar(expr.value.name)
            return self.builder.extract_value(pair, 0 if expr.op == "pair_first" else 1)
        return super().lower_expr(resty, expr)

    def delvar(self, name: str) -> None:
        """Ends the use of a variable; if nothing was written before, it counts as written twice."""
        if name not in self._blk_local_varmap:
            self._singly_assigned_vars.discard(name)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    """Numba's lowering, into a library of the class that the pipeline names."""

    _name: Any = "lowering"

    @property
    def lowering_class(self) -> Any:
        """Lowers one function."""
        return _Lower

    def run_pass(self, state: Any) -> bool:
        raise_lost_interrupt()
        if stop_before_entries and state.pipeline.library is _Library:
            raise Stopped
        codegen, name = state.targetctx.codegen(), state.func_id.func_qualname
        state.func_id.unique_id = state.pipeline.symbol(state.func_id.unique_id)
        state.library = state.pipeline.library(codegen, name)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


class Stopped(Exception):
    """All that an entry calls has been compiled; the entry itself has not, as was asked for."""


stop_before_entries = False  # in a process that compiles stages only


class EntryPipeline(CompilerBase):
    """For a function that Python calls: it is emitted."""

    library: type[_Library] = _Library

    def __init__(self, *arguments: Any) -> None:
        """The arguments are numba's."""
        super().__init__(*arguments)
        self.state.flags = _Flags(self.state.flags)
        self.state.typingctx = RememberingContext(self.state.typingctx)

    def symbol(self, number: int) -> int:
        """Makes the names of a function's symbols unique: here numba's running number."""
        return number

    def define_pipelines(self) -> list[PassManager]:
        """One pipeline, without a fallback."""
        manager = PassManager("kernel")
        for one in (*_BEFORE_LOWERING, _Lowering, NoPythonBackend):
            manager.add_pass(one, one.__name__)
        manager.finalize()
        return [manager]


_restored: dict[str, Any] = {}  # libraries of stages that this process has read, by digest


class StagePipeline(EntryPipeline):
    """For a function that only compiled functions call: it is optimised, not emitted, and cached.

    Running numbers start anew in every process, so symbols of a stage are named by its digest. All
    that a stage calls is inlined, so its bitcode defines no other function.
    """

    library = _LinkedLibrary

    def symbol(self, number: int) -> int:
        """The digest, if there is one."""
        return int(self._file.digest, 16) if self._file else number

    def compile_extra(self, func: Any) -> Any:
        """Takes the compiled stage from its file, or compiles it and writes the file."""
        self._file: CodeFile | None = None
        target = self.state.targetctx.codegen().magic_tuple()
        try:
            self._file = CodeFile(func, self.state.args, target, "stage")
        except NoIdentityError as error:
            if error.own:
                raise
            return super().compile_extra(func)
        saved = self._file.load()
        if saved is None:
            with claimed(self._file.digest):
                saved = self._file.load()  # another process may have compiled it
                if saved is None:
                    return self._compile(func, self._file)
        return self._restore(self._file.digest, *saved)

    def _compile(self, func: Any, file: CodeFile) -> Any:
        result = super().compile_extra(func)
        described, library = copy(result.fndesc), result.library
        described.typemap = described.calltypes = None  # large, and only for the lowering
        # a function that wasn't inlined would keep its running number, which isn't unique on disk,
        # and dynamic globals are addresses
        if library.is_alone and not library.has_dynamic_globals:
            file.save((library.name, library.bitcode, described, result.signature))
        return result

    def _restore(
        self, digest: str, name: str, bitcode: bytes, described: Any, signature: Any
    ) -> Any:
        context = self.state.targetctx
        # the bundles that the stage was compiled for may differ in what it doesn't read
        described.argtypes, signature = self.state.args, signature.replace(args=self.state.args)
        library = _restored.get(digest)
        if library is None:  # a symbol must not be linked twice
            library = self.library(context.codegen(), name)
            library.keep(bitcode)
            _restored[digest] = library  # once it is whole: Ctrl-C may come before
        function = context.get_executable(library, described, Environment.from_fndesc(described))
        context.insert_user_function(function, described, [library])
        return compile_result(
            typing_context=self.state.typingctx, target_context=context, entry_point=function,
            library=library, fndesc=described, signature=signature, objectmode=False, lifted=(),
        )  # fmt: skip


class SequencePipeline(EntryPipeline):
    """For a stage that does little but call others: it is neither optimised nor emitted."""

    library = _SequenceLibrary
