"""Distance of goals, and what of a row lies within its bounds: one pass over all worlds.

A goal is a row of points of three components each; what is left over at its end is a point of
fewer. Two goals are as far apart as their points that are farthest apart.
"""

import math
from functools import cache
from typing import Any

import numpy as np

from physics.jit import SOURCES, entry, kernel

Array = np.ndarray


@kernel
def _apart(a, b, first, n, i):
    """Distance of the goals a[i, first : first + n] and b[i, :n]."""
    largest = 0.0
    for point in range(0, n, 3):
        square = 0.0
        for c in range(point, min(point + 3, n)):
            d = np.float64(a[i, first + c]) - np.float64(b[i, c])
            square += d * d
        if square > largest or square != square:  # NaN stays NaN
            largest = square
    return math.sqrt(largest)


@cache
def _make_distances() -> Any:
    sources = SOURCES

    @entry
    def distances(a, b, out):
        _ = sources
        for i in range(out.shape[0]):
            out[i] = _apart(a, b, 0, a.shape[1], i)

    return distances


@cache
def _make_judge() -> Any:
    sources = SOURCES

    @entry
    def judge(values, low, high, goals, apart, outside):
        _ = sources
        split = values.shape[1] - goals.shape[1]
        for i in range(values.shape[0]):
            beyond = False
            for c in range(values.shape[1]):
                x = values[i, c]
                if x < low[c]:
                    values[i, c] = low[c]
                    beyond = True
                elif x > high[c]:
                    values[i, c] = high[c]
                    beyond = True
            outside[i] = beyond
            apart[i] = _apart(values, goals, split, goals.shape[1], i)

    return judge


def distance(a: Any, b: Any) -> Any:
    """Distance [...] m of goals [..., n], of points if n is 3; the leading axes broadcast."""
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape:
        a, b = np.broadcast_arrays(a, b)
    flat_a = np.ascontiguousarray(a, dtype=np.float64)
    flat_b = np.ascontiguousarray(b, dtype=np.float64)
    if a.ndim != 2:
        flat_a, flat_b = flat_a.reshape(-1, a.shape[-1]), flat_b.reshape(-1, a.shape[-1])
    out = np.empty(len(flat_a))
    _make_distances()(flat_a, flat_b, out)
    return out if a.ndim == 2 else out.reshape(a.shape[:-1])[()]


def judge(values: Array, low: Array, high: Array, goals: Array) -> tuple[Array, Array]:
    """Clips rows to their bounds, and tells how far each is from its goal.

    Args:
        values: [n, observation + goal] float32, C-contiguous; clipped in place.
        low: [observation + goal] float32.
        high: likewise.
        goals: [n, goal] float32, C-contiguous.

    Returns:
        distance [n] m of the goal that ends a row and the one wanted; whether [n] it was clipped.
    """
    apart, outside = np.empty(len(values)), np.empty(len(values), dtype=bool)
    _make_judge()(values, low, high, goals, apart, outside)
    return apart, outside
