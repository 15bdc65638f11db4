"""Arrays of one world of many bodies.

A *place* is a row of `Crowd.frame`: bodies come first, in blocks of LANES, then the statics. A
*pair batch* holds LANES pairs of solids of the same kind side by side; its half-pairs are those of
a scene of two solids, so the stages of a lane group work on it unchanged.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from physics.compiler.jit import LANES, aligned_zeros
from physics.model.features import Features
from physics.model.state import candidate_dtype
from physics.model.workspace import HALF_PAIR_WORK, TIMING

Array = np.ndarray

# one row per kind of pair: of two kinds of solids that can touch
PAIR_KIND = np.dtype(
    [
        ("first_half_pair", "i8"),  # into Model.half_pair
        ("half_pair_count", "i8"),
        ("slot_count", "i8"),  # of all its half-pairs
        ("first_part", "i8"),  # into Model.compound_part
        ("part_count", "i8"),
        ("first_dynamic", "i8"),  # into Model.dynamic: a row for each of the two solids
    ],
    align=True,
)

# one row per body group: mechanisms of the same structure side by side, one per lane, or bodies
# that nothing couples
BODY_GROUP = np.dtype(
    [
        ("first_block", "i8"),  # into Crowd.solid and Crowd.constants
        ("block_count", "i8"),  # bodies of a mechanism
        ("solid_count", "i8"),  # these, and with joints the world
        ("first_joint", "i8"),  # into Model.joint_row and Crowd.joint
        ("joint_count", "i8"),
        ("first_entry", "i8"),  # into Crowd.joint_factor
        ("entry_count", "i8"),
        ("first_field", "i8"),  # into Model.field
        ("field_count", "i8"),
        ("gripper", "i8"),  # 1: two of the solids are the fingers of a gripper
    ],
    align=True,
)

# columns of Crowd.frame
POSITION, ROTATION, VELOCITY, ANGULAR_VELOCITY = 0, 3, 12, 15
DISPLACEMENT, ROTATION_BOUND, FRAME_WIDTH = 18, 21, 24

# of Crowd.path: s since the substep began, impacts so far, 1: what touches there has collided
TIME, IMPACTS, AGAIN = range(3)

# largest number of colours; pairs that find none free are solved one after the other
MOST_COLOURS = 63


class Pairs(NamedTuple):
    """The pairs of solids that are near each other, by their batch and lane.

    Attributes:
        kind: [batches] row of PAIR_KIND.
        colour: [batches]; pairs of the same colour share no body. Impulse law; else 0.
        first: [batches, LANES] place of a pair's first solid, -1 in a free lane.
        second: likewise.
        first_slot: [batches] into `candidate`.
        first_work: [batches] into `work`.
        candidate: [1, slots] of candidate_dtype.
        sample_id: [1, slots, LANES] of each candidate.
        work: [half-pairs of all batches] of HALF_PAIR_WORK.
        wrench: [batches, LANES, 12] N and N m: force and torque on the first solid, then on the
            second, about their centres.
        busy: [batches] 1: some lists aren't empty.
        first_row: [batches] into the contact rows; impulse law, as all below.
        row_count: [batches].
        colliding: [batches, LANES] 1: a pair collides in this substep.
        impact_work: [batches, LANES] J, of its impact impulses.
        timing: [half-pairs of all batches] of TIMING; time control.
    """

    kind: Array
    colour: Array
    first: Array
    second: Array
    first_slot: Array
    first_work: Array
    candidate: Array
    sample_id: Array
    work: Array
    wrench: Array
    busy: Array
    first_row: Array
    row_count: Array
    colliding: Array
    impact_work: Array
    timing: Array


class Crowd(NamedTuple):
    """One world of many bodies.

    A block is LANES dynamic bodies side by side. The blocks of a group are coupled, lane by lane.

    Attributes:
        constants: [blocks] of DYNAMIC, a value per lane.
        solid: [blocks] of SOLID.
        group: [groups] of BODY_GROUP.
        present: [groups, LANES] 1: the lane holds bodies of the scene; 0: a copy of other ones.
        body: [blocks * LANES] dynamic body at each place, or the one that is copied; -1: none.
        place: [dynamic bodies] the reverse.
        joint: [rows of joints] of JOINT_WORK.
        joint_factor: [entries, LANES].
        motor: [groups * LANES, most motors, 2] see `State.motor`.
        frame: [places, FRAME_WIDTH] of each solid side by side: position, rotation matrix,
            velocity, angular velocity, and displacement and rotation bound of the last drift.
        tensor: [places, 8] inverse inertia in the world frame: xx yy zz xy xz yz; impulse law.
        normals: [places, NORMAL_SUMS] over what each body touched in the last step, see
            `spring.mass_splitting`: n n^T as xx yy zz xy xz yz, loads of friction; spring law.
        margin: [blocks, LANES] m that a body may move before pairs are searched again.
        motion: [blocks, LANES] m that it has moved since, at most.
        wrench: [blocks * LANES, 6] N and N m from the user.
        incident_first: [blocks * LANES + 1] into `incident`.
        incident: of each body's pairs twice the home, plus 1 where it is the second solid; a home
            is the batch times LANES plus the lane.
        order: [batches] in use, by colour.
        colour_first: [MOST_COLOURS + 2] into `order`.
        pair_kind: [kinds] of PAIR_KIND.
        stirred: [blocks * LANES] when an impact last changed a body's velocity; impulse law.
        joint_work: [groups] J, of the joints' impulses in a collision; impulse law.
        kept: [4, blocks] of SOLID, see `Workspace.kept`; time control.
        path: [3] how far the way through a substep has been followed, see TIME.
    """

    constants: Array
    solid: Array
    group: Array
    present: Array
    body: Array
    place: Array
    joint: Array
    joint_factor: Array
    motor: Array
    frame: Array
    tensor: Array
    normals: Array
    margin: Array
    motion: Array
    wrench: Array
    incident_first: Array
    incident: Array
    order: Array
    colour_first: Array
    pair_kind: Array
    stirred: Array
    joint_work: Array
    kept: Array
    path: Array


def no_pairs(features: Features) -> Pairs:
    """Without any pair."""
    return Pairs(
        kind=np.zeros(0, np.int64),
        colour=np.zeros(0, np.int64),
        first=np.zeros((0, LANES), np.int64),
        second=np.zeros((0, LANES), np.int64),
        first_slot=np.zeros(0, np.int64),
        first_work=np.zeros(0, np.int64),
        candidate=aligned_zeros((1, 0), candidate_dtype(features)),
        sample_id=np.zeros((1, 0, LANES), np.int32),
        work=aligned_zeros(0, HALF_PAIR_WORK),
        wrench=np.zeros((0, LANES, 12)),
        busy=np.zeros(0, np.int64),
        first_row=np.zeros(0, np.int64),
        row_count=np.zeros(0, np.int64),
        colliding=np.zeros((0, LANES), np.int64),
        impact_work=np.zeros((0, LANES)),
        timing=aligned_zeros(0, TIMING),
    )


def _sizes(features: Features, slots: int, work: int) -> dict[str, tuple[int, int]]:
    """Axis that grows and its length, of the arrays whose length isn't the number of batches."""
    timed = work if features.finds_impacts else 0
    return {
        "candidate": (1, slots),
        "sample_id": (1, slots),
        "work": (0, work),
        "timing": (0, timed),
    }


