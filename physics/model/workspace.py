"""Working memory of the kernels: a lane group of worlds side by side, one world per SIMD lane.

Vectors stand as [3, LANES], so that loops over lanes read and write consecutive numbers.
"""

from typing import NamedTuple

import numpy as np

from physics.compiler.jit import LANES, aligned_zeros
from physics.model.contact_memory import contact_memory
from physics.model.features import ADAPTIVE, FIXED, RK4, Features, cached_by_features
from physics.model.impulse_rows import (
    BLOCK,
    BLOCK_VECTOR,
    CONTACT_ROW,
    CONTACT_SUM,
    CONTACT_SUMS,
    MANIFOLD_POINT,
    RESPONSE_ROW,
    SEARCH,
    TENSOR,
)
from physics.model.tables import Model

Array = np.ndarray

# rows of `SOLID.normals`, of which the last one is the sum of shear loads
NORMAL_SUMS = 7
SHEAR_SUM = NORMAL_SUMS - 1

# one row per solid: dynamic bodies, statics, then compound parts, whose pose and velocity follow
# their solid's
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
        ("reference_time", "f8", (LANES,)),  # s
        ("weight", "f8", (3, LANES)),  # N, see `DYNAMIC.weight`
        ("rotation", "f8", (9, LANES)),  # matrix, row by row: body frame to world frame
        ("velocity", "f8", (3, LANES)),  # m/s
        ("angular_velocity", "f8", (3, LANES)),  # rad/s
        # at the time of the position, see motion/fields.py
        ("present_velocity", "f8", (3, LANES)),  # m/s
        ("present_angular_velocity", "f8", (3, LANES)),  # rad/s
        # of the last drift
        ("displacement", "f8", (3, LANES)),  # m
        ("rotation_bound", "f8", (LANES,)),  # m, upper bound of what rotation moved any point
        # of the half-pair that is being worked on, see spring/contacts.py
        ("normal_force_sum", "f8", (LANES,)),  # N
        ("current_weight", "f8", (LANES,)),  # of the samples in contact
        ("impact_sum", "f8", (LANES,)),  # N m/s, see `State.half_pair.previous_impact`
        ("closing_sum", "f8", (LANES,)),  # N m/s, likewise
        ("mean_impact_speed", "f8", (LANES,)),  # m/s
        ("impact_ratio", "f8", (LANES,)),  # of impact speed to rate
        ("inverse_mass", "f8", (LANES,)),  # 1/kg, of the pair mass
        ("speed_per_load", "f8", (LANES,)),  # m/s per N
        ("load_rate", "f8", (LANES,)),  # kg/s
        ("inverse_mean_force", "f8", (LANES,)),  # 1/N
        ("damping", "f8", (LANES,)),  # coefficient of the normal law at this step
        ("grip", "f8", (LANES,)),  # see `HALF_PAIR_WORK.grip`
        ("gravity", "f8", (3, LANES)),  # m/s^2, see `HALF_PAIR.gravity`
        ("rest_speed", "f8", (LANES,)),  # m/s, lower bound of the impact speed on a plane
        ("normal_sum", "f8", (3, LANES)),  # of the samples in contact, times their weight
        # of mass splitting: n n^T summed over the solids touched in the last step, as xx yy zz xy
        # xz yz, and the loads of friction; and the number of those that can be touched
        ("normals", "f8", (NORMAL_SUMS, LANES)),
        ("partners", "i8"),
    ],
    align=True,
)

# one row per half-pair
HALF_PAIR_WORK = np.dtype(
    [
        ("count", "i8", (LANES,)),  # candidates
        ("remaining_skin", "f8", (LANES,)),  # m of relative motion for which lists stay complete
        ("relative_motion", "f8", (LANES,)),  # m, upper bound of that motion in the last drift
        ("first_touch", "f8", (LANES,)),  # s, NaN before
        ("previous_normal_force", "f8", (LANES,)),  # N, sum of the last step
        # of springs: weight in contact in the last step and in this one; and the N of this one
        ("previous_weight", "f8", (LANES,)),
        ("current_weight", "f8", (LANES,)),
        ("previous_impact", "f8", (LANES,)),
        ("current_impact", "f8", (LANES,)),
        ("previous_closing", "f8", (LANES,)),
        ("current_closing", "f8", (LANES,)),
        ("previous_normal", "f8", (3, LANES)),  # sum over these samples, in the world frame
        # of springs, of the pair: mean normal in the last step, or zero; and the parts into which
        # its mass is split, see spring/mass_splitting.py
        ("normal", "f8", (3, LANES)),
        ("loads", "f8", (2, LANES)),  # of friction, on the first and second of its solids
        ("parts", "f8", (LANES,)),
        ("grip", "f8", (LANES,)),  # factor on the damping of friction, likewise
        ("supported", "f8", (LANES,)),  # 1: a body of the pair touched something else, too
        ("current_normal_force", "f8", (LANES,)),
        ("slots", "i8"),  # the largest count
        ("first_row", "i8"),  # into Workspace.contact_row; impulse law
        ("untouched", "i8"),  # lanes without contact before this call
    ],
    align=True,
)

