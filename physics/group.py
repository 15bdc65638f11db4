"""A group: worlds side by side, one to a vector lane, as the stages work on them.

State keeps worlds one after another. A kernel takes LANES of them at a time into a `Work`, whose
arrays have the lane as their last axis, advances them together and writes them back. Every stage
loops over the lanes without a branch, which LLVM turns into vector instructions: many worlds for
the price of a few. Lanes never mix, so a world's result doesn't depend on what runs beside it.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from physics.features import Features
from physics.jit import LANES, aligned_zeros, kernel, stage
from physics.model import Model
from physics.state import FIRST_POSITION, FIRST_TOUCH, PRESSED

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


@cache
def make_constants(features: Features):
    """Stage that tells the constants of group g: one row a mover and side."""
    varied = features.varied

    @stage
    def constants(model, g):
        if varied:
            mover, side, part = model.mover[g], model.side[g], model.part[g]
            return Model(mover, side, part, model.cover, model.static, model.sample)
        return model

    return constants


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
    """Takes the chosen worlds of group g into the lanes; other lanes rest at the origin.

    Returns how many there are; nothing is taken if none.
    """
    lane, count = work.lane[0], 0
    for i in range(LANES):
        w = g * LANES + i
        if w < chosen.shape[0] and chosen[w] and state.world[w].diverged == 0:
            count += 1
    if count == 0:
        return 0
    for i in range(LANES):
        w = g * LANES + i
        active = w < chosen.shape[0] and chosen[w] and state.world[w].diverged == 0
        lane.active[i] = 1 if active else 0
        lane.keeps[i] = 1 if active else 0
        lane.stale[i] = 1 if active and state.world[w].stale != 0 else 0
        lane.start[i] = state.world[w].time if active else 0.0
        for m in range(model.mover.shape[0]):
            solid = work.solid[m]
            solid.swing[i] = 0.0
            for c in range(3):
                solid.shift[c, i] = 0.0
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
                side.first_touch[i] = state.touch[k, FIRST_TOUCH, w]
                side.pressed[i] = state.touch[k, PRESSED, w]
                side.bore[i] = found.bore
            else:
                side.count[i] = 0
                side.travel[i] = 1e300
                side.first_touch[i] = 0.0
                side.pressed[i] = 0.0
                side.bore[i] = 0.0
    for k in range(model.side.shape[0]):
        count_slots(work, k)
    return count


@stage
def note_touch(model, state, work, g, k, pressed, elapsed):
    """Notes how hard a side presses, `pressed` [N], and when and where it does so first."""
    side, keeps = work.side[k], work.lane[0].keeps
    first, noted, start = side.first_touch, side.pressed, work.lane[0].start
    new = 0
    for i in range(LANES):
        noted[i] = pressed[i] if keeps[i] != 0 else noted[i]
        before = (pressed[i] <= 0.0) | (first[i] <= start[i] + elapsed) | (keeps[i] == 0)
        new += 0 if before else 1
    if new > 0:
        note_first(model, state, work, g, k, pressed, elapsed)


@kernel
def note_first(model, state, work, g, k, pressed, elapsed):
    """Notes when and where a side presses for the first time, in the lanes in which it does."""
    first, keeps, start = work.side[k].first_touch, work.lane[0].keeps, work.lane[0].start
    position = work.solid[min(model.side[k].owner, model.side[k].surface)].position
    for i in range(LANES):
        time = start[i] + elapsed
        if pressed[i] > 0.0 and not first[i] <= time and keeps[i] != 0:
            first[i] = time
            for c in range(3):
                state.touch[k, FIRST_POSITION + c, g * LANES + i] = position[c, i]


@stage
def end_look(model, state, work, g):
    """Gives lanes whose state wasn't set their forces back, and lets them remember again."""
    lane = work.lane[0]
    for i in range(LANES):
        lane.keeps[i] = lane.active[i]
        if lane.active[i] and not lane.stale[i]:
            for m in range(model.mover.shape[0]):
                load_forces(state, work, g, m, i)


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
        state.touch[k, FIRST_TOUCH, w] = side.first_touch[i]
        # by impulses `choose` may have emptied a list after the search
        state.touch[k, PRESSED, w] = side.pressed[i] if side.count[i] > 0 else 0.0
        found.bore = side.bore[i]
