"""Which solid an index or a name means."""

from collections.abc import Callable

from physics.scene.validation import choice, integer


class Solids:
    """The solids of a scene: bodies, then driven bodies, then statics, each in scene order."""

    def __init__(self, names: tuple[str, ...], can_touch: Callable[[int, int], bool]) -> None:
        """`names`: of the solids; `can_touch`: whether two of them can."""
        self._names, self._can_touch = names, can_touch
        self._pairs: dict[tuple[int | str, int | str], tuple[int, int]] = {}

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

    def pair(self, first: int | str, second: int | str) -> tuple[int, int]:
        """Indices of two solids that can touch.

        Raises:
            TypeError, ValueError: there is no such solid; the two can't touch.
        """
        known = self._pairs.get((first, second))
        if known is not None and type(first) in (int, str) and type(second) in (int, str):
            return known
        one, other = self.index("first", first), self.index("second", second)
        if not self._can_touch(one, other):
            raise ValueError(
                f"first and second must be solids that can touch, got {self._names[one]!r} and "
                f"{self._names[other]!r}: a solid and itself, two statics, a gripper's fingers, "
                "bodies that a joint connects, and solids whose group and mask exclude each other "
                "can't"
            )
        self._pairs[first, second] = one, other
        return one, other
