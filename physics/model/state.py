"""State: what changes, as arrays with a leading world axis."""

from functools import cache
from typing import NamedTuple

import numpy as np

from physics.jit import LANES, aligned_zeros, columns
from physics.model.features import Features
from physics.model.tables import Model

Array = np.ndarray

# one row a mover and world: bodies, then drives
MOVING = np.dtype(
    [
        ("position", "f8", (3,)),  # m
        ("orientation", "f8", (4,)),  # unit quaternion x y z w
        ("momentum", "f8", (3,)),  # kg m/s
        ("angular_momentum", "f8", (3,)),  # kg m^2/s about its own centre, world frame
        ("force", "f8", (3,)),  # N at the present position: the next half kick
        ("torque", "f8", (3,)),  # N m, likewise
        ("reference", "f8", (3,)),  # m, where a drive's servo pulls to
        ("reference_velocity", "f8", (3,)),  # m/s
    ],
    align=True,
)

# one row a side and world
FOUND = np.dtype(
    [
        ("count", "i8"),  # candidates
        ("travel", "f8"),  # m that they may still move apart before candidates are missing
        ("bore", "f8"),  # weight of the samples that touched in the last step, of springs
    ],
    align=True,
)

# what is asked of a side after every frame, by its place in State.touch; of springs the next step
# reads PRESSED too, with `bore`
PRESSED = 0  # N, sum of the normal forces of the last step
FIRST_TOUCH = 1  # s, NaN before
FIRST_POSITION = 2  # and the two behind it: m, where the pair's first solid was then

# one row a world
STATUS = np.dtype(
    [
        ("time", "f8"),  # s
        ("stale", "i4"),  # 1: set from outside, forces and candidates don't belong to it yet
        ("diverged", "i4"),  # 0, or 1 + index of the first non-finite mover
        ("overflow", "i8"),  # 1: a side had more candidates than room
    ],
    align=True,
)


@cache
def candidate_dtype(features: Features) -> np.dtype:
    """One row a slot: a candidate in each lane of a group, zeros where there is none."""
    fields = [
        ("sample", "f8", (3, LANES)),  # m, in the owner's frame
        ("weight", "f8", (LANES,)),
        # what a contact remembers
        ("load", "f8", (LANES,)),  # N, what pressed it in the last step
    ]
    if features.impulse:
        # N, mean force of an instantaneous collision in the last step, in the surface's frame
        fields.append(("blow", "f8", (3, LANES)))
    else:
        fields.append(("impact_speed", "f8", (LANES,)))  # m/s, see overlap_force
        fields.append(("approach", "f8", (LANES,)))  # m/s, in the last step
    if features.friction and not features.viscous:
        fields.append(("shear", "f8", (3, LANES)))  # m
        if features.impulse:
            fields.append(("pull", "f8", (3, LANES)))  # N, of friction, in the surface's frame
    if features.resistance:
        # of springs rad, how far it has been turned; of impulses N m, the torque of the last step
        fields.append(("twist", "f8", (3, LANES)))
    if features.box:
        fields.append(("face", "f8", (LANES,)))  # by which it came into a box, see box_distance
    if features.box and features.compound:
        # m that a box's faces across each axis count as farther out, see stages/parts.py
        fields.append(("cover", "f8", (3, LANES)))
    if features.particles:
        fields.append(("partner", "f8", (3, LANES)))  # m, particle of the surface
    return np.dtype(fields, align=True)


class State(NamedTuple):
    """What changes.

    Attributes:
        mover: [w, m] of MOVING.
        side: [w, k] of FOUND.
        touch: [k, 5, w or a little more], see PRESSED: columns over the worlds.
        world: [w] of STATUS.
        sample_id: [groups, slots, LANES] of each candidate; LANES worlds make a group.
        candidate: [groups, slots] of candidate_dtype.
    """

    mover: Array
    side: Array
    touch: Array
    world: Array
    sample_id: Array
    candidate: Array

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self)


def allocate(model: Model, features: Features, count: int) -> State:
    """State arrays of `count` worlds, at rest at the origin and stale."""
    slots = int(model.side["slot_count"].sum())
    groups = -(-count // LANES)
    state = State(
        mover=np.zeros((count, len(model.mover)), dtype=MOVING),
        side=np.zeros((count, len(model.side)), dtype=FOUND),
        touch=columns((len(model.side), 5), count, float),
        world=np.zeros(count, dtype=STATUS),
        sample_id=np.zeros((groups, slots, LANES), dtype=np.int32),
        candidate=aligned_zeros((groups, slots), candidate_dtype(features)),
    )
    state.mover["orientation"][..., 3] = 1.0
    state.side["travel"] = -1.0
    state.touch[...] = 0.0
    state.touch[:, FIRST_TOUCH] = np.nan
    state.world["stale"] = 1
    return state


def copy(state: State) -> State:
    """A deep copy."""
    return State(*(array.copy() for array in state))
