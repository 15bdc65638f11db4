"""Bundles: named tuples of arrays, such as a model or a state, passed to a stage as one pointer.

Numba passes a named tuple of arrays as all of their parts: data, shape, strides and others, seven
or more for each array. With thirty arrays the instructions that take these apart and put them
together again at every call were more than half of a kernel. An entry puts a tuple into a bundle in
its own stack frame, its arrays as views; stages get its address, and read from it what they use.
Once they are inlined, LLVM sees both ends, and removes the bundle.
"""

import hashlib
from itertools import accumulate
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    lower_builtin,
    lower_getattr_generic,
    register_model,
    type_callable,
)

from physics.compiler.views import View, view_array

_BYTES = ir.IntType(8).as_pointer()


class Bundle(types.Type):
    """The type of a bundle; its name is short, as the names of functions contain it.

    Attributes:
        fields: names and types of its entries.
        offsets: of each entry, bytes; the last one is the size.
    """

    def __init__(self, content: Any) -> None:
        """`content`: the type of a named tuple of arrays or views."""
        views = [View.of(x) if isinstance(x, types.Array) else x for x in content.types]
        self.fields = dict(zip(content.fields, views, strict=True))
        self.offsets = [0, *accumulate(view.nbytes for view in views)]
        name = content.instance_class.__name__
        digest = hashlib.sha256(repr((name, content.fields, views)).encode()).hexdigest()[:16]
        super().__init__(name=f"{name}.{digest}")

    def seen_by(self, names: frozenset[str]) -> Any:
        """What the code of a function depends on that reads no other names than these."""
        places = zip(self.fields.items(), self.offsets, strict=False)
        return [(name, kind.name, place) for (name, kind), place in places if name in names]


@register_model(Bundle)
class _BundleModel(models.PrimitiveModel):
    def __init__(self, manager: Any, bundle: Bundle) -> None:
        super().__init__(manager, bundle, _BYTES)


@infer_getattr
class _Fields(AttributeTemplate):
    key = Bundle

    def generic_resolve(self, bundle: Bundle, name: str) -> Any:  # type: ignore[override]
        return bundle.fields.get(name)


def _place(context: Any, builder: Any, pointer: Any, offset: int, view: View) -> Any:
    """The address of an entry of a bundle."""
    place = builder.gep(pointer, [ir.Constant(ir.IntType(64), offset)], inbounds=True)
    return builder.bitcast(place, context.get_value_type(view).as_pointer())


@lower_getattr_generic(Bundle)
def _load(context: Any, builder: Any, bundle: Bundle, pointer: Any, name: str) -> Any:
    offset = bundle.offsets[list(bundle.fields).index(name)]
    return builder.load(_place(context, builder, pointer, offset, bundle.fields[name]))


def bundle(value: Any) -> Any:
    """A named tuple of arrays as a bundle; in plain Python the tuple itself.

    It lives in the stack frame of the function that calls this, which must not return it.
    """
    return value


@type_callable(bundle)
def _type_bundle(context: Any) -> Any:
    def typed(value: Any) -> Any:
        return Bundle(value)

    return typed


@lower_builtin(bundle, types.BaseNamedTuple)
def _store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    content, kind = signature.args[0], signature.return_type
    words = ir.ArrayType(ir.IntType(64), kind.offsets[-1] // 8)
    pointer = builder.bitcast(cgutils.alloca_once(builder, words), _BYTES)
    for n, (given, view) in enumerate(zip(content.types, kind.fields.values(), strict=True)):
        value = builder.extract_value(arguments[0], n)
        if isinstance(given, types.Array):
            value = view_array(context, builder, given, value)
        builder.store(value, _place(context, builder, pointer, kind.offsets[n], view))
    return pointer
