"""Starts that differ between worlds; they are repeated if there are more worlds than starts."""

from typing import Any

import numpy as np

from benchmarks.trade.trial import Worlds

Array = np.ndarray


def tiled(values: Any, count: int) -> Array:
    """Values [n, 3] of one body as an array [count, 1, 3]."""
    values = np.asarray(values, dtype=float)
    return np.resize(values, (count, *values.shape[1:]))[:, None]


def along_x(speeds: Any) -> Any:
    """Function that gives body 0 of every world its speed along x, in m/s."""

    def begin(worlds: Worlds) -> None:
        velocity = np.zeros((len(speeds), 3))
        velocity[:, 0] = speeds
        worlds.set_state(linear_velocity=tiled(velocity, worlds.count))

    return begin


def phases(count: int) -> Array:
    """[count] fractions spread evenly over 0 to 1, whatever step divides them."""
    return np.arange(count) * 0.6180339887498949 % 1.0
