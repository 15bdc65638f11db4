"""Clips observations to their bounds, in one pass over all worlds."""

from functools import cache
from typing import Any

import numpy as np

from physics.compiler.code_cache import SOURCES
from physics.compiler.jit import entry

Array = np.ndarray


@cache
def _make_clip() -> Any:
    sources = SOURCES

    @entry
    def clip(columns, low, high, outside):
        _ = sources
        count = outside.shape[0]
        outside[:] = False
        for c in range(columns.shape[0]):
            column, least, most = columns[c], low[c], high[c]
            beyond = 0
            for i in range(count):  # without a branch; most columns need only this loop
                beyond += (column[i] < least) | (column[i] > most)
            if beyond > 0:
                for i in range(count):
                    if column[i] < least:
                        column[i], outside[i] = least, True
                    elif column[i] > most:
                        column[i], outside[i] = most, True

    return clip


def clip(columns: Array, low: Array, high: Array, count: int) -> Array:
    """Clips columns to their bounds in place; NaN stays NaN.

    Args:
        columns: [n, count or more] float32, C-contiguous.
        low: [n] float32.
        high: [n] float32.
        count: number of worlds.

    Returns:
        [count] bool, whether any component of a world was clipped.
    """
    outside = np.empty(count, dtype=bool)
    _make_clip()(columns, low, high, outside)
    return outside
