"""Clips observations to their bounds and transposes them, in one pass over all worlds each."""

from functools import cache
from typing import Any

import numpy as np

from physics.compiler.code_cache import SOURCES
from physics.compiler.jit import entry

Array = np.ndarray

_BLOCK = 64  # worlds; about 10 KB of rows


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


@cache
def _make_transpose() -> Any:
    sources = SOURCES

    @entry
    def transpose(columns, first, rows):
        _ = sources
        # a block's rows stay in the cache until its last column is written
        for start in range(0, rows.shape[0], _BLOCK):
            end = min(start + _BLOCK, rows.shape[0])
            for c in range(rows.shape[1]):
                column = columns[first + c]
                for i in range(start, end):
                    rows[i, c] = column[i]

    return transpose


def rows_of(columns: Array, first: int, last: int, count: int) -> Array:
    """Columns `first` to `last` - 1 as rows [count, n], one per world.

    Args:
        columns: [n, count or more] float32, C-contiguous.
        first: index of the first column.
        last: index behind that of the last.
        count: number of worlds.
    """
    rows = np.empty((count, last - first), dtype=np.float32)
    _make_transpose()(columns, first, rows)
    return rows
