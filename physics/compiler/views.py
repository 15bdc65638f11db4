"""Arrays and rows of tables inside kernels: addresses whose layout is part of their type.

Numba passes an array as ten numbers. Every access takes them apart and tests whether the index is
negative. This made nineteen of twenty instructions of a kernel. LLVM removes them, but numba
writes and LLVM reads them first. The type of a `View` holds what is constant: all lengths and
strides of a field of a table, so that only an address is passed.

A view supports what stages use: integer indices, slices without a step, `shape` and `len`. Indices
must not be negative. `bundle` makes views of the arrays of a named tuple; views exist in compiled
code only.
"""

import hashlib
import operator
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_global,
    signature,
)
from numba.extending import (
    infer_getattr,
    lower_builtin,
    lower_getattr,
    lower_getattr_generic,
    lower_setattr_generic,
    register_model,
)
from numba.np.numpy_support import as_dtype

_BYTES = ir.IntType(8).as_pointer()
_WORD = ir.IntType(64)


class Row(types.Type):
    """The type of a row of a table: the address of a record."""

    def __init__(self, record: Any) -> None:
        """`record`: numba's type of the record. The name is short, as symbols contain it."""
        self.record, self.itemsize = record, record.size
        digest = hashlib.sha256(record.name.encode()).hexdigest()[:12]
        super().__init__(name=f"Row.{digest}")

    def member(self, name: str) -> Any:
        """Type of a field; None if there is none of this name."""
        if name not in self.record.fields:
            return None
        kind = self.record.typeof(name)
        nested = isinstance(kind, types.NestedArray)
        return View(kind.dtype, kind.shape, kind.strides) if nested else kind


class View(types.Type):
    """The type of an array.

    Attributes:
        element: type of an element; `Row` for a table.
        shape, strides: of each dimension, strides in bytes; None where the value holds it.
        varying: number of those that the value holds.
    """

    def __init__(self, element: Any, shape: Any, strides: Any) -> None:
        """See the attributes."""
        self.element, self.shape, self.strides = element, tuple(shape), tuple(strides)
        self.ndim = len(self.shape)
        layout = (*self.shape, *self.strides)
        self.varying = layout.count(None)
        text = ",".join("?" if number is None else str(number) for number in layout)
        super().__init__(name=f"View({element.name},{text})")

    @classmethod
    def of(cls, array: Any) -> "View":
        """The view of an array, given numba's type of it."""
        record = isinstance(array.dtype, types.Record)
        element = Row(array.dtype) if record else array.dtype
        strides: list[int | None] = [None] * array.ndim
        if array.layout == "C":
            strides[-1] = element.itemsize if record else as_dtype(element).itemsize
        return cls(element, [None] * array.ndim, strides)

    @property
    def nbytes(self) -> int:
        """Bytes of the value: an address, and a word for each number that varies."""
        return 8 * (1 + self.varying)


@register_model(Row)
class _RowModel(models.PrimitiveModel):
    def __init__(self, manager: Any, row: Row) -> None:
        super().__init__(manager, row, _BYTES)


@register_model(View)
class _ViewModel(models.PrimitiveModel):
    def __init__(self, manager: Any, view: View) -> None:
        super().__init__(manager, view, _value_type(view))


def _value_type(view: View) -> Any:
    return ir.LiteralStructType([_BYTES, *[_WORD] * view.varying]) if view.varying else _BYTES


def _unpack(builder: Any, view: View, value: Any) -> tuple[Any, list[Any], list[Any]]:
    """Address, lengths and strides of a value."""
    if not view.varying:
        return value, [_WORD(n) for n in view.shape], [_WORD(n) for n in view.strides]
    places = iter(range(1, 1 + view.varying))
    layout = [
        builder.extract_value(value, next(places)) if number is None else _WORD(number)
        for number in (*view.shape, *view.strides)
    ]
    return builder.extract_value(value, 0), layout[: view.ndim], layout[view.ndim :]


def _pack(builder: Any, view: View, pointer: Any, shape: Any, strides: Any) -> Any:
    """The value of an address, lengths and strides."""
    if not view.varying:
        return pointer
    value = builder.insert_value(_value_type(view)(ir.Undefined), pointer, 0)
    layout = zip((*view.shape, *view.strides), (*shape, *strides), strict=True)
    varying = [number for constant, number in layout if constant is None]
    for place, number in enumerate(varying, 1):
        value = builder.insert_value(value, number, place)
    return value


def view_array(context: Any, builder: Any, array: Any, value: Any) -> Any:
    """The value of `View.of(array)`, given the value of numba's array."""
    names = context.data_model_manager[array]._fields
    data, shape, strides = (
        builder.extract_value(value, names.index(name)) for name in ("data", "shape", "strides")
    )
    lengths, steps = (cgutils.unpack_tuple(builder, x, array.ndim) for x in (shape, strides))
    return _pack(builder, View.of(array), builder.bitcast(data, _BYTES), lengths, steps)