# a single row
LANE = np.dtype(
    [
        ("world", "i8", (LANES,)),  # -1: none
        ("active", "i8", (LANES,)),  # 0: no world, one that has diverged, or one not advanced
        ("needs_refresh", "i8", (LANES,)),
        ("updates_memory", "i8", (LANES,)),  # 0: inactive, or a refresh of other lanes passes by
        ("waiting", "i8"),  # lanes that have a world, but aren't active
        ("start", "f8", (LANES,)),  # s, time at which this call began
        ("joint_unconverged", "i8", (LANES,)),  # 1: joints need another pass
        ("joint_residual", "f8", (LANES,)),  # largest violation, relative
        ("joint_before", "f8", (LANES,)),  # that of the iteration before
        ("joint_stuck", "i8", (LANES,)),  # 1: the iteration doesn't converge
        ("joint_beyond", "i8", (LANES,)),  # 1: a motor or limit is beyond its bound
        ("in_contact", "i8", (LANES,)),  # 1: has candidates; impulse law
        # 1: the solids come from a drift over a whole substep; -1: they are at an impact, or one
        # was in the substep; 0: a refresh; impulse law
        ("drifted", "i8", (LANES,)),
        # of instantaneous collisions, see impulse/restitution.py
        ("colliding", "i8", (LANES,)),
        ("unconverged", "i8", (LANES,)),  # 1: needs another sweep
        ("fastest_approach", "f8", (LANES,)),  # m/s
        ("largest_change", "f8", (LANES,)),  # m/s, of a sweep
        ("impact_restitution", "f8", (LANES,)),  # the largest
        ("impact_work", "f8", (LANES,)),  # J, of all impact impulses
        ("compression_work", "f8", (LANES,)),  # J, of those of compression
        # J, impulses since compression times the velocities after them
        ("end_work", "f8", (LANES,)),
        ("allowed_work", "f8", (LANES,)),  # J, upper bound for restitution
        ("restitution_scale", "f8", (LANES,)),  # fraction of restitution that this bound allows
    ],
    align=True,
)

# rows of a state of (c, P, q, L)
POSITION, MOMENTUM, ORIENTATION, ANGULAR_MOMENTUM, STATE_ROWS = 0, 3, 6, 10, 13
MOST_STAGES = 7  # of a Runge-Kutta method

# one row per body, of Runge-Kutta methods. The rows of a state stand one after the other, because
# the longer a loop is, the less LLVM's checks before it cost; see `runge_kutta.place`
TRIAL = np.dtype(
    [
        ("start", "f8", (STATE_ROWS * LANES,)),  # state at the start of the step
        ("rate", "f8", (MOST_STAGES, STATE_ROWS * LANES)),  # its rates at each stage
        ("total", "f8", (STATE_ROWS * LANES,)),  # sum of the rates, each times its coefficient
    ],
    align=True,
)

# a single row, of Runge-Kutta methods
LANE_PACE = np.dtype(
    [
        ("step", "f8", (LANES,)),  # s, of the step that is tried; 0: the lane rests
        # of the adaptive pair
        ("proposal", "f8", (LANES,)),  # s, of the next step
        ("done", "f8", (LANES,)),  # s of this call
        ("error", "f8", (LANES,)),  # 1/s, see `runge_kutta.make_largest`
        ("body", "i8", (LANES,)),  # the one with the largest error
        ("accepted", "i8", (LANES,)),  # steps of this call
        ("rejected", "i8", (LANES,)),
        ("vanished", "i8", (LANES,)),  # 1: a step would have to be too short
    ],
    align=True,
)


