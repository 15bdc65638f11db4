"""Components of a vector, as settings list them."""

import re
from collections.abc import Sequence

from training.settings.errors import UsageError

SLICE = re.compile(r"(-?\d+)?:(-?\d+)?(:[1-9]\d*)?")
"""A slice of indices: start, stop and step, each of which may be missing, as in "0:-1:3"."""


def component_indices(
    name: str, listed: Sequence[int | str], size: int, vector: str = "observation"
) -> list[int]:
    """The listed components of a vector, counted from 0.

    Args:
        name: Setting, for messages.
        listed: Indices, -1 being the last component, and slices such as "0:-1:3".
        size: Size of the vector.
        vector: What the vector is, for messages.

    Raises:
        UsageError: There is no such component, or it is listed twice.
    """
    found: list[int] = []
    for entry in listed:
        if isinstance(entry, str):
            bounds = [int(bound) if bound else None for bound in entry.split(":")]
            chosen = list(range(size))[slice(*bounds)]
            valid = bool(chosen) and all(-size <= (b or 0) <= size for b in bounds[:2])
        else:
            chosen, valid = [entry % size], -size <= entry < size
        if not valid:
            raise UsageError(
                f"{name}: {entry} in {list(listed)}, should be one or more components of the "
                f"{vector}, {-size} to {size - 1}"
            )
        found += chosen
    for component in found:
        if found.count(component) > 1:
            raise UsageError(
                f"{name}: {list(listed)} lists component {component} of the {vector} twice"
            )
    return found
