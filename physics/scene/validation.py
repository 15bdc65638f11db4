"""Validation of user input. Each error message names the field, its value and what is allowed."""

import math
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

import numpy as np

Vector = tuple[float, ...]

ZERO: Vector = (0.0, 0.0, 0.0)
IDENTITY: Vector = (0.0, 0.0, 0.0, 1.0)  # the quaternion x y z w of no rotation

# half of what an int64 holds: a sum of two fits, too
_LARGEST = 2**62


def number(
    field: str,
    value: Any,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    exclusive: bool = False,
) -> float:
    """Returns `value` as a finite float from low to high, without both limits if `exclusive`.

    Raises:
        TypeError: not a real number (a bool is not accepted).
        ValueError: NaN, infinite or out of range.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
        raise TypeError(f"{field} must be a number, got {value!r} ({type(value).__name__})")
    try:
        result = float(value)
    except OverflowError:  # an integer beyond all floats
        result = math.inf if value > 0 else -math.inf
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
    """Returns `value` as a finite float above zero.

    Raises:
        TypeError, ValueError: see `number`.
    """
    return number(field, value, low=0.0, exclusive=True)


def integer(field: str, value: Any, *, low: int, high: int = _LARGEST) -> int:
    """Returns `value` as an int from `low` to `high`, by default the largest of kernels.

    Raises:
        TypeError: not an integer (a bool is not accepted).
        ValueError: out of range.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        raise TypeError(f"{field} must be an integer, got {value!r} ({type(value).__name__})")
    if value < low:
        raise ValueError(f"{field} must be at least {low}, got {value!r}")
    if value > high:
        limit = "2**62" if high == _LARGEST else high
        raise ValueError(f"{field} must be at most {limit}, got {value!r}")
    return int(value)


def vector(field: str, value: Any, size: int = 3) -> tuple[float, ...]:
    """Returns `value` as a tuple of `size` finite floats.

    Raises:
        TypeError: not numbers.
        ValueError: another number of values, or one that is not finite.
    """
    try:
        array = np.asarray(value, dtype=float)
    except OverflowError:  # an integer beyond all floats
        raise ValueError(f"{field} must be finite, got {value!r}") from None
    except (TypeError, ValueError):
        raise TypeError(f"{field} must be {size} numbers, got {value!r}") from None
    if array.shape != (size,):
        names = {3: " (x, y, z)", 4: " (x, y, z, w)"}.get(size, "")
        raise ValueError(f"{field} must be {size} numbers{names}, got {value!r}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{field} must be finite, got {value!r}")
    # a million bodies at rest share their zeros
    same = type(value) is tuple and all(type(x) is float for x in value)
    return value if same else tuple(float(x) for x in array)


def unit_quaternion(field: str, value: Any) -> tuple[float, ...]:
    """Returns `value` as a unit quaternion x, y, z, w with w >= 0 (q and -q are the same rotation).

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
    if abs(length - 1.0) < 1e-15:  # stays as it is, so that a saved one is read bit by bit
        length = 1.0
    length = math.copysign(length, quaternion[3]) if quaternion[3] != 0.0 else length
    return quaternion if length == 1.0 else tuple(x / length for x in quaternion)


def text(field: str, value: Any) -> str:
    """Returns `value` if it is a string that is not empty.

    Raises:
        TypeError: not a string.
        ValueError: empty, or only white space.
    """
    if not isinstance(value, str):
        raise TypeError(f"{field} must be a string, got {value!r} ({type(value).__name__})")
    if not value.strip():
        raise ValueError(f"{field} must not be empty, got {value!r}")
    return value


def choice(field: str, value: Any, valid: Iterable[str]) -> str:
    """Returns `value` if it is one of the `valid` names.

    Raises:
        ValueError: it is not; the message suggests a similar name.
    """
    names = list(valid)
    if not isinstance(value, str) or value not in names:
        near = get_close_matches(str(value), names, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"{field} must be one of {names}, got {value!r}{hint}")
    return value


def instance(field: str, value: Any, *types: type) -> Any:
    """Returns `value` if it is an instance of one of `types`.

    Raises:
        TypeError: it is not.
    """
    # isinstance() with a protocol also accepts a class that has its members
    if isinstance(value, type) or not isinstance(value, types):
        names = " or ".join(t.__name__ for t in types)
        raise TypeError(f"{field} must be {names}, got {value!r} ({type(value).__name__})")
    return value


def array(field: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Returns `value` as a finite float array broadcast to `shape`.

    Raises:
        ValueError: not numbers, not broadcastable, or not finite.
    """
    try:
        result = np.asarray(value, dtype=float)
        if result.shape != shape:
            if result.ndim and result.size and 0 in shape[1:]:  # would broadcast to no values
                raise ValueError
            result = np.broadcast_to(result, shape)
    except (TypeError, ValueError, OverflowError):
        got = getattr(value, "shape", None)
        shown = f"shape {got}" if got is not None else repr(value)
        raise ValueError(f"{field} must be numbers of shape {shape}, got {shown}") from None
    finite = np.isfinite(result)
    if np.count_nonzero(finite) < finite.size:  # faster than all() for small arrays
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(result))[0])
        raise ValueError(f"{field} must be finite, got {result[where]} at index {where}")
    return result
