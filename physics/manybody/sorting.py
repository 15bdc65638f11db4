"""Sorting of pairs, by counting: their keys are small numbers."""

from functools import cache

import numpy as np

from physics.compiler.jit import entry

Array = np.ndarray


@cache
def make_sort_pairs():
    """Entry point: sorts pairs by their first solid, then by their second."""

    @entry
    def sort_pairs(found, places, first, out):
        """`found`: [n] first place times `places` plus second; `first`: [places + 1] working."""
        for p in range(places + 1):
            first[p] = 0
        for n in range(found.shape[0]):
            first[found[n] // places + 1] += 1
        for p in range(places):
            first[p + 1] += first[p]
        for n in range(found.shape[0]):
            p = found[n] // places
            out[first[p]] = found[n]
            first[p] += 1
        start = 0
        for p in range(places):  # first[p] is now where those of p end
            for n in range(start + 1, first[p]):
                value, m = out[n], n
                while m > start and out[m - 1] > value:
                    out[m] = out[m - 1]
                    m -= 1
                out[m] = value
            start = first[p]

    return sort_pairs


@cache
def make_order_by():
    """Entry point: one pass of a stable sort by a column of small keys."""

    @entry
    def order_by(keys, largest, before, after, first):
        """Writes the order `after` of the entries `before` [n] by `keys` [n], 0 to `largest`."""
        for k in range(largest + 2):
            first[k] = 0
        for n in range(keys.shape[0]):
            first[keys[n] + 1] += 1
        for k in range(largest + 1):
            first[k + 1] += first[k]
        for n in range(before.shape[0]):
            k = keys[before[n]]
            after[first[k]] = before[n]
            first[k] += 1

    return order_by


def lexicographic_order(columns: list[Array]) -> Array:
    """Order [n] by columns [n] of small numbers, the most important one first."""
    order, order_by = np.arange(len(columns[0])), make_order_by()
    for keys in reversed(columns):
        largest = int(keys.max(initial=0))
        after = np.empty_like(order)
        order_by(np.ascontiguousarray(keys), largest, order, after, np.empty(largest + 2, np.int64))
        order = after
    return order
