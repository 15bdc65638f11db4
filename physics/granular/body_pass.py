"""What a step does to bodies, a lane group at a time: sum of forces, kicks, drift, particles.

The stages are those of the engine: a lane is a body here, not a world.
"""

import math
from typing import NamedTuple

import numpy as np

from physics.compiler.jit import LANES, at, stage
from physics.granular.static_forces import make_static_forces
from physics.granular.tables import (
    CENTER,
    LEAST_OF,
    MOST,
    MOST_OF,
    MOTION,
    ROTATION,
    SHEAR_LOAD,
    SLABS,
    SPIN,
    TURN,
    VELOCITY,
)
from physics.integrators.drift import make_drift
from physics.integrators.kick import make_kick
from physics.model.features import EULER, cached_by_features
from physics.model.workspace import SHEAR_SUM
from physics.motion.gravity import gravity
from physics.motion.kinematics import make_kinematics

Array = np.ndarray


class GroupModel(NamedTuple):
    """The part of `Model` that the stages read, of one lane group."""

    dynamic: Array


class GroupWorkspace(NamedTuple):
    """The part of `Workspace` that they work on, of one lane group."""

    solid: Array


# a sum of absolute values of a body's state beyond which it counts as diverged, as in worlds
_LARGEST = 1e50
# what a pass does: forces of the pairs are there; their kick; drift to the next positions
SUM, KICK, DRIFT = 1, 2, 4
LOAD, STORE = 8, 16


@stage
def copy_rows(target, source, rows):
    """Copies rows of lanes."""
    for axis in range(rows):
        for i in range(LANES):
            target[axis, i] = source[axis, i]


@stage
def load_states(heap, states, group, row):
    """Loads a lane group from the states [bodies] of DYNAMIC_STATE; lanes without body rest."""
    bodies = heap.order.shape[0]
    for i in range(LANES):
        place = group * LANES + i
        if place < bodies:
            state = states[heap.order[place]]
            for c in range(3):
                row.position[c, i] = state.position[c]
                row.momentum[c, i] = state.momentum[c]
                row.angular_momentum[c, i] = state.angular_momentum[c]
                row.force[c, i] = state.force[c]
                row.torque[c, i] = state.torque[c]
            for c in range(4):
                row.orientation[c, i] = state.orientation[c]


@stage
def store_states(heap, states, group, row):
    """Writes the bodies of a lane group to their states; quaternions with w >= 0."""
    bodies = heap.order.shape[0]
    for i in range(LANES):
        place = group * LANES + i
        if place < bodies:
            state = states[heap.order[place]]
            for c in range(3):
                state.position[c] = row.position[c, i]
                state.momentum[c] = row.momentum[c, i]
                state.angular_momentum[c] = row.angular_momentum[c, i]
                state.force[c] = row.force[c, i]
                state.torque[c] = row.torque[c, i]
            sign = -1.0 if row.orientation[3, i] < 0.0 else 1.0
            for c in range(4):
                state.orientation[c] = sign * row.orientation[c, i]


@stage
def sum_forces(heap, scratch, group, solid):
    """Adds the forces of all slabs' pairs on a lane group, in the order of the slabs.

    And the shear loads, in `SOLID.normals`.
    """
    place = group * LANES
    loads = solid.normals[SHEAR_SUM]
    for i in range(LANES):
        loads[i] = 0.0
    for s in range(SLABS):
        low, high = heap.force_range[s, 0], heap.force_range[s, 1]
        if low < place + LANES and high > place:
            shift = heap.force_range[s, 2] - low
            for i in range(max(low - place, 0), min(high - place, LANES)):
                b = shift + place + i
                for c in range(3):
                    solid.force[c, i] += scratch.force[b, c]
                    solid.torque[c, i] += scratch.force[b, 3 + c]
                loads[i] += scratch.force[b, 6]


