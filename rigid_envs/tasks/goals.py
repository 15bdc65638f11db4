"""Distance between goals.

A `Measure` is a stage that computes it from columns. `points` is the one of most tasks: a goal is a
row of points with three components each. If the number of components is not a multiple of three,
the last point has fewer. The distance between two goals is the largest of the distances between
their corresponding points.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from physics.compiler.jit import entry, stage

Array = np.ndarray
Measure = Callable[[Array, Array, int], float]
"""A stage: the distance between the goals a[:, i] and b[:, i]."""


@stage
def points(a, b, i):
    """Distance in m between the goals a[:, i] and b[:, i]."""
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
def _make_distances(measure: Measure) -> Any:

    @entry
    def distances(a, b, out):
        for i in range(out.shape[0]):
            out[i] = measure(a, b, i)

    return distances


def distance(a: Any, b: Any, measure: Measure = points) -> Any:
    """Distance [...] between goals [..., n]; by default in m. Leading axes broadcast."""
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape:
        a, b = np.broadcast_arrays(a, b)
    n = a.shape[-1]
    rows_a, rows_b = (a, b) if a.ndim == 2 else (a.reshape(-1, n), b.reshape(-1, n))
    out = np.empty(len(rows_a))
    columns_a = np.ascontiguousarray(rows_a.T, dtype=np.float64)
    _make_distances(measure)(columns_a, np.ascontiguousarray(rows_b.T, dtype=np.float64), out)
    return out if a.ndim == 2 else out.reshape(a.shape[:-1])[()]
