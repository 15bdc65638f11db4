"""A stage reads and writes the arrays of a bundle, and numba names a field that it lacks."""

from typing import NamedTuple

import numpy as np
import pytest

from physics.compiler.bundles import bundle
from physics.compiler.jit import entry, stage


class Parts(NamedTuple):
    """Arrays of several dtypes and dimensions."""

    mass: np.ndarray
    place: np.ndarray
    flag: np.ndarray


@stage
def add_up(parts, sums, w):
    sums[w] = parts.mass[w] * parts.flag[w]
    for c in range(parts.place.shape[1]):
        parts.place[w, c] += sums[w]


@entry
def add_up_all(parts, other, sums):
    for w in range(sums.shape[0]):
        add_up(bundle(parts if w % 2 == 0 else other), sums, w)


@stage
def read_what_is_missing(parts, sums):
    sums[0] = parts.weight[0]


@entry
def read_missing(parts, sums):
    read_what_is_missing(bundle(parts), sums)


def make_parts(count):
    return Parts(
        np.arange(1.0, count + 1.0), np.zeros((count, 3))[:, ::-1], np.full(count, 2, np.int8)
    )


def test_a_stage_reads_and_writes_the_arrays_of_a_bundle():
    one, other, sums = make_parts(4), make_parts(4), np.zeros(4)
    add_up_all(one, other, sums)
    np.testing.assert_array_equal(sums, [2.0, 4.0, 6.0, 8.0])
    np.testing.assert_array_equal(one.place[:, 2], [2.0, 0.0, 6.0, 0.0])
    np.testing.assert_array_equal(other.place[:, 0], [0.0, 4.0, 0.0, 8.0])


def test_in_plain_python_a_bundle_is_the_tuple_itself():
    parts = make_parts(2)
    assert bundle(parts) is parts


def test_a_missing_field_is_named():
    with pytest.raises(Exception, match="weight"):
        read_missing(make_parts(1), np.zeros(1))
