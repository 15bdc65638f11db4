"""Contacts: what is reported of the touching points of one world."""

from typing import NamedTuple

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