@stage
def write_motion(heap, group, solid):
    """Writes what contacts read of the bodies of a lane group."""
    c, q = solid.position, solid.orientation
    v, omega = solid.velocity, solid.angular_velocity
    first = group * LANES * MOTION
    motion = heap.motion.reshape(MOTION * heap.motion.shape[0])[first : first + LANES * MOTION]
    for i in range(LANES):
        n = i * MOTION
        motion[n + CENTER], motion[n + CENTER + 1], motion[n + CENTER + 2] = (
            c[0, i],
            c[1, i],
            c[2, i],
        )
        motion[n + VELOCITY] = v[0, i]
        motion[n + VELOCITY + 1] = v[1, i]
        motion[n + VELOCITY + 2] = v[2, i]
        motion[n + SPIN] = omega[0, i]
        motion[n + SPIN + 1] = omega[1, i]
        motion[n + SPIN + 2] = omega[2, i]
        motion[n + TURN], motion[n + TURN + 1] = q[0, i], q[1, i]
        motion[n + TURN + 2], motion[n + TURN + 3] = q[2, i], q[3, i]


@cached_by_features
def make_write_particles(features):
    """Stage that writes where the particles of a lane group are."""
    equal = features.equal

    @stage
    def write_equal(heap, group, solid):
        """All bodies have the same particles: lane by lane, particle by particle."""
        R, c = solid.rotation, solid.position
        # not read before the next drift
        at_x, at_y, at_z = solid.present_velocity[0], solid.present_velocity[1], solid.weight[0]
        first = heap.first[group * LANES]
        each = heap.first[1] - heap.first[0]
        lanes = (heap.first[(group + 1) * LANES] - first) // each
        particle = heap.particle.reshape(4 * heap.particle.shape[0])
        for k in range(each):
            x, y, z = heap.local[k, 0], heap.local[k, 1], heap.local[k, 2]
            for i in range(LANES):
                at_x[i] = c[0, i] + (R[0, i] * x + R[1, i] * y + R[2, i] * z)
                at_y[i] = c[1, i] + (R[3, i] * x + R[4, i] * y + R[5, i] * z)
                at_z[i] = c[2, i] + (R[6, i] * x + R[7, i] * y + R[8, i] * z)
            for i in range(lanes):
                n = 4 * (first + k + i * each)
                particle[n], particle[n + 1], particle[n + 2] = at_x[i], at_y[i], at_z[i]

    @stage
    def write_any(heap, group, solid):
        R, c = solid.rotation, solid.position
        for i in range(LANES):
            cx, cy, cz = c[0, i], c[1, i], c[2, i]
            r00, r01, r02 = R[0, i], R[1, i], R[2, i]
            r10, r11, r12 = R[3, i], R[4, i], R[5, i]
            r20, r21, r22 = R[6, i], R[7, i], R[8, i]
            place = group * LANES + i
            for n in range(heap.first[place], heap.first[place + 1]):
                x, y, z = heap.local[n, 0], heap.local[n, 1], heap.local[n, 2]
                heap.particle[n, 0] = cx + (r00 * x + r01 * y + r02 * z)
                heap.particle[n, 1] = cy + (r10 * x + r11 * y + r12 * z)
                heap.particle[n, 2] = cz + (r20 * x + r21 * y + r22 * z)

    return write_equal if equal else write_any


@stage
def start_measuring(moved):
    """Clears a row of Scratch.moved: nothing has moved yet."""
    for i in range(LANES):
        moved[MOST, i], moved[ROTATION, i] = 0.0, 0.0
    for axis in range(3):
        for i in range(LANES):
            moved[LEAST_OF + axis, i], moved[MOST_OF + axis, i] = math.inf, -math.inf


@stage
def measure_motion(row, constants, moved):
    """How far a lane group has moved since the list was made; updates a row of Scratch.moved.

    Lane by lane, because a maximum over lanes would keep LLVM from using vectors. NaN in any body
    is kept in MOST.
    """
    reach = constants.core_reach
    c, q = row.position, row.orientation
    c0, q0 = row.listed_position, row.listed_orientation
    for i in range(LANES):
        x, y, z = c[0, i] - c0[0, i], c[1, i] - c0[1, i], c[2, i] - c0[2, i]
        # |q - q0| is twice the sine of a quarter of the angle; q and -q are the same rotation
        a, b, d, e = q[0, i], q[1, i], q[2, i], q[3, i]
        a0, b0, d0, e0 = q0[0, i], q0[1, i], q0[2, i], q0[3, i]
        sign = 1.0 if a * a0 + b * b0 + d * d0 + e * e0 > 0.0 else -1.0
        a, b, d, e = a - sign * a0, b - sign * b0, d - sign * d0, e - sign * e0
        turned = 2.0 * at(reach, i) * math.sqrt(a * a + b * b + d * d + e * e)
        far = math.sqrt(x * x + y * y + z * z) + turned
        moved[MOST, i] = moved[MOST, i] if far <= moved[MOST, i] else far
        moved[ROTATION, i] = moved[ROTATION, i] if turned <= moved[ROTATION, i] else turned
    for axis in range(3):
        for i in range(LANES):
            x = c[axis, i] - c0[axis, i]
            low, high = moved[LEAST_OF + axis, i], moved[MOST_OF + axis, i]
            moved[LEAST_OF + axis, i] = x if x < low else low
            moved[MOST_OF + axis, i] = x if x > high else high


