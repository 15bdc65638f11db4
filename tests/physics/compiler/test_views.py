"""Views of arrays in a bundle do in compiled code what the arrays do in Python; so do counters."""

from typing import NamedTuple

import numpy as np
import pytest

from physics.compiler.bundles import bundle
from physics.compiler.jit import at, entry, stage

ROW = np.dtype(
    [("mass", "f8"), ("place", "f8", (3, 4)), ("flag", "i1"), ("count", "i8")], align=True
)


class Tables(NamedTuple):
    """Arrays of records, numbers and flags."""

    row: np.ndarray
    number: np.ndarray
    on: np.ndarray


@stage
def total(values):
    result = 0.0
    for i in range(len(values)):
        result += values[i]
    return result


@stage
def work(tables, out):
    row = tables.row[1, 2]  # two indices
    row.mass = row.mass + row.flag * row.count
    row.flag = 3
    for c in range(3):
        line = row.place[c]  # a part of a field
        for i in range(1, 4):
            line[i] += at(row.place[0], 0) + at(row.mass, i)
    out[0] = total(tables.number[1, 1:3])
    out[1] = total(tables.number[:, 2])  # a column: its stride is not that of an element
    out[2] = total(tables.number[0, :99])  # ends at the end, as in Python
    out[3] = tables.number[2:].shape[0] + 10 * tables.number.shape[1] + 100 * len(tables.row)
    tables.number[2, 3] = 7
    some = tables.row[0, 1:3]
    some[1].count = 5
    tables.on[1] = not tables.on[0]
    out[4] = 1.0 if tables.on[1] else 2.0


def make_work():
    """A new entry: the arguments of an entry always have the same layout."""

    @entry
    def work_compiled(tables, out):
        work(bundle(tables), out)

    return work_compiled


def make(order="C"):
    row = np.zeros((2, 3), ROW)
    row["mass"], row["flag"], row["count"] = 1.5, 2, 3
    row["place"] = np.arange(12.0).reshape(3, 4)
    return Tables(
        row, np.asarray(np.arange(12.0).reshape(3, 4), order=order), np.array([False, False])
    )


@pytest.mark.parametrize("order", ["C", "F"])
def test_views_are_what_numpy_has(order):
    plain, compiled = make(order), make(order)
    expected, found = np.zeros(5), np.zeros(5)
    work(plain._replace(row=plain.row.view(np.recarray)), expected)
    make_work()(compiled, found)
    np.testing.assert_array_equal(found, expected)
    for one, other in zip(plain, compiled, strict=True):
        np.testing.assert_array_equal(one, other)


@stage
def count(first, end, backwards):
    numbers = 0
    for i in range(end):
        numbers += i
    for i in range(first, end):
        numbers += 1000 * i
    for i in range(end, first, -1):
        numbers += backwards * i
        if i == 3:
            break
    end = 0  # a range is evaluated once
    return numbers + end


@entry
def count_compiled(first, end, backwards):
    return count(first, end, backwards)


@pytest.mark.parametrize(("first", "end"), [(0, 5), (2, 5), (5, 2), (-3, 2), (0, 0)])
def test_loops_count_as_in_python(first, end):
    assert count_compiled(first, end, 10**6) == count(first, end, 10**6)
