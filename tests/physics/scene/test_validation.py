"""Checks name the field and the value, and let numpy's numbers through."""

import math

import numpy as np
import pytest

from physics.scene import validation


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.int64(2), np.float64(2)])
def test_every_kind_of_number_becomes_a_float(value):
    result = validation.number("x", value)
    assert result == 2.0
    assert type(result) is float


def test_numbers_keep_to_their_range():
    assert validation.number("x", 0.0, low=0.0, high=1.0) == 0.0
    with pytest.raises(ValueError, match=r"x must be finite and above 0 and below 1, got 0\.0"):
        validation.number("x", 0.0, low=0.0, high=1.0, exclusive=True)
    with pytest.raises(ValueError, match=r"x must be finite, got nan"):
        validation.number("x", math.nan)


def test_integers_are_whole_by_type():
    assert validation.integer("n", np.int32(3), low=1) == 3
    with pytest.raises(TypeError, match=r"n must be an integer, got 3\.0 \(float\)"):
        validation.integer("n", 3.0, low=1)


def test_arrays_broadcast_and_name_the_first_bad_entry():
    assert validation.array("v", (1, 2, 3), (4, 2, 3)).shape == (4, 2, 3)
    bad = np.zeros((2, 3))
    bad[1, 2] = np.nan
    with pytest.raises(ValueError, match=r"v must be finite, got nan at index \(1, 2\)"):
        validation.array("v", bad, (2, 3))
    with pytest.raises(
        ValueError, match=r"v must be numbers of shape \(2, 3\), got shape \(2, 4\)"
    ):
        validation.array("v", np.zeros((2, 4)), (2, 3))
    with pytest.raises(ValueError, match=r"v must be numbers of shape \(2,\), got 'ab'"):
        validation.array("v", "ab", (2,))
    with pytest.raises(ValueError, match=r"v must be numbers of shape \(1, 0, 3\), got \[\[\[1"):
        validation.array("v", [[[1.0, 0.0, 0.0]]], (1, 0, 3))


def test_a_choice_suggests_the_nearest_name():
    with pytest.raises(ValueError, match=r"one of \['sphere', 'box'\], got 'spere'; did you mean"):
        validation.choice("kind", "spere", ["sphere", "box"])
