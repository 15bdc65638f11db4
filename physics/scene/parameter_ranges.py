"""The allowed ranges of mass, friction, restitution and size: the only place that defines them."""

import math
from typing import Any, NamedTuple

import numpy as np

from physics.scene.validation import number

Array = np.ndarray


class Range(NamedTuple):
    """An interval of numbers, finite ones only.

    Attributes:
        low: smallest value.
        high: largest value.
        open_low: whether `low` itself is excluded.
    """

    low: float
    high: float = math.inf
    open_low: bool = False

    def number(self, field: str, value: Any) -> float:
        """`value` as a float in the range; raises TypeError or ValueError that names `field`."""
        return number(field, value, low=self.low, high=self.high, exclusive=self.open_low)

    def excludes(self, values: Array) -> Array:
        """Which of an array of values lie outside, [...] bools."""
        below = values <= self.low if self.open_low else values < self.low
        return np.asarray(below | (values > self.high))

    def __str__(self) -> str:
        """In words, for error messages."""
        words = f"{'above' if self.open_low else 'at least'} {self.low:g}"
        return words + (f" and at most {self.high:g}" if math.isfinite(self.high) else "")


RANGES = {
    "mass": Range(0.0, open_low=True),  # kg
    "friction": Range(0.0),  # Coulomb's coefficient
    "restitution": Range(0.0, 1.0),  # ratio of the normal speeds after and before an impact
    "size": Range(0.0, open_low=True),  # factor on every length of a body's shape
}
