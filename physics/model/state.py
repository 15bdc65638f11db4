"""State: what changes, as arrays by world; contact candidates by lane group."""

from typing import NamedTuple

import numpy as np

from physics.compiler.jit import LANES, aligned_zeros, columns
from physics.model.contact_memory import ROWS, contact_memory
from physics.model.features import ADAPTIVE, Features, cached_by_features
from physics.model.free_memory import check_memory
from physics.model.tables import Model

Array = np.ndarray

# one row per dynamic body and world: bodies, then drives
DYNAMIC_STATE = np.dtype(
    [
        ("position", "f8", (3,)),  # m
        ("orientation", "f8", (4,)),  # unit quaternion x y z w, w >= 0
        ("momentum", "f8", (3,)),  # kg m/s
        ("angular_momentum", "f8", (3,)),  # kg m^2/s about its own centre, world frame
        ("force", "f8", (3,)),  # N at the present position: of the next half kick
        ("torque", "f8", (3,)),  # N m, likewise
        ("reference", "f8", (3,)),  # m, set point of a drive's servo
        ("reference_velocity", "f8", (3,)),  # m/s, of that set point while it moves
        ("reference_time", "f8"),  # s for which it still moves
    ],
    align=True,
)

# one row per half-pair and world
HALF_PAIR_STATE = np.dtype(
    [
        ("count", "i8"),  # candidates
        ("remaining_skin", "f8"),  # m of relative motion for which the list stays complete
        # of springs, of the samples in contact in the last step: their weight; and of those that
        # approach the sums of force times impact speed and of force times rate, N m/s
        ("previous_weight", "f8"),
        ("previous_impact", "f8"),
        ("previous_closing", "f8"),
        ("previous_normal", "f8", (3,)),  # sum of their normals times weights, in the world frame
    ],
    align=True,
)

# rows of State.touch: what tasks ask of a half-pair after every frame. The spring law's next step
# reads NORMAL_FORCE too, together with `previous_weight`
NORMAL_FORCE = 0  # N, sum of the normal forces of the last step
FIRST_TOUCH = 1  # s, NaN before
FIRST_POSITION = 2  # and the next two: m, position of the pair's first solid at that time

STARTS_ANEW, NEW_FORCES = 1, 2  # values of STATUS.needs_refresh
QUERY, BEGINS = 1, 2  # what a refresh is for: a question, or the step that follows

# one row per world
STATUS = np.dtype(
    [
        ("time", "f8"),  # s
        # STARTS_ANEW: set from outside, forces and candidates are out of date. NEW_FORCES: only
        # the forces are; contacts keep their memory
        ("needs_refresh", "i4"),
        ("diverged", "i4"),  # 0, or 1 + index of the first non-finite dynamic body
        ("overflow", "i8"),  # 1: a half-pair had more candidates than room
    ],
    align=True,
)

# one row per dynamic body and world, where the work of servos is measured; zeros of bodies
SERVO = np.dtype(
    [
        ("force", "f8", (3,)),  # N, part of DYNAMIC_STATE.force
        ("work", "f8"),  # J, since the state was set
    ],
    align=True,
)

# one row per world, of the adaptive pair
PACE = np.dtype(
    [
        ("step", "f8"),  # s, proposed for the next step
        ("accepted", "i8"),  # steps since the state was set
        ("rejected", "i8"),  # tries that were too long
        ("vanished", "i8"),  # 1: the tolerance would need steps that are too short
    ],
    align=True,
)


@cached_by_features
def candidate_dtype(features: Features) -> np.dtype:
    """One row per slot: a candidate in each lane of a group, zeros where there is none."""
    fields = [
        ("sample", "f8", (3, LANES)),  # m, in the owner's frame
        ("weight", "f8", (LANES,)),
        ("memory", "f8", (contact_memory(features).size, LANES)),  # see `contact_memory`
    ]
    if features.impulse:
        # N, mean force of an instantaneous collision in the last step, in the surface's frame
        fields.append(("impact_force", "f8", (3, LANES)))
    if features.box and features.compound:
        # m by which a box's faces across each axis count as farther out, see `compound_frames`
        fields.append(("hidden_offset", "f8", (3, LANES)))
    if features.particles:
        fields.append(("partner", "f8", (3, LANES)))  # m, particle of the surface
    if features.grid:
        # m, distance from a mesh, and the normal there, see `grid_distance`
        fields.append(("distance", "f8", (LANES,)))
        fields.append(("normal", "f8", (3, LANES)))
    return np.dtype(fields, align=True)