def _load(context: Any, builder: Any, kind: Any, pointer: Any) -> Any:
    if isinstance(kind, Row):
        return pointer
    place = builder.bitcast(pointer, context.get_data_type(kind).as_pointer())
    return context.unpack_value(builder, kind, place)


def _store(context: Any, builder: Any, kind: Any, pointer: Any, given: Any, value: Any) -> None:
    """Stores a value of type `given` as one of type `kind`."""
    place = builder.bitcast(pointer, context.get_data_type(kind).as_pointer())
    context.pack_value(builder, kind, context.cast(builder, value, given, kind), place)


# --- rows ---------------------------------------------------------------------------------------


@infer_getattr
class _Members(AttributeTemplate):
    key = Row

    def generic_resolve(self, row: Row, name: str) -> Any:  # type: ignore[override]
        return row.member(name)


def _member_place(builder: Any, row: Row, pointer: Any, name: str) -> Any:
    return builder.gep(pointer, [_WORD(row.record.offset(name))], inbounds=True)


@lower_getattr_generic(Row)
def _get_member(context: Any, builder: Any, row: Row, pointer: Any, name: str) -> Any:
    kind, place = row.member(name), _member_place(builder, row, pointer, name)
    return place if isinstance(kind, View) else _load(context, builder, kind, place)


@lower_setattr_generic(Row)
def _set_member(context: Any, builder: Any, signature: Any, arguments: Any, name: str) -> None:
    row, given = signature.args
    place = _member_place(builder, row, arguments[0], name)
    _store(context, builder, row.member(name), place, given, arguments[1])


# --- views --------------------------------------------------------------------------------------


@infer_getattr
class _Attributes(AttributeTemplate):
    key = View

    def generic_resolve(self, view: View, name: str) -> Any:  # type: ignore[override]
        return types.UniTuple(types.intp, view.ndim) if name == "shape" else None


@lower_getattr(View, "shape")
def _shape(context: Any, builder: Any, view: View, value: Any) -> Any:
    lengths = _unpack(builder, view, value)[1]
    return context.make_tuple(builder, types.UniTuple(types.intp, view.ndim), lengths)


@infer_global(len)
class _Length(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        return signature(types.intp, *arguments) if isinstance(arguments[0], View) else None


@lower_builtin(len, View)
def _length(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _unpack(builder, signature.args[0], arguments[0])[1][0]


def _indices(index: Any) -> tuple[Any, ...]:
    """The types of an index or of a tuple of them."""
    parts: Any = index if isinstance(index, types.BaseTuple) else [index]
    return tuple(types.unliteral(part) for part in parts)


def _indexed(view: View, indices: tuple[Any, ...]) -> Any:
    """The type of an element or a part of a view; None if it has none for these indices."""
    supported = (types.Integer, types.SliceType)
    if len(indices) > view.ndim or not all(isinstance(i, supported) for i in indices):
        return None
    kept = [d for d, index in enumerate(indices) if isinstance(index, types.SliceType)]
    shape = (*[None] * len(kept), *view.shape[len(indices) :])
    strides = (*[view.strides[d] for d in kept], *view.strides[len(indices) :])
    return View(view.element, shape, strides) if shape else view.element


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        view, index = arguments
        result = _indexed(view, _indices(index)) if isinstance(view, View) else None
        return None if result is None else signature(result, view, index)


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        view, index, _ = arguments
        if not isinstance(view, View) or _indexed(view, _indices(index)) is not view.element:
            return None
        return signature(types.none, view, index, view.element)


def _place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Address, lengths and strides of what an index names."""
    view, index = signature.args[:2]
    pointer, shape, strides = _unpack(builder, view, arguments[0])
    single = not isinstance(index, types.BaseTuple)
    given = [arguments[1]] if single else cgutils.unpack_tuple(builder, arguments[1], len(index))
    kept_shape, kept_strides = [], []
    for kind, one, length, stride in zip(_indices(index), given, shape, strides, strict=False):
        first = one
        if isinstance(kind, types.SliceType):
            part = context.make_helper(builder, kind, value=one)
            first = part.start
            stop = builder.select(builder.icmp_signed("<", part.stop, length), part.stop, length)
            kept_shape.append(builder.sub(stop, first))
            kept_strides.append(stride)
        else:
            first = context.cast(builder, one, kind, types.intp)
        pointer = builder.gep(pointer, [builder.mul(first, stride)], inbounds=True)
    return pointer, kept_shape + shape[len(given) :], kept_strides + strides[len(given) :]


@lower_builtin(operator.getitem, View, types.Any)
def _getitem(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    pointer, shape, strides = _place(context, builder, signature, arguments)
    result = signature.return_type
    if isinstance(result, View):
        return _pack(builder, result, pointer, shape, strides)
    return _load(context, builder, result, pointer)


@lower_builtin(operator.setitem, View, types.Any, types.Any)
def _setitem(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    view, _, given = signature.args
    _store(context, builder, view.element, _place(context, builder, signature, arguments)[0],
           given, arguments[2])  # fmt: skip
    return context.get_dummy_value()
