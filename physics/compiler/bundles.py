"""Bundles: the arrays of a model, a state or a workspace, passed to a stage as one pointer.

Numba passes a named tuple of arrays as all of their parts: data, shape, strides and others, seven
or more for each array. With thirty arrays the instructions that take these apart and put them
together again at every call were more than half of a kernel. An entry puts a tuple into a bundle in
its own stack frame; stages get its address, and read from it what they use. Once they are inlined,
LLVM sees both ends, and removes the bundle.
"""

import hashlib
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

_BYTES = ir.IntType(8).as_pointer()


class Bundle(types.Type):
    """The type of a bundle; its name is short, as the names of functions contain it."""

    def __init__(self, content: Any) -> None:
        """`content`: the type of the named tuple."""
        self.content = content
        digest = hashlib.sha256(str(content).encode()).hexdigest()[:16]
        super().__init__(name=f"{content.instance_class.__name__}.{digest}")


@register_model(Bundle)
class _BundleModel(models.PrimitiveModel):
    def __init__(self, manager: Any, bundle: Bundle) -> None:
        super().__init__(manager, bundle, _BYTES)


@infer_getattr
class _Fields(AttributeTemplate):
    key = Bundle

    def generic_resolve(self, bundle: Bundle, name: str) -> Any:  # type: ignore[override]
        fields = bundle.content.fields
        return bundle.content.types[fields.index(name)] if name in fields else None


def _place(context: Any, builder: Any, content: Any, pointer: Any, index: int) -> Any:
    """The address of an entry of a bundle."""
    kinds = [context.get_value_type(one) for one in content.types]
    offset = sum(context.get_abi_sizeof(kind) for kind in kinds[:index])
    place = builder.gep(pointer, [ir.Constant(ir.IntType(64), offset)])
    return builder.bitcast(place, kinds[index].as_pointer())


@lower_getattr_generic(Bundle)
def _load(context: Any, builder: Any, bundle: Bundle, pointer: Any, name: str) -> Any:
    index = bundle.content.fields.index(name)
    return builder.load(_place(context, builder, bundle.content, pointer, index))


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
    content = signature.args[0]
    size = sum(context.get_abi_sizeof(context.get_value_type(one)) for one in content.types)
    words = ir.ArrayType(ir.IntType(64), -(-size // 8))
    pointer = builder.bitcast(cgutils.alloca_once(builder, words), _BYTES)
    for index in range(len(content.types)):
        place = _place(context, builder, content, pointer, index)
        builder.store(builder.extract_value(arguments[0], index), place)
    return pointer
