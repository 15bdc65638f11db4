"""State: what changes, as arrays with a leading world axis."""

from typing import NamedTuple

import numpy as np

from physics.features import Features
from physics.jit import LANES
from physics.model import Model
from physics.stages.candidates import OLD
from physics.stages.contacts import REPORT
from physics.stages.kinematics import FRAME
from physics.stages.relative import RELATIVE

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
        ("travel", "f8"),  # m that both solids may still move before candidates are missing
        ("first_touch", "f8"),  # s, NaN before
    ],
    align=True,
)

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


class State(NamedTuple):
    """What changes.

    Attributes:
        mover: [w, m] of MOVING.
        side: [w, k] of FOUND.
        world: [w] of STATUS.
        sample_id: [w, lanes] of each candidate.
        lanes: [w * chunks * fields * LANES] what is stored of each candidate, chunk by chunk.
    """

    mover: Array
    side: Array
    world: Array
    sample_id: Array
    lanes: Array

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self)


def allocate(model: Model, features: Features, count: int) -> State:
    """State arrays of `count` worlds, at rest at the origin and stale."""
    chunks = int(model.side["chunk_count"].sum())
    state = State(
        mover=np.zeros((count, len(model.mover)), dtype=MOVING),
        side=np.zeros((count, len(model.side)), dtype=FOUND),
        world=np.zeros(count, dtype=STATUS),
        sample_id=np.zeros((count, chunks * LANES), dtype=np.int32),
        lanes=np.zeros(count * chunks * features.lane_fields * LANES),
    )
    state.mover["orientation"][..., 3] = 1.0
    state.side["travel"] = -1.0
    state.side["first_touch"] = np.nan
    state.world["stale"] = 1
    return state


def copy(state: State) -> State:
    """A deep copy."""
    return State(*(array.copy() for array in state))


class Scratch(NamedTuple):
    """Working arrays of one call of a kernel, shared by no two threads.

    Attributes:
        frame: [solids, FRAME].
        rel: [RELATIVE].
        rows: [rows, REPORT] of a report; none otherwise.
        old: [lanes, OLD] of the longest list of candidates.
    """

    frame: Array
    rel: Array
    rows: Array
    old: Array

    @classmethod
    def of(cls, model: Model, rows: Array | None = None) -> "Scratch":
        """Scratch arrays for a model."""
        longest = int(model.side["chunk_count"].max(initial=0)) * LANES
        return cls(
            frame=np.zeros((len(model.mover) + len(model.static), FRAME)),
            rel=np.zeros(RELATIVE),
            rows=np.zeros((0, REPORT)) if rows is None else rows,
            old=np.zeros((longest, OLD)),
        )
