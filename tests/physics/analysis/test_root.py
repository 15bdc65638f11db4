"""The search for the step at which a load reaches the limit, against closed forms."""

import math

import pytest

from physics.analysis.stability import root

CASES = {  # load, root
    "damper": (lambda h: 3.0 * h, 2.0 / 3.0),
    "spring": (lambda h: 5e7 * h * h, math.sqrt(4e-8)),
    "both": (lambda h: 4e3 * h + 1e6 * h * h, (math.sqrt(16e6 + 8e6) - 4e3) / 2e6),
    "none": (lambda h: 0.0, math.inf),
    "never enough": (lambda h: min(1.9, h), math.inf),
    "always too much": (lambda h: 1e9, 1e-12),
    "infinite": (lambda h: math.inf, 1e-12),
    "jump": (lambda h: 0.0 if h < 1e-3 else 1e200, 1e-3),
}


@pytest.mark.parametrize(("load", "expected"), CASES.values(), ids=CASES)
def test_root_of_a_load(load, expected):
    assert root(load) == pytest.approx(expected, rel=2e-10)


def test_a_root_takes_few_evaluations():
    steps = []

    def load(h):
        steps.append(h)
        return 4e3 * h + 1e6 * h * h

    root(load)
    assert len(steps) <= 15