class State(NamedTuple):
    """What changes.

    Attributes:
        dynamic: [w, m] of DYNAMIC_STATE.
        half_pair: [w, k] of HALF_PAIR_STATE.
        touch: [k, 5, w or a little more], see NORMAL_FORCE: columns over the worlds.
        world: [w] of STATUS.
        sample_id: [groups, slots, LANES] of each candidate; LANES worlds make a lane group.
        candidate: [groups, slots] of candidate_dtype.
        wrench: [w, m, 6] force in N and torque in N m from the user, world frame; [0, m, 6] until
            there are any.
        motor: [w, motors, 2] of each motor, in the order of the joints: rad/s or m/s; and rad or m,
            the set point of a servo, NaN: none.
        pace: [w] of PACE; [0] unless the integrator is adaptive.
        place: [w] where each world is: lane group times LANES plus lane, see `step.lane_order`.
        resident: [groups * LANES] the world at each place, -1 where there is none.
        servo: [w, m] of SERVO; [0, m] without `features.measures_work`.
    """

    dynamic: Array
    half_pair: Array
    touch: Array
    world: Array
    sample_id: Array
    candidate: Array
    wrench: Array
    motor: Array
    pace: Array
    place: Array
    resident: Array
    servo: Array

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        return sum(array.nbytes for array in self)


def allocate(model: Model, features: Features, count: int) -> State:
    """State arrays of `count` worlds, at rest at the origin.

    Raises:
        MemoryError: they don't fit into free memory.
    """
    slots = int(model.half_pair["slot_count"].sum())
    groups = -(-count // LANES)
    candidates = candidate_dtype(features)
    world = len(model.dynamic) * DYNAMIC_STATE.itemsize
    world += len(model.half_pair) * HALF_PAIR_STATE.itemsize
    group = slots * (candidates.itemsize + LANES * np.dtype(np.int32).itemsize)
    check_memory(count * world + groups * group, f"{count} worlds of this scene")
    state = State(
        dynamic=np.zeros((count, len(model.dynamic)), dtype=DYNAMIC_STATE),
        half_pair=np.zeros((count, len(model.half_pair)), dtype=HALF_PAIR_STATE),
        touch=columns((len(model.half_pair), 5), count, float),
        world=np.zeros(count, dtype=STATUS),
        sample_id=np.zeros((groups, slots, LANES), dtype=np.int32),
        candidate=aligned_zeros((groups, slots), candidates),
        wrench=np.zeros((0, len(model.dynamic), 6)),
        motor=np.zeros((count, int(model.joint_row["motor"].max(initial=-1)) + 1, 2)),
        pace=np.zeros(count if features.integrator == ADAPTIVE else 0, PACE),
        place=np.arange(count),
        resident=np.full(groups * LANES, -1),
        servo=np.zeros((count if features.measures_work else 0, len(model.dynamic)), SERVO),
    )
    state.resident[:count] = state.place
    state.dynamic["orientation"][..., 3] = 1.0
    state.half_pair["remaining_skin"] = -1.0
    state.touch[...] = 0.0
    state.touch[:, FIRST_TOUCH] = np.nan
    state.world["needs_refresh"] = STARTS_ANEW
    return state


def convert(state: State, before: Features, after: Features) -> State:
    """The state of worlds whose kernel had some features for a kernel with others.

    What the new kernel remembers of contacts beyond the old one is zero, as for a scene that
    doesn't need it.
    """
    old, new = contact_memory(before), contact_memory(after)
    candidates = aligned_zeros(state.candidate.shape, candidate_dtype(after))
    known = set(state.candidate.dtype.names or ())
    for name in candidates.dtype.names or ():
        if name in known and name != "memory":
            candidates[name] = state.candidate[name]
    for name in old._fields[1:]:
        source, target = getattr(old, name), getattr(new, name)
        if source >= 0 and target >= 0:
            rows = slice(source, source + ROWS[name]), slice(target, target + ROWS[name])
            candidates["memory"][:, :, rows[1]] = state.candidate["memory"][:, :, rows[0]]
    return state._replace(candidate=candidates)


def copy(state: State) -> State:
    """A deep copy."""
    return State(*(array.copy() for array in state))
