"""The constants of a scene at a fidelity: one table per kind of thing, with named columns."""

from typing import NamedTuple

import numpy as np

from physics.jit import LANES

Array = np.ndarray


# one row a mover: bodies, then drives. A drive has no inertia: it never turns
MOVER = np.dtype(
    [
        ("turns", "i8"),  # 1 for a body, 0 for a drive
        ("core_reach", "f8"),  # m, farthest point from the centre that turning moves
        ("inverse_mass", "f8"),  # 1/kg
        ("inertia", "f8", (3,)),  # kg m^2, principal moments; infinite for drives
        ("inverse_inertia", "f8", (3,)),  # 1/(kg m^2); 0 for drives
        ("weight", "f8", (3,)),  # N; 0 for drives, whose carriage carries them
        ("servo_stiffness", "f8"),  # N/m
        ("servo_damping", "f8"),  # N s/m
        ("force_limit", "f8"),  # N along each axis
        ("twin", "i8"),  # the other finger of a gripper, or -1
        ("grip_limit", "f8"),  # N between the two
    ],
    align=True,
)


# one row a side: the samples of an owner against the surface of another solid
SIDE = np.dtype(
    [
        ("owner", "i8"),  # solid that carries the samples
        ("surface", "i8"),  # solid whose surface they meet
        ("frame", "i8"),  # row of Work.solid in whose frame that surface lies
        ("kind", "i8"),  # of that surface
        ("mirror", "i8"),  # the side of the same pair the other way round, or -1
        ("next", "i8"),  # the next side of the same pair, after the last the first
        ("first_sample", "i8"),  # into Model.sample
        ("sample_count", "i8"),
        ("extent", "f8", (3,)),  # m at size 1, of the samples along the axes of the owner's frame
        ("first_partner", "i8"),  # likewise, the particles of a particle surface
        ("partner_count", "i8"),
        ("first_slot", "i8"),  # room for candidates
        ("slot_count", "i8"),
        ("sharp", "i8"),  # 1: corners and edges of a box, which faces push out
        ("core", "f8", (3,)),  # m, parameters of the surface's core
        ("owner_radius", "f8"),  # m, of the samples
        ("radius", "f8"),  # m, of the samples and the surface's rounding together
        ("owner_reach", "f8"),  # m
        ("surface_reach", "f8"),  # m
        ("owner_size", "f8"),  # factor of the samples' positions
        ("surface_size", "f8"),  # likewise of the partners'
        ("share", "f8"),  # of the pair's load, factor of the samples' weights
        ("skin", "f8"),  # m
        ("stiffness", "f8"),  # N/m of a whole face
        ("damping", "f8"),  # the law's coefficient
        ("restitution", "f8"),
        ("rest_speed", "f8"),  # m/s, floor of the impact speed
        ("pair_mass", "f8"),  # kg, reduced mass
        ("owner_inverse_mass", "f8"),  # 1/kg
        ("surface_inverse_mass", "f8"),  # 1/kg; 0 for statics
        ("surface_centre", "f8", (3,)),  # m, centre of mass of the surface's solid, in its frame
        ("yielding", "f8", (3,)),  # 1/(kg m^2), how easily that solid turns, where it counts
        ("shear_stiffness", "f8"),  # N/m
        ("shear_damping", "f8"),  # N s/m
        ("friction", "f8"),
        ("rolling", "f8"),  # m, of the resistance against it
        ("spinning", "f8"),  # m, likewise
        ("twist_stiffness", "f8"),  # N m
        ("twist_damping", "f8"),  # N m s
    ],
    align=True,
)


# one row a part of a compound that has a surface of its own
PART = np.dtype(
    [
        ("solid", "i8"),  # that it belongs to
        ("position", "f8", (3,)),  # m, of its centre in that solid's frame
        ("rotation", "f8", (9,)),  # matrix, row by row: its own frame to that solid's
        ("first_cover", "i8"),  # into Model.cover
        ("cover_count", "i8"),
    ],
    align=True,
)


# one row a rectangle of a part's face that another hides, see `seams.Cover`
COVER = np.dtype(
    [
        ("axis", "i8"),
        ("sign", "f8"),
        ("face", "f8"),  # m at size 1, as the others
        ("low", "f8", (2,)),
        ("high", "f8", (2,)),
    ],
    align=True,
)


# what differs where worlds are varied
MOVER_VARIES = ("core_reach", "inverse_mass", "inertia", "inverse_inertia", "weight")


SIDE_VARIES = (
    "core",
    "owner_radius",
    "radius",
    "owner_reach",
    "surface_reach",
    "owner_size",
    "surface_size",
    "share",
    "skin",
    "stiffness",
    "damping",
    "restitution",
    "rest_speed",
    "pair_mass",
    "owner_inverse_mass",
    "surface_inverse_mass",
    "surface_centre",
    "yielding",
    "shear_stiffness",
    "shear_damping",
    "friction",
    "twist_stiffness",
    "twist_damping",
)


PART_VARIES = ("position",)


class Model(NamedTuple):
    """The constants of a scene.

    Attributes:
        mover: [m] of MOVER; of varied worlds [groups, m], with a value a lane of MOVER_VARIES.
        side: [k] of SIDE; of varied worlds [groups, k], with a value a lane of SIDE_VARIES.
        part: [q] of PART; of varied worlds [groups, q], with a value a lane of PART_VARIES.
        cover: [c] of COVER.
        static: [s, 7] position m and quaternion x y z w of the statics.
        sample: [4, p] x y z in m in the owner's frame at size 1, and weight.
    """

    mover: Array
    side: Array
    part: Array
    cover: Array
    static: Array
    sample: Array

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays: once for all worlds."""
        return sum(array.nbytes for array in self)

    def of_world(self, world: int) -> "Model":
        """The model of one world, by itself."""
        if self.mover.ndim == 1:
            return self
        group, lane = divmod(world, LANES)
        tables = []
        for table, dtype, fields in (
            (self.mover, MOVER, MOVER_VARIES),
            (self.side, SIDE, SIDE_VARIES),
            (self.part, PART, PART_VARIES),
        ):
            rows = np.zeros(table.shape[1], dtype=dtype)
            for name in dtype.names or ():
                values = table[name][group]
                rows[name] = values[..., lane] if name in fields else values
            tables.append(rows)
        return self._replace(mover=tables[0], side=tables[1], part=tables[2])

    def of_group(self, group: int) -> "Model":
        """The model of one group of worlds, as the kernels take it."""
        if self.mover.ndim == 1:
            return self
        alone = slice(group, group + 1)
        return self._replace(mover=self.mover[alone], side=self.side[alone], part=self.part[alone])
