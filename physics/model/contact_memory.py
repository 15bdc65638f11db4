"""What a contact remembers from step to step: one record, described once.

Every candidate has `size` doubles of memory per lane, as rows of an array [size, LANES]. Which rows
exist depends on the features of the scene; `ContactMemory` gives the first row of each quantity.
Kernels that copy or clear a memory treat it as a block and need not know what is in it.
"""

from typing import NamedTuple

from physics.model.features import Features, cached_by_features

ROWS = {
    "normal_force": 1, "impact_speed": 1, "approach": 1, "shear": 3, "tangential_force": 3,
    "twist": 3, "face": 1, "separation": 1, "bend": 1,
}  # fmt: skip


class ContactMemory(NamedTuple):
    """First row of each quantity, -1 where the scene has none; and the number of rows.

    Attributes:
        size: rows in all.
        normal_force: 1 row, N, of the last step.
        impact_speed: 1 row, m/s, see `hunt_crossley_force`. Spring law.
        approach: 1 row, m/s, in the last step.
        shear: 3 rows. Spring law: N, force of the tangential spring. Impulse law: m, of the anchor.
        tangential_force: 3 rows, N, of the last step, in the surface's frame. Impulse law.
        twist: 3 rows. Spring law: N m, of the spring against rolling and spinning. Impulse law:
            N m, torque of the last step.
        face: 1 row, the face of a box or cylinder through which the sample came in, see
            `box_distance`.
        separation: 1 row, m, of the last step; 0: not known. Impulse law.
        bend: 1 row, m/s, see `impulse.contact_rows`. Impulse law.
    """

    size: int
    normal_force: int = -1
    impact_speed: int = -1
    approach: int = -1
    shear: int = -1
    tangential_force: int = -1
    twist: int = -1
    face: int = -1
    separation: int = -1
    bend: int = -1


@cached_by_features
def contact_memory(features: Features) -> ContactMemory:
    """The memory that contacts of a scene with these features have."""
    coulomb = features.friction and not features.viscous
    present = {
        "normal_force": True,
        "impact_speed": not features.impulse,
        "approach": True,
        "shear": coulomb,
        "tangential_force": coulomb and features.impulse,
        "twist": features.resistance,
        "face": features.box or features.cylinder,
        "separation": features.impulse,
        "bend": features.impulse,
    }
    size, first = 0, {}
    for name, rows in ROWS.items():
        if present[name]:
            first[name] = size
            size += rows
    return ContactMemory(size, **first)
