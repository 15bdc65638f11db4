"""Loops over range(n) and range(first, last), in a third of the instructions.

Numba keeps the number of rounds left, which it divides from the ends and the step, in a structure
of four numbers. Most loops of a kernel count up by one; for these `UseCounters` replaces `range`
by functions whose iterator compares a counter with the end.
"""

from typing import Any

from llvmlite import ir as llvm_ir
from numba.core import cgutils, ir, types
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.datamodel import models
from numba.extending import lower_builtin, register_model, type_callable

_WORD = llvm_ir.IntType(64)


def count_to(end: int) -> range:
    """range(end)."""
    return range(end)


def count_between(first: int, end: int) -> range:
    """range(first, end)."""
    return range(first, end)


_COUNTS: dict[int, Any] = {1: count_to, 2: count_between}  # by the number of arguments


class _Counter(types.SimpleIteratorType):
    def __init__(self) -> None:
        super().__init__("counter", types.int64)


class _Counting(types.SimpleIterableType):
    def __init__(self) -> None:
        super().__init__("counting", _Counter())


_COUNTING = _Counting()


@register_model(_Counting)
class _CountingModel(models.PrimitiveModel):
    """The ends."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, llvm_ir.LiteralStructType([_WORD, _WORD]))


@register_model(_Counter)
class _CounterModel(models.PrimitiveModel):
    """The address of the counter, and the end."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, llvm_ir.LiteralStructType([_WORD.as_pointer(), _WORD]))


@type_callable(count_to)
def _type_count_to(context: Any) -> Any:
    def typed(end: Any) -> Any:
        return _COUNTING if isinstance(end, types.Integer) else None

    return typed


@type_callable(count_between)
def _type_count_between(context: Any) -> Any:
    def typed(first: Any, end: Any) -> Any:
        return _COUNTING if isinstance(first, types.Integer) else None

    return typed


def _pair(builder: Any, first: Any, second: Any) -> Any:
    pair = llvm_ir.LiteralStructType([first.type, second.type])(llvm_ir.Undefined)
    return builder.insert_value(builder.insert_value(pair, first, 0), second, 1)


@lower_builtin(count_to, types.Integer)
@lower_builtin(count_between, types.Integer, types.Integer)
def _count(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    given = zip(arguments, signature.args, strict=True)
    ends = [context.cast(builder, end, kind, types.int64) for end, kind in given]
    return _pair(builder, ends[0] if len(ends) == 2 else _WORD(0), ends[-1])


@lower_builtin("getiter", _Counting)
def _begin(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    counter = cgutils.alloca_once(builder, _WORD)
    builder.store(builder.extract_value(arguments[0], 0), counter)
    return _pair(builder, counter, builder.extract_value(arguments[0], 1))


@lower_builtin("iternext", _Counter)
def _next(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    counter, end = (builder.extract_value(arguments[0], n) for n in range(2))
    number = builder.load(counter)
    builder.store(builder.add(number, _WORD(1), flags=["nsw"]), counter)
    return _pair(builder, number, builder.icmp_signed("<", number, end))


@register_pass(mutates_CFG=False, analysis_only=False)
class UseCounters(FunctionPass):
    """Replaces `range` where it counts up by one."""

    _name: Any = "use_counters"

    def __init__(self) -> None:
        """Nothing to set."""

    def run_pass(self, state: Any) -> bool:
        """Changes numba's intermediate representation of a function."""
        assigned = [
            statement
            for block in state.func_ir.blocks.values()
            for statement in block.find_insts(ir.Assign)
        ]
        calls = [s.value for s in assigned if isinstance(s.value, ir.Expr) and s.value.op == "call"]
        ends = {call.func.name: len(call.args) for call in calls}
        found = False
        for statement in assigned:
            value = statement.value
            is_range = isinstance(value, ir.Global) and value.value is range
            count = _COUNTS.get(ends.get(statement.target.name, 0)) if is_range else None
            if count is not None:
                statement.value = ir.Global(count.__name__, count, value.loc)
                found = True
        return found