# one row per scalar constraint of a joint, see constraints/rows.py
JOINT_WORK = np.dtype(
    [
        ("value", "f8", (LANES,)),  # m or rad, relative to the target
        ("direction", "f8", (3, LANES)),  # of the force on a
        ("moment_a", "f8", (3, LANES)),  # m or 1, of a unit force along the row on a
        ("moment_b", "f8", (3, LANES)),  # likewise, with the opposite sign, on b
        ("turn_a", "f8", (3, LANES)),  # these times the inverse inertia
        ("turn_b", "f8", (3, LANES)),
        ("inverse_pivot", "f8", (LANES,)),  # of the factor; 0: left out
        ("active", "i8", (LANES,)),
        ("clamped", "i8", (LANES,)),  # 1: has just been set to its bound
        ("change", "f8", (LANES,)),  # right side, then solution: N, N s or what has their units
        ("force", "f8", (LANES,)),  # sum of the changes
        ("rate", "f8", (LANES,)),  # m/s or rad/s that is wanted
        ("convective", "f8", (LANES,)),  # m/s^2 or rad/s^2, see constraints/convective.py
        # while impulses of contacts change velocities, see constraints/joint_velocities.py
        ("known_force", "f8", (LANES,)),  # N or N m, without that of contacts
        ("allowed", "i8", (LANES,)),  # 1: may act
        ("aim", "f8", (LANES,)),  # m/s or rad/s
        ("lacking", "f8", (LANES,)),  # m/s or rad/s
        ("impulse", "f8", (LANES,)),  # N s or N m s, sum
    ],
    align=True,
)

# one row per dynamic body: its state at the start of a drift
START = np.dtype(
    [
        ("position", "f8", (3, LANES)),
        ("orientation", "f8", (4, LANES)),
        ("momentum", "f8", (3, LANES)),
        ("angular_momentum", "f8", (3, LANES)),
    ],
    align=True,
)


# one row per half-pair, of time control, see step/event_steps.py
TIMING = np.dtype(
    [
        ("timed", "i8", (LANES,)),  # 1: impacts are found on the way
        # a sample whose separation less `horizon` steps of approach is at most `reach` touches
        ("horizon", "f8", (LANES,)),
        ("reach", "f8", (LANES,)),  # m
        ("impulse", "f8", (LANES,)),  # N s, normal, of the impacts on the way in this step
        ("waiting_skin", "f8", (LANES,)),  # m, `remaining_skin` while other lanes take a step
    ],
    align=True,
)

# a single row, of time control
CLOCK = np.dtype(
    [
        ("active", "i8", (LANES,)),  # `LANE.active` while lanes wait
        ("updates_memory", "i8", (LANES,)),  # likewise
        ("phase", "i8", (LANES,)),  # of an impact on the way, see step/event_steps.py
        ("time", "f8", (LANES,)),  # s since the substep began
        ("impacts", "i8", (LANES,)),  # in this substep
        ("halvings", "i8", (LANES,)),  # of the substep, see step/short_steps.py
        ("stale", "i8", (LANES,)),  # 1: the forces are those of another step than the substep
    ],
    align=True,
)

# one row per dynamic body, where the work of servos is measured, see `state.SERVO`
SERVO_WORK = np.dtype(
    [
        ("force", "f8", (3, LANES)),  # N
        ("momentum", "f8", (3, LANES)),  # kg m/s, when the forces were computed
        ("work", "f8", (LANES,)),  # J
    ],
    align=True,
)

# values of CLOCK.phase: no impact on the way, may have one, is at one, has had some
FREE, MAY_MEET, MEETS, HAS_MET = range(4)
# rows of `Workspace.kept`: when the substep began, at the end of a path with impacts, where a
# bisection began; momenta that a refresh's collisions have given to the forces
BEGINNING, END, BRACKET, GIVEN = range(4)


@cached_by_features
def remembered_dtype(features: Features) -> np.dtype:
    """One row per candidate of a list that is being replaced."""
    size = contact_memory(features).size
    return np.dtype([("sample_id", "i8"), ("memory", "f8", (size,))], align=True)


@cached_by_features
def saved_memory_dtype(features: Features) -> np.dtype:
    """One row per slot of a half-pair: the memory of its candidates."""
    return np.dtype([("memory", "f8", (contact_memory(features).size, LANES))], align=True)


