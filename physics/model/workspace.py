"""Working memory of the kernels: sixteen worlds side by side, one per vector lane."""

from typing import NamedTuple

import numpy as np

from physics.jit import LANES, aligned_zeros
from physics.model.features import Features
from physics.model.tables import Model

Array = np.ndarray


# one row a solid: movers, statics, and parts of compounds, of which the stages know only where they
# are and how they move; what the stages read and write in a substep
SOLID = np.dtype(
    [
        ("position", "f8", (3, LANES)),  # m
        ("orientation", "f8", (4, LANES)),
        ("momentum", "f8", (3, LANES)),  # kg m/s
        ("angular_momentum", "f8", (3, LANES)),  # kg m^2/s
        ("force", "f8", (3, LANES)),  # N
        ("torque", "f8", (3, LANES)),  # N m
        ("reference", "f8", (3, LANES)),  # m
        ("reference_velocity", "f8", (3, LANES)),  # m/s
        ("rotation", "f8", (9, LANES)),  # matrix, row by row: body frame to world frame
        ("velocity", "f8", (3, LANES)),  # m/s
        ("spin", "f8", (3, LANES)),  # rad/s
        # of the last drift
        ("shift", "f8", (3, LANES)),  # m
        ("swing", "f8", (LANES,)),  # m that turning has moved a point at most
        # of the side at work
        ("pressed", "f8", (LANES,)),  # N, sum of normal forces
        ("bearing", "f8", (LANES,)),  # sum of the weights that touch
        ("mass_rate", "f8", (LANES,)),  # kg/s, see begin_side
        ("per_mean", "f8", (LANES,)),  # 1/N, likewise
        ("lasts", "f8", (LANES,)),  # 1 where contacts keep what they have become, see begin_side
    ],
    align=True,
)


# one row a side
MEETING = np.dtype(
    [
        ("count", "i8", (LANES,)),  # candidates
        ("travel", "f8", (LANES,)),  # m that they may still move apart before some are missing
        ("path", "f8", (LANES,)),  # m that they have done so at most in the last drift
        ("first_touch", "f8", (LANES,)),  # s, NaN before
        ("pressed", "f8", (LANES,)),  # N, sum of the normal forces of the last step
        # of springs: weight that touched in the last step, and in this one; and the N of this one
        ("bore", "f8", (LANES,)),
        ("bearing", "f8", (LANES,)),
        ("presses", "f8", (LANES,)),
        ("slots", "i8"),  # the largest count
    ],
    align=True,
)


# one row a candidate of an old list
REMEMBERED = np.dtype(
    [
        ("sample_id", "i8"),
        ("impact_speed", "f8"),
        ("load", "f8"),
        ("approach", "f8"),
        ("shear", "f8", (3,)),
        ("pull", "f8", (3,)),
        ("twist", "f8", (3,)),
        ("face", "f8"),
    ],
    align=True,
)


# one row a candidate of a pair of sides, while four of them are chosen
NEAR = np.dtype(
    [
        ("position", "f8", (3,)),  # m, in the world, as the others
        ("normal", "f8", (3,)),  # out of the surface of the pair's first side
        ("gap", "f8"),  # m
        ("weight", "f8"),
        ("group", "i8"),  # of those that touch with the same face, 0 before
        ("chosen", "i8"),
    ],
    align=True,
)


# one row a slot
POINT = np.dtype(
    [
        ("normal", "f8", (3, LANES)),  # out of the surface
        ("arm", "f8", (3, LANES)),  # m, from the owner's centre
        ("surface_arm", "f8", (3, LANES)),  # m, from the surface's centre
        ("gap", "f8", (LANES,)),  # m, negative if they overlap
        ("weight", "f8", (LANES,)),
        ("mass", "f8", (LANES,)),  # kg that an impulse along the normal feels
        ("shear_mass", "f8", (LANES,)),  # kg, the least that one across it feels
        ("push", "f8", (LANES,)),  # N s along the normal
        ("pull", "f8", (3, LANES)),  # N s across it
        ("twist", "f8", (3, LANES)),  # N m s against rolling and spinning
        ("turned", "f8", (3, LANES)),  # N m s given in this step beyond twist
        ("anchor", "f8", (3, LANES)),  # m, how far the point has left where it came to stick
        ("spent", "f8", (3, LANES)),  # N s given in this step beyond push and pull
        ("bounce", "f8", (LANES,)),  # restitution of an instantaneous collision, -1 if none
        ("hit", "f8", (LANES,)),  # N s along the normal, of that collision
        ("skid", "f8", (3, LANES)),  # N s across it, likewise
    ],
    align=True,
)


# one row a solid
TENSOR = np.dtype([("entry", "f8", (6, LANES))], align=True)  # 1/(kg m^2): xx yy zz xy xz yz


# one row in all
LANE = np.dtype(
    [
        ("active", "i8", (LANES,)),  # 0: no world, or one that has diverged or isn't advanced
        ("stale", "i8", (LANES,)),
        ("keeps", "i8", (LANES,)),  # 1: contacts remember this step
        ("start", "f8", (LANES,)),  # s, time at which this call began
        # of instantaneous collisions, see stages/impacts.py
        ("struck", "i8", (LANES,)),
        ("going", "i8", (LANES,)),  # 1: rounds aren't over
        ("speed", "f8", (LANES,)),  # m/s, fastest approach
        ("change", "f8", (LANES,)),  # m/s, largest of a round
        ("bounce", "f8", (LANES,)),  # largest restitution
        ("work", "f8", (LANES,)),  # J, of all impulses
        ("allowed", "f8", (LANES,)),  # J, of restitution
        ("share", "f8", (LANES,)),  # of restitution that this allows
    ],
    align=True,
)


class Work(NamedTuple):
    """Working arrays of one call of a kernel, shared by no two threads.

    Attributes:
        solid: [solids and parts] of SOLID.
        relative: [2] of SOLID: the owner of a side, in the frame of the surface that it meets;
            and while a pair is searched, the other way round.
        side: [sides] of MEETING.
        lane: [1] of LANE.
        old: [longest list of candidates] of REMEMBERED.
        gap: [most samples of a side] m, of one while it is searched.
        tensor: [solids] of TENSOR, inverse inertia in the world frame; of the impulse law.
        point: [slots] of POINT, likewise.
        near: [two longest lists] of NEAR, likewise.
    """

    solid: Array
    relative: Array
    side: Array
    lane: Array
    old: Array
    gap: Array
    tensor: Array
    point: Array
    near: Array

    @classmethod
    def of(cls, model: Model, features: Features) -> "Work":
        """Working arrays for a model."""
        longest = int(model.side["slot_count"].max(initial=0))
        solids = len(model.mover) + len(model.static)
        slots = int(model.side["slot_count"].sum())
        return cls(
            solid=aligned_zeros(solids + len(model.part), SOLID),
            relative=aligned_zeros(2, SOLID),
            side=aligned_zeros(len(model.side), MEETING),
            lane=aligned_zeros(1, LANE),
            old=np.zeros(longest, REMEMBERED),
            gap=np.zeros(int(model.side["sample_count"].max(initial=0))),
            tensor=aligned_zeros(solids if features.impulse else 0, TENSOR),
            point=aligned_zeros(slots if features.impulse else 0, POINT),
            near=np.zeros(2 * longest if features.impulse else 0, NEAR),
        )