def bytes_with_room(pairs: Pairs, features: Features, batches: int, slots: int, work: int) -> int:
    """Bytes of the arrays that `with_room` would make."""
    needed = 0
    for name, array in zip(pairs._fields, pairs, strict=True):
        axis, length = _sizes(features, slots, work).get(name, (0, batches))
        others = [n for k, n in enumerate(array.shape) if k != axis]
        needed += array.dtype.itemsize * length * math.prod(others)
    return needed


def with_room(pairs: Pairs, features: Features, batches: int, slots: int, work: int) -> Pairs:
    """The same pairs in arrays with room for more, of which the new part is zero."""
    sizes = _sizes(features, slots, work)

    def larger(name: str, array: Array) -> Array:
        axis, length = sizes.get(name, (0, batches))
        shape = list(array.shape)
        shape[axis] = length
        if array.dtype.names:
            room: Any = aligned_zeros(tuple(shape), array.dtype)
        else:
            room = np.zeros(shape, array.dtype)
        room[(slice(None),) * axis + (slice(array.shape[axis]),)] = array
        return room

    return Pairs(*(larger(name, array) for name, array in zip(pairs._fields, pairs, strict=True)))


def copy_pairs(pairs: Pairs) -> Pairs:
    """A deep copy."""
    return Pairs(*(array.copy() for array in pairs))
