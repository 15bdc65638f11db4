"""Contacts of a body that press along the same line split its mass; others don't."""

import numpy as np
import pytest

from physics.analysis.contact_stiffness import mass_parts

# solids 0 and 1 are bodies; what is beyond doesn't move
INVERSE_MASS = np.array([1.0, 3.0])
UP, DOWN, ASIDE = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)
STEEP = (0.5, 0.0, np.sqrt(0.75))


@pytest.mark.parametrize(
    ("ends", "normals", "parts"),
    [
        ([(0, 2)], [UP], [1.0]),
        ([(0, 2), (0, 3)], [UP, DOWN], [2.0, 2.0]),
        ([(0, 2), (0, 3)], [UP, ASIDE], [1.0, 1.0]),
        ([(0, 2), (0, 3)], [UP, STEEP], [1.75, 1.75]),
        # four samples of one pair, and the two half-pairs of two boxes, are one contact
        ([(0, 2)] * 4, [UP] * 4, [1.0] * 4),
        ([(1, 0), (0, 1)], [UP, DOWN], [1.0, 1.0]),
        # only body 0 is squeezed: (2 * 1 + 1 * 3) / 4 for the contact with body 1
        ([(0, 2), (1, 0)], [UP, UP], [2.0, 1.25]),
    ],
)
def test_parts_count_what_presses_along_the_same_line(ends, normals, parts):
    weights = np.full(len(ends), 0.5)
    found = mass_parts(np.array(ends), np.array(normals), weights, INVERSE_MASS)
    assert found == pytest.approx(parts, abs=1e-12)


def test_without_contacts_there_is_nothing_to_split():
    assert len(mass_parts(np.zeros((0, 2), int), np.zeros((0, 3)), np.zeros(0), INVERSE_MASS)) == 0