class Workspace(NamedTuple):
    """Working arrays of one call of a kernel; threads never share one.

    Attributes:
        solid: [solids and compound parts] of SOLID; with joints one more, the world.
        relative: [2] of SOLID: the owner of a half-pair in the frame of the surface; and, while a
            pair is searched, the same of the reverse half-pair.
        half_pair: [half-pairs] of HALF_PAIR_WORK.
        lane: [1] of LANE.
        old: [longest list of candidates] of remembered_dtype.
        saved_memory: [longest list of candidates] of saved_memory_dtype; spring law.
        separation: [most samples of a half-pair] m, of the one that is being searched.
        tensor: [solids] of TENSOR, inverse inertia in the world frame; impulse law.
        contact_row: [slots] of CONTACT_ROW; impulse law.
        manifold: [two longest lists] of MANIFOLD_POINT; impulse law.
        joint: [rows of joints] of JOINT_WORK.
        joint_factor: [entries, LANES] off the diagonal, see constraints/envelope.py.
        start: [dynamic bodies] of START; with joints.
        trial: [dynamic bodies] of TRIAL; Runge-Kutta methods.
        pace: [1] of LANE_PACE; Runge-Kutta methods.
        timing: [half-pairs] of TIMING; time control.
        clock: [1] of CLOCK; time control.
        kept: [4, solids] of SOLID, see BEGINNING; time control.
        servo: [dynamic bodies] of SERVO_WORK, where the work of servos is measured.
        response_row: [slots] of RESPONSE_ROW; Newton's method, as the next three.
        block: [entries of a triangle of two rows per body] of BLOCK, row by row.
        block_vector: [two per solid] of BLOCK_VECTOR; zero for those that aren't bodies.
        contact_sum: [CONTACT_SUMS] of CONTACT_SUM.
        search: [1] of SEARCH.
    """

    solid: Array
    relative: Array
    half_pair: Array
    lane: Array
    old: Array
    saved_memory: Array
    separation: Array
    tensor: Array
    contact_row: Array
    manifold: Array
    joint: Array
    joint_factor: Array
    start: Array
    trial: Array
    pace: Array
    timing: Array
    clock: Array
    kept: Array
    servo: Array
    response_row: Array
    block: Array
    block_vector: Array
    contact_sum: Array
    search: Array

    @classmethod
    def of(cls, model: Model, features: Features) -> "Workspace":
        """Working arrays for a model."""
        half_pair, impulse = model.half_pair, features.impulse
        trials = features.integrator in (RK4, ADAPTIVE)
        longest = int(half_pair["slot_count"].max(initial=0))
        solids = len(model.dynamic) + len(model.static)
        slots = int(half_pair["slot_count"].sum())
        joints, rows = int(features.joints), model.joint_row
        entries = int((np.arange(len(rows)) - rows["first"]).sum())
        newton = features.newton
        blocks = 2 * int(model.dynamic["is_body"].sum()) if newton else 0
        kept = 0 if features.time_control == FIXED else 4
        work = aligned_zeros(len(half_pair), HALF_PAIR_WORK)
        work["first_row"] = half_pair["first_slot"]
        return cls(
            solid=aligned_zeros(solids + len(model.compound_part) + joints, SOLID),
            relative=aligned_zeros(2, SOLID),
            half_pair=work,
            lane=aligned_zeros(1, LANE),
            old=np.zeros(longest, remembered_dtype(features)),
            saved_memory=aligned_zeros(0 if impulse else longest, saved_memory_dtype(features)),
            separation=np.zeros(int(half_pair["sample_count"].max(initial=0))),
            tensor=aligned_zeros(solids if impulse else 0, TENSOR),
            contact_row=aligned_zeros(slots if impulse else 0, CONTACT_ROW),
            manifold=np.zeros(2 * longest if impulse else 0, MANIFOLD_POINT),
            joint=aligned_zeros(len(rows), JOINT_WORK),
            joint_factor=aligned_zeros((entries, LANES), np.dtype(float)),
            start=aligned_zeros(joints * len(model.dynamic), START),
            trial=aligned_zeros(len(model.dynamic) if trials else 0, TRIAL),
            pace=aligned_zeros(1 if trials else 0, LANE_PACE),
            timing=aligned_zeros(len(half_pair) if kept else 0, TIMING),
            clock=aligned_zeros(1, CLOCK),
            kept=aligned_zeros((kept, solids), SOLID),
            servo=aligned_zeros(len(model.dynamic) if features.measures_work else 0, SERVO_WORK),
            response_row=aligned_zeros(slots if newton else 0, RESPONSE_ROW),
            block=aligned_zeros(blocks * (blocks + 1) // 2, BLOCK),
            block_vector=aligned_zeros(2 * solids if newton else 0, BLOCK_VECTOR),
            contact_sum=aligned_zeros(CONTACT_SUMS if newton else 0, CONTACT_SUM),
            search=aligned_zeros(1, SEARCH),
        )
