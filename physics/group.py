"""A group: worlds side by side, one to a vector lane, as the stages work on them.

State keeps worlds one after another. A kernel takes LANES of them at a time into a `Work`, whose
arrays have the lane as their last axis, advances them together and writes them back. Every stage
loops over the lanes without a branch, which LLVM turns into vector instructions: eight worlds for
the price of one. Lanes never mix, so a world's result doesn't depend on what runs beside it.
"""

from typing import NamedTuple

import numpy as np

from physics.jit import LANES, kernel, stage
from physics.model import Model
from physics.state import aligned_zeros

Array = np.ndarray

# one row a solid: movers, then statics; what the stages read and write in a substep
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
        ("path", "f8", (LANES,)),  # m that a surface point has moved at most in the last drift
        ("pressed", "f8", (LANES,)),  # N, sum of normal forces of the side at work
    ],
    align=True,
)

# one row a side
MEETING = np.dtype(
    [
        ("count", "i8", (LANES,)),  # candidates
        ("travel", "f8", (LANES,)),  # m that the solids may still move before some are missing
        ("first_touch", "f8", (LANES,)),  # s, NaN before
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
        ("shear", "f8", (3,)),
        ("slid", "f8"),
        ("face", "f8"),
    ],
    align=True,
)

# one row in all
LANE = np.dtype(
    [
        ("active", "i8", (LANES,)),  # 0: no world, or one that has diverged or isn't advanced
        ("stale", "i8", (LANES,)),
        ("start", "f8", (LANES,)),  # s, time at which this call began
    ],
    align=True,
)


class Work(NamedTuple):
    """Working arrays of one call of a kernel, shared by no two threads.

    Attributes:
        solid: [solids] of SOLID.
        relative: [1] of SOLID: the owner of a side, in the frame of the surface that it meets.
        side: [sides] of MEETING.
        lane: [1] of LANE.
        old: [longest list of candidates] of REMEMBERED.
    """

    solid: Array
    relative: Array
    side: Array
    lane: Array
    old: Array

    @classmethod
    def of(cls, model: Model) -> "Work":
        """Working arrays for a model."""
        longest = int(model.side["slot_count"].max(initial=0))
        return cls(
            solid=aligned_zeros(len(model.mover) + len(model.static), SOLID),
            relative=aligned_zeros(1, SOLID),
            side=aligned_zeros(len(model.side), MEETING),
            lane=aligned_zeros(1, LANE),
            old=np.zeros(longest, REMEMBERED),
        )


@kernel
def load_forces(state, work, g, m, i):
    """Takes a mover's force and torque into lane i."""
    row, solid = state.mover[g * LANES + i, m], work.solid[m]
    for c in range(3):
        solid.force[c, i] = row.force[c]
        solid.torque[c, i] = row.torque[c]


@stage
def count_slots(work, k):
    """Notes how many slots a side's longest list has."""
    side = work.side[k]
    slots = 0
    for i in range(LANES):
        slots = max(slots, side.count[i])
    side.slots = slots


@stage
def load(model, state, work, chosen, g):
    """Takes the chosen worlds of group g into the lanes; other lanes rest at the origin."""
    lane = work.lane[0]
    for i in range(LANES):
        w = g * LANES + i
        active = w < chosen.shape[0] and chosen[w] and state.world[w].diverged == 0
        lane.active[i] = 1 if active else 0
        lane.stale[i] = 1 if active and state.world[w].stale != 0 else 0
        lane.start[i] = state.world[w].time if active else 0.0
        for m in range(model.mover.shape[0]):
            solid = work.solid[m]
            solid.path[i] = 0.0
            if active:
                row = state.mover[w, m]
                for c in range(3):
                    solid.position[c, i] = row.position[c]
                    solid.momentum[c, i] = row.momentum[c]
                    solid.angular_momentum[c, i] = row.angular_momentum[c]
                    solid.reference[c, i] = row.reference[c]
                    solid.reference_velocity[c, i] = row.reference_velocity[c]
                for c in range(4):
                    solid.orientation[c, i] = row.orientation[c]
                load_forces(state, work, g, m, i)
            else:
                for c in range(3):
                    solid.position[c, i] = 0.0
                    solid.momentum[c, i] = 0.0
                    solid.angular_momentum[c, i] = 0.0
                    solid.reference[c, i] = 0.0
                    solid.reference_velocity[c, i] = 0.0
                    solid.force[c, i] = 0.0
                    solid.torque[c, i] = 0.0
                for c in range(4):
                    solid.orientation[c, i] = 1.0 if c == 3 else 0.0
        for k in range(model.side.shape[0]):
            side = work.side[k]
            if active:
                found = state.side[w, k]
                side.count[i] = found.count
                side.travel[i] = found.travel
                side.first_touch[i] = found.first_touch
            else:
                side.count[i] = 0
                side.travel[i] = 1e300
                side.first_touch[i] = 0.0
    for k in range(model.side.shape[0]):
        count_slots(work, k)


@kernel
def store(model, state, work, g, i, time):
    """Writes lane i back to its world, at `time` s."""
    w = g * LANES + i
    state.world[w].time = time
    for m in range(model.mover.shape[0]):
        solid, row = work.solid[m], state.mover[w, m]
        for c in range(3):
            row.position[c] = solid.position[c, i]
            row.momentum[c] = solid.momentum[c, i]
            row.angular_momentum[c] = solid.angular_momentum[c, i]
            row.reference[c] = solid.reference[c, i]
            row.force[c] = solid.force[c, i]
            row.torque[c] = solid.torque[c, i]
        for c in range(4):
            row.orientation[c] = solid.orientation[c, i]
    for k in range(model.side.shape[0]):
        side, found = work.side[k], state.side[w, k]
        found.count = side.count[i]
        found.travel = side.travel[i]
        found.first_touch = side.first_touch[i]
