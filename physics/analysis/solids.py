"""Which solid an index means, and through which sides two of them can meet."""

import numpy as np

from physics.analysis.diagnostics import between
from physics.model.tables import Model
from physics.scene.validation import integer

Array = np.ndarray


class Solids:
    """The solids of a scene: bodies, then tools, then statics, each in scene order."""

    def __init__(self, model: Model) -> None:
        """`model`: of the scene."""
        self._model = model
        self._between: dict[tuple[int, int], Array] = {}

    def index(self, field: str, value: int) -> int:
        """The index of a solid; `field` names the argument in errors."""
        index = integer(field, value, low=0)
        last = len(self._model.mover) + len(self._model.static) - 1
        if index > last:
            raise ValueError(
                f"{field} must be the index of a solid, 0 to {last} (bodies, then tools, then "
                f"statics), got {value}"
            )
        return index

    def pair(self, first: int, second: int) -> tuple[int, int, Array]:
        """Two solids that can meet, and the sides [n] between them."""
        if (first, second) in self._between:
            return first, second, self._between[first, second]
        ends = self.index("first", first), self.index("second", second)
        sides = np.flatnonzero(between(self._model, *ends))
        if not len(sides):
            raise ValueError(
                f"first and second must be solids that can meet, got {ends[0]} and {ends[1]}: "
                "one solid, two statics, or the fingers of a gripper never do"
            )
        self._between[ends] = sides
        return *ends, sides
