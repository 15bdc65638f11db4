"""Distance of goals.

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
def _apart(a, b, i):
    """Distance of the goals a[:, i] and b[:, i]."""
    largest, n = 0.0, a.shape[0]
    for point in range(0, n, 3):
        square = 0.0
        for c in range(point, min(point + 3, n)):
            d = np.float64(a[c, i]) - np.float64(b[c, i])
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
            out[i] = _apart(a, b, i)

    return distances


def distance(a: Any, b: Any) -> Any:
    """Distance [...] m of goals [..., n], of points if n is 3; the leading axes broadcast."""
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape:
        a, b = np.broadcast_arrays(a, b)
    n = a.shape[-1]
    rows_a, rows_b = (a, b) if a.ndim == 2 else (a.reshape(-1, n), b.reshape(-1, n))
    out = np.empty(len(rows_a))
    columns = (np.ascontiguousarray(rows.T, dtype=np.float64) for rows in (rows_a, rows_b))
    _make_distances()(*columns, out)
    return out if a.ndim == 2 else out.reshape(a.shape[:-1])[()]
