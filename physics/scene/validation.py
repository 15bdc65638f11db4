"""Checks of what users pass in. Each error names the field, its value and what would be right."""

import math
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

import numpy as np

Vector = tuple[float, ...]

ZERO: Vector = (0.0, 0.0, 0.0)
IDENTITY: Vector = (0.0, 0.0, 0.0, 1.0)  # the quaternion x y z w of no rotation


def number(
    field: str,
    value: Any,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    exclusive: bool = False,
) -> float:
    """`value` as a finite float within low and high, and neither of them if `exclusive`.

    Raises:
        TypeError: not a real number (bool counts as none).
        ValueError: NaN, infinite, or out of range.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
        raise TypeError(f"{field} must be a number, got {value!r} ({type(value).__name__})")
    result = float(value)
    inside = low < result < high if exclusive else low <= result <= high
    if not math.isfinite(result) or not inside:
        limits = [
            f"{words[not exclusive]} {limit:g}"
            for limit, words in ((low, ("above", "at least")), (high, ("below", "at most")))
            if math.isfinite(limit)
        ]
        wanted = " and ".join(["finite", *limits])
        raise ValueError(f"{field} must be {wanted}, got {value!r}")
    return result


def positive(field: str, value: Any) -> float:
    """`value` as a finite float above zero."""
    return number(field, value, low=0.0, exclusive=True)


def integer(field: str, value: Any, *, low: int) -> int:
    """`value` as an int of at least `low`."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        raise TypeError(f"{field} must be an integer, got {value!r} ({type(value).__name__})")
    if value < low:
        raise ValueError(f"{field} must be at least {low}, got {value!r}")
    return int(value)


def vector(field: str, value: Any, size: int = 3) -> tuple[float, ...]:
    """`value` as a tuple of `size` finite floats."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"{field} must be {size} numbers, got {value!r}") from None
    if array.shape != (size,):
        names = "(x, y, z)" if size == 3 else "(x, y, z, w)"
        raise ValueError(f"{field} must be {size} numbers {names}, got {value!r}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{field} must be finite, got {value!r}")
    return tuple(float(x) for x in array)


def unit_quaternion(field: str, value: Any) -> tuple[float, ...]:
    """`value` as a quaternion x, y, z, w of length one with w >= 0; q and -q are one rotation.

    Raises:
        TypeError, ValueError: not four finite numbers; a length of zero.
    """
    quaternion = vector(field, value, 4)
    length = math.hypot(*quaternion)
    if length < 1e-12:
        raise ValueError(
            f"{field} must be a quaternion (x, y, z, w) of non-zero length, got {value!r}; "
            "no rotation is (0, 0, 0, 1)"
        )
    length = math.copysign(length, quaternion[3]) if quaternion[3] != 0.0 else length
    return tuple(x / length for x in quaternion)


def text(field: str, value: Any) -> str:
    """`value` as a text that isn't empty."""
    if not isinstance(value, str):
        raise TypeError(f"{field} must be a text, got {value!r} ({type(value).__name__})")
    if not value.strip():
        raise ValueError(f"{field} must not be empty, got {value!r}")
    return value


def choice(field: str, value: Any, valid: Iterable[str]) -> str:
    """`value` if it is one of the `valid` names."""
    names = list(valid)
    if not isinstance(value, str) or value not in names:
        near = get_close_matches(str(value), names, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"{field} must be one of {names}, got {value!r}{hint}")
    return value


def instance(field: str, value: Any, *types: type) -> Any:
    """`value` if it is an instance of one of `types`."""
    # a class has the members of a protocol too
    if isinstance(value, type) or not isinstance(value, types):
        names = " or ".join(t.__name__ for t in types)
        raise TypeError(f"{field} must be {names}, got {value!r} ({type(value).__name__})")
    return value


def array(field: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """`value` as a finite float array broadcast to `shape`."""
    try:
        result = np.asarray(value, dtype=float)
        if result.ndim and result.size and 0 in shape[1:]:  # of nothing, numbers are too many
            raise ValueError
        if result.shape != shape:
            result = np.broadcast_to(result, shape)
    except (TypeError, ValueError):
        got = getattr(value, "shape", None)
        shown = f"shape {got}" if got is not None else repr(value)
        raise ValueError(f"{field} must be numbers of shape {shape}, got {shown}") from None
    finite = np.isfinite(result)
    if np.count_nonzero(finite) < finite.size:  # quicker than all() for the few of a single world
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(result))[0])
        raise ValueError(f"{field} must be finite, got {result[where]} at index {where}")
    return result
