"""Reflections of vectors: some components change sign, and some change places."""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import torch

from training.settings.errors import UsageError

Entry = int | str | Sequence[int]
"""An index, -1 being the last component; a slice such as "0:-1:3"; or a pair of indices."""


class Images(NamedTuple):
    """How the images of a vector [n] follow from it, for each of k combinations of reflections.

    The image of x has components sign[c, i] x[source[c, i]].

    Attributes:
        source: [k, n] indices.
        sign: [k, n] ±1.
    """

    source: torch.Tensor
    sign: torch.Tensor

    def after(self, other: "Images") -> "Images":
        """Images of the images that `other` makes."""
        sign = self.sign * torch.gather(other.sign.expand_as(self.sign), 1, self.source)
        source = torch.gather(other.source.expand_as(self.source), 1, self.source)
        return Images(source, sign)

    def same_as(self, other: "Images") -> bool:
        """Whether both make the same images."""
        return torch.equal(self.source, other.source) and torch.equal(self.sign, other.sign)


def unchanged(n: int) -> Images:
    """The one image [1, n] of a vector that no reflection changes."""
    return Images(torch.arange(n)[None], torch.ones(1, n))


def reflection(entries: Sequence[Entry], size: int, vector: str) -> Images:
    """The image [1, size] in one mirror.

    Args:
        entries: Components that change sign, as indices or slices; and pairs [a, b] that change
            places. A component in both changes its sign, too.
        size: Size of the vector.
        vector: Name of the vector, for messages.

    Raises:
        UsageError: There is no such component, or two reflections do not give the vector back.
    """
    found, name = unchanged(size), vector.replace("_", " ")
    for entry in entries:
        if isinstance(entry, int | str):
            found.sign[0, component_indices("mirrors", [entry], size, name)] *= -1.0
        else:
            pair = component_indices("mirrors", entry, size, name)
            found.source[0, pair] = found.source[0, pair[::-1]]
    if not found.after(found).same_as(unchanged(size)):
        raise UsageError(
            f"mirrors: {list(entries)} of the {name} does not give it back when it is mirrored "
            "twice: both components of a pair should change sign, or none"
        )
    return found


def combinations(mirrors: Sequence[Images]) -> Images:
    """The images in all combinations of mirrors, the first of which uses none.

    Args:
        mirrors: The image in each mirror, of the same vector.

    Raises:
        UsageError: The order of two reflections matters.
    """
    for one, other in product(mirrors, repeat=2):
        if not one.after(other).same_as(other.after(one)):
            raise UsageError("mirrors: the images of two mirrors depend on their order")
    found = []
    for used in product((False, True), repeat=len(mirrors)):
        image = unchanged(mirrors[0].source.shape[1])
        for mirror, use in zip(mirrors, used, strict=True):
            image = mirror.after(image) if use else image
        found.append(image)
    return Images(*(torch.cat(parts) for parts in zip(*found, strict=True)))


def unit_images(mirrors: int, n: int) -> Images:
    """Images of n hidden units in groups of one for each combination of mirrors.

    Raises:
        UsageError: n is not a multiple of the number of combinations.
    """
    size = 2**mirrors
    if n % size:
        raise UsageError(
            f"net_arch has a layer of {n} units, should have multiples of {size} with {mirrors} "
            "mirrors"
        )
    unit = torch.arange(n)
    member, group = unit // (n // size), unit % (n // size)
    rows = [(member ^ used) * (n // size) + group for used in range(size)]
    return Images(torch.stack(rows), torch.ones(size, n))


def component_indices(
    name: str, indices: Sequence[int | str], size: int, vector: str = "observation"
) -> list[int]:
    """Which components of a vector of this size are meant, counted from 0.

    Args:
        name: Setting, for the message.
        indices: Indices, -1 being the last component, and slices such as "0:-1:3".
        size: Size of the vector.
        vector: What the vector is, for the message.

    Raises:
        UsageError: There is no such component.
    """
    found: list[int] = []
    for index in indices:
        if isinstance(index, str):
            bounds = [int(bound) if bound else None for bound in index.split(":")]
            found += range(size)[slice(*bounds)]
        elif -size <= index < size:
            found.append(index % size)
        else:
            raise UsageError(
                f"{name}: {index} in {list(indices)}, should be a component of the {vector}, "
                f"{-size} to {size - 1}"
            )
    return found
