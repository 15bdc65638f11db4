"""What a compiled function can reach tells it from others; nothing else does."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from physics.compiler.atomics import wait_for_all
from physics.compiler.files.identity import NoIdentityError, identify

FACTOR = 2.0
TABLE = np.arange(3.0)
NAMES = ["a list"]


class Pair(NamedTuple):
    """A tuple that a kernel may make."""

    one: float
    other: float


def digest(function):
    return identify(function).digest


def make(value):
    return lambda: value


def uses_factor(x):
    return FACTOR * x


def calls(x):
    return uses_factor(x) + math.sqrt(x)


def uses_table(i):
    return TABLE[i]


def makes_pairs(x):
    return Pair(x, x)


def again(n):
    return again(n - 1) if n > 0 else 0


def waits(counter):
    wait_for_all(counter, 1)


def uses_names():
    return len(NAMES)


def test_what_this_package_makes_has_an_identity():
    """Its files are a part of every key."""
    assert digest(waits) == digest(waits)


def test_values_in_the_closure_count():
    values = (1, 2, 1.0, True, None, "1", (1, 2), np.dtype("f8"), make(1), make(2), np.ones(2))
    assert len({digest(make(value)) for value in values}) == len(values)
    assert digest(make((1, make(2)))) == digest(make((1, make(2))))


@pytest.mark.parametrize(
    ("function", "name", "other"),
    [
        (uses_factor, "FACTOR", 3.0),
        (calls, "FACTOR", 3.0),
        (calls, "uses_factor", makes_pairs),
        (uses_table, "TABLE", np.arange(1.0, 4.0)),
        (makes_pairs, "Pair", tuple),
    ],
)
def test_what_a_function_can_reach_counts(function, name, other, monkeypatch):
    from physics.compiler.files import identity

    before = digest(function)
    monkeypatch.setattr(identity, "_known", {})
    assert digest(function) == before
    monkeypatch.setattr(identity, "_known", {})
    monkeypatch.setitem(globals(), name, other)
    assert digest(function) != before
    monkeypatch.setattr(identity, "_known", {})
    monkeypatch.setitem(globals(), "NAMES", ())  # which none of them reads
    assert digest(function) != before


def test_what_a_function_cannot_reach_does_not_count(monkeypatch):
    from physics.compiler.files import identity

    before = digest(makes_pairs)
    monkeypatch.setattr(identity, "_known", {})
    monkeypatch.setitem(globals(), "FACTOR", 5.0)
    assert digest(makes_pairs) == before


def test_a_function_may_call_itself():
    assert digest(again) == digest(again) != ""


def test_a_value_without_an_identity_is_named():
    with pytest.raises(NoIdentityError, match=r"uses_names is compiled, and can reach \['a"):
        digest(uses_names)
    with pytest.raises(NoIdentityError, match="which is a list"):
        digest(make([1]))
