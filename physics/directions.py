"""Directions spread evenly over a sphere."""

import math

import numpy as np

Array = np.ndarray


def spread_directions(count: int) -> Array:
    """Unit vectors [count, 3] spread evenly over all directions (Fibonacci sphere)."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)
