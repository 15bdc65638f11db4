"""Directions spread evenly over a sphere."""

import math

import numpy as np

Array = np.ndarray


def spread_directions(count: int) -> Array:
    """Unit vectors [count, 3] spread evenly over all directions (Fibonacci sphere)."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    return np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1) * np.sqrt(
        1.0 - z * z
    ).reshape(-1, 1) + z.reshape(-1, 1) * np.array([0.0, 0.0, 1.0])