@stage
def first_not_finite(row, group):
    """Place of the first body of a lane group whose state is not finite, or -1."""
    for i in range(LANES):
        total = 0.0
        for c in range(3):
            total += abs(row.position[c, i])
            total += abs(row.momentum[c, i]) + abs(row.angular_momentum[c, i])
        if not total < _LARGEST:
            return group * LANES + i
    return -1


@cached_by_features
def make_body_pass(features):
    """Stage that moves the bodies of a slab; `what`: SUM, KICK, DRIFT, LOAD, STORE in sum."""
    kick, drift = make_kick(features), make_drift(features)
    kinematics, static_forces = make_kinematics(features), make_static_forces(features)
    write_particles = make_write_particles(features)
    equal, euler = features.equal, features.integrator == EULER
    friction = features.friction
    before = 1.0 if euler else 0.5

    @stage
    def body_pass(heap, constants, scratch, states, thread, slab, what, h, evaluation):
        groups = heap.body.shape[0]
        workspace = GroupWorkspace(scratch.solid[thread : thread + 1])
        solid, next_entry, moved = workspace.solid[0], 0, scratch.moved[slab]
        start_measuring(moved)
        refresh = (what & SUM) != 0 and (what & KICK) == 0
        if what & STORE:
            scratch.bad[slab] = -1
        for group in range(groups * slab // SLABS, groups * (slab + 1) // SLABS):
            model = GroupModel(heap.dynamic[0:1] if equal else heap.dynamic[group : group + 1])
            row, own = heap.body[group], model.dynamic[0]
            if what & LOAD:
                load_states(heap, states, group, row)
            copy_rows(solid.position, row.position, 3)
            copy_rows(solid.orientation, row.orientation, 4)
            copy_rows(solid.momentum, row.momentum, 3)
            copy_rows(solid.angular_momentum, row.angular_momentum, 3)
            if what & SUM:
                for c in range(3):
                    for i in range(LANES):
                        solid.weight[c, i] = at(own.weight[c], i)
                gravity(model, workspace)
                sum_forces(heap, scratch, group, solid)
                next_entry = static_forces(
                    heap, constants, slab, next_entry, group * LANES, LANES, solid,
                    0.0 if refresh else h, evaluation,
                )  # fmt: skip
                if friction and not refresh:
                    for i in range(LANES):
                        heap.motion[group * LANES + i, SHEAR_LOAD] = solid.normals[SHEAR_SUM, i]
                if not euler and what & KICK:
                    kick(model, workspace, 0.5 * h)
                copy_rows(row.force, solid.force, 3)
                copy_rows(row.torque, solid.torque, 3)
            else:
                copy_rows(solid.force, row.force, 3)
                copy_rows(solid.torque, row.torque, 3)
            if what & DRIFT:
                kick(model, workspace, before * h)
                drift(model, workspace, h)
            copy_rows(row.position, solid.position, 3)
            copy_rows(row.orientation, solid.orientation, 4)
            copy_rows(row.momentum, solid.momentum, 3)
            copy_rows(row.angular_momentum, solid.angular_momentum, 3)
            if what & (DRIFT | LOAD):
                kinematics(model, workspace)
                write_motion(heap, group, solid)
                write_particles(heap, group, solid)
                measure_motion(row, own, moved)
            if what & STORE:
                store_states(heap, states, group, row)
                if scratch.bad[slab] < 0:
                    scratch.bad[slab] = first_not_finite(row, group)

    return body_pass
