"""Reflections of vectors: some components change sign, and some change places."""

from collections.abc import Sequence
from itertools import combinations, product
from typing import NamedTuple

import torch

from training.settings.components import component_indices
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
        """Images [k, n] of the image [1, n], or of each of the images [k, n], of `other`."""
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
    """The image [1, size] of a vector in one mirror.

    Args:
        entries: Components that change sign, as indices or slices; and pairs [a, b] that change
            places. A component in both changes its sign, too.
        size: Size of the vector.
        vector: Name of the vector, for messages.

    Raises:
        UsageError: There is no such component, it is listed twice, or two reflections do not give
            the vector back.
    """
    found, name = unchanged(size), vector.replace("_", " ")
    signs = [entry for entry in entries if isinstance(entry, int | str)]
    pairs = [entry for entry in entries if not isinstance(entry, int | str)]
    found.sign[0, component_indices("mirrors", signs, size, name)] = -1.0
    swapped = component_indices("mirrors", [one for pair in pairs for one in pair], size, name)
    for a, b in zip(swapped[::2], swapped[1::2], strict=True):
        found.source[0, [a, b]] = torch.tensor([b, a])
    if not found.after(found).same_as(unchanged(size)):
        raise UsageError(
            f"mirrors: {list(entries)} of the {name} does not give it back when it is mirrored "
            "twice: both components of a pair should change sign, or none"
        )
    return found


def all_combinations(mirrors: Sequence[Images], vector: str) -> Images:
    """The images [2^m, n] of a vector in all combinations of m mirrors, the first without any.

    Args:
        mirrors: The image [1, n] in each mirror.
        vector: Name of the vector, for messages.

    Raises:
        UsageError: The order of two reflections matters.
    """
    for (i, one), (j, other) in combinations(enumerate(mirrors), 2):
        if not one.after(other).same_as(other.after(one)):
            raise UsageError(
                f"mirrors: the image of the {vector} in mirrors {i} and {j} depends on their order"
            )
    found = []
    for used in product((False, True), repeat=len(mirrors)):
        image = unchanged(mirrors[0].source.shape[1])
        for mirror, use in zip(mirrors, used, strict=True):
            image = mirror.after(image) if use else image
        found.append(image)
    return Images(*(torch.cat(parts) for parts in zip(*found, strict=True)))


def unit_images(mirrors: int, n: int) -> Images:
    """Images [2^m, n] of hidden units in groups of 2^m, which reflections permute.

    Args:
        mirrors: Number m of mirrors.
        n: Number of units.

    Raises:
        UsageError: n is not a multiple of 2^m.
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
