"""Contacts: what is reported of touching points."""

from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray


class Contacts(NamedTuple):
    """Touching points of one world, n of them, in the world frame.

    Attributes:
        pair: [n, 2] indices of the two solids: bodies, then drives, then statics, in scene order.
        names: [n] names of the two solids, (first, second).
        point: [n, 3] m, within the overlap, see `contact_point`.
        normal: [n, 3] unit vector from the second solid to the first.
        penetration: [n] m; negative where solids collided up to half a step before they touch.
        force: [n, 3] N on the first solid; the second feels the opposite. A collision of the
            impulse law counts as its mean over the substep.
        first_touch: [n] s, when the two first touched since their state was last set.
    """

    pair: Array
    names: tuple[tuple[str, str], ...]
    point: Array
    normal: Array
    penetration: Array
    force: Array
    first_touch: Array


class ContactTable(NamedTuple):
    """Touching points of some worlds, n of them, in the world frame: what all readings come from.

    Attributes:
        world: [n] index.
        pair: [n, 2] indices of the two solids.
        point: [n, 3] m.
        normal: [n, 3] from the second solid to the first.
        penetration: [n] m.
        force: [n, 3] N on the first solid.
        first_touch: [n] s.
        weight: [n] part of the coefficients that belongs to the point.
        stiffness: [n] N/m, of the whole contact along the normal.
        kind: [n] row of `coefficients`.
        coefficients: of each kind of contact, by the names of HALF_PAIR; those of the first of the
            worlds, if their parameters differ.
    """

    world: Array
    pair: Array
    point: Array
    normal: Array
    penetration: Array
    force: Array
    first_touch: Array
    weight: Array
    stiffness: Array
    kind: Array
    coefficients: Any

    @classmethod
    def empty(cls) -> "ContactTable":
        """Nothing touches."""
        none, vectors, indices = np.zeros(0), np.zeros((0, 3)), np.zeros(0, dtype=int)
        pair = np.zeros((0, 2), dtype=int)
        return cls(indices, pair, vectors, vectors, none, vectors, none, none, none, indices, ())
