"""Which solid an index or a name means, and the half-pairs through which two of them can touch."""

import numpy as np

from physics.analysis.diagnostics import between
from physics.model.tables import Model
from physics.scene.validation import choice, integer

Array = np.ndarray


class Solids:
    """The solids of a scene: bodies, then driven bodies, then statics, each in scene order."""

    def __init__(self, names: tuple[str, ...], model: Model) -> None:
        """`names`: of the solids; `model`: of the scene."""
        self._names, self._model = names, model
        self._between: dict[tuple[int, int], Array] = {}

    def index(self, field: str, value: int | str) -> int:
        """The index of a solid; `field` names the argument in errors.

        Raises:
            TypeError, ValueError: there is no such solid.
        """
        if isinstance(value, str):
            return self._names.index(choice(field, value, self._names))
        index = integer(field, value, low=0)
        last = len(self._names) - 1
        if index > last:
            raise ValueError(
                f"{field} must be the name or index of a solid, 0 to {last} (bodies, then drives, "
                f"then statics), got {value}"
            )
        return index

    def pair(self, first: int | str, second: int | str) -> tuple[int, int, Array]:
        """Indices of two solids that can touch, and the half-pairs [n] between them.

        Raises:
            TypeError, ValueError: there is no such solid; the two can't touch.
        """
        one, other = self.index("first", first), self.index("second", second)
        half_pairs = self._between.get((one, other))
        if half_pairs is None:
            half_pairs = np.flatnonzero(between(self._model, one, other))
            self._between[one, other] = half_pairs
        if not len(half_pairs):
            raise ValueError(
                f"first and second must be solids that can touch, got {self._names[one]!r} and "
                f"{self._names[other]!r}: a solid and itself, two statics, a gripper's fingers, "
                "bodies that a joint connects, and solids whose group and mask exclude each other "
                "can't"
            )
        return one, other, half_pairs
