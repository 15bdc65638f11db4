"""The next object: the first of several that isn't at its goal yet.

A tower is built from the bottom, and what the hand does depends on the next object alone. A network
would have to learn for each object how it is grasped, and products of "it is next" and what it
sees of it. So a layer writes one block for each object, and only that of the next one passes.
"""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class NextObject:
    """Blocks of equal size at the end of a layer's outputs, one for each object.

    A block begins with the offset of its object from its goal.
    """

    count: int
    """Number of objects, at least 2."""
    size: int
    """Outputs in a block."""
    goal: int
    """The first of them that are the offset."""
    within: float
    """Distance from its goal up to which an object is at it, in the unit of the offset."""


def pass_next(x: Any, objects: NextObject) -> Any:
    """Sets the blocks of all objects but the next one to 0, in place.

    The next object is the first that is farther than `within` from its goal, and the last object if
    there is none.

    Args:
        x: [n, outputs] array or tensor.
        objects: The blocks at the end of the outputs.
    """
    waiting: Any = 1.0  # where all objects so far are at their goals
    for left in range(objects.count, 0, -1):
        stop = x.shape[1] - (left - 1) * objects.size
        block = x[:, stop - objects.size : stop]
        far: Any = ((block[:, : objects.goal] ** 2).sum(1) > objects.within**2) * 1.0
        block *= (waiting * far if left > 1 else waiting)[:, None]
        waiting = waiting * (1.0 - far)
    return x
