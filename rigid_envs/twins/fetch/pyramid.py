"""Friction of MuJoCo's pyramid, which is soft.

It is the sum of four forces along +x, -x, +y and -y, at least 0, which share the limit of friction.
Each grows in proportion to the slip against it. So what slips slowly creeps, held back in
proportion to its slip, and what slips fast has all of the friction against it, the more of it along
x the faster it slips along x.
"""

from typing import Any

import numpy as np

Array = np.ndarray


def friction(slip: Array, limit: Any, creeping: float) -> Array:
    """Friction [n, 2] along x and y, against the slip [n, 2].

    Each of the four is limit * max(level ± creeping / (2 limit) * slip, 0), with the level at which
    their sum is the limit. That is the least of the levels at which those of the first one, two,
    three or four in the order of their size would be.

    Args:
        slip: Velocities or displacements.
        limit: Largest |x| + |y|; a number, or [n, 1].
        creeping: Friction per slip where it is slow.
    """
    part = 0.5 * creeping / limit * np.abs(slip)
    most, both = part.max(axis=1, keepdims=True), part.sum(axis=1, keepdims=True)
    level = np.minimum(np.minimum(1.0 - most, 0.5 * (1.0 - both)), (1.0 - most) / 3.0)
    level = np.minimum(level, 0.25)
    against, along = np.maximum(level + part, 0.0), np.maximum(level - part, 0.0)
    return np.asarray(-limit * np.sign(slip) * (against - along))
