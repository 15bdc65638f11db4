"""Body groups: LANES bodies, or LANES mechanisms of the same structure, side by side.

The stages of a lane group move them as the bodies of LANES small worlds.
"""

import math

from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, sequence, stage
from physics.constraints.joint_drift import make_joint_drift
from physics.constraints.joint_forces import make_joint_forces
from physics.impulse.point_impulses import world_tensor
from physics.integrators.drift import make_drift
from physics.integrators.kick import make_kick
from physics.manybody.tables import (
    ANGULAR_VELOCITY,
    DISPLACEMENT,
    POSITION,
    ROTATION,
    ROTATION_BOUND,
    VELOCITY,
)
from physics.model.features import EULER, cached_by_features
from physics.model.state import State
from physics.model.tables import Model
from physics.model.workspace import NORMAL_SUMS, Workspace
from physics.motion.drives import make_drives, make_finger_coupling
from physics.motion.fields import make_fields, make_present_velocities
from physics.motion.gravity import gravity
from physics.motion.kinematics import make_kinematics


@stage
def group_model(model, crowd, g):
    """The bodies of group g as the only dynamic ones, with constants of their own in every lane."""
    group = crowd.group[g]
    return Model(
        crowd.constants[group.first_block : group.first_block + group.block_count],
        model.half_pair,
        model.compound_part,
        model.hidden_face,
        model.static,
        model.sample,
        model.field[group.first_field : group.first_field + group.field_count],
        model.joint_row[group.first_joint : group.first_joint + group.joint_count],
        model.grid,
        model.grid_value,
        model.surface_point,
    )


@stage
def group_workspace(workspace, crowd, g):
    """The same, of the working memory; marks the lanes that hold bodies of the scene."""
    group, lane = crowd.group[g], workspace.lane[0]
    for i in range(LANES):
        lane.world[i] = i if crowd.present[g, i] != 0 else -1
        lane.active[i] = crowd.present[g, i]
    return Workspace(
        crowd.solid[group.first_block : group.first_block + group.solid_count],
        workspace.relative,
        workspace.half_pair,
        workspace.lane,
        workspace.old,
        workspace.saved_memory,
        workspace.separation,
        workspace.tensor,
        workspace.contact_row,
        workspace.manifold,
        crowd.joint[group.first_joint : group.first_joint + group.joint_count],
        crowd.joint_factor[group.first_entry : group.first_entry + group.entry_count],
        workspace.start,
        workspace.trial,
        workspace.pace,
        workspace.timing,
        workspace.clock,
        crowd.kept[:, group.first_block : group.first_block + group.solid_count],
        workspace.servo,
        workspace.response_row,
        workspace.block,
        workspace.block_vector,
        workspace.contact_sum,
        workspace.search,
    )


@stage
def group_state(state, crowd, g):
    """The state with the motors of group g as those of LANES worlds."""
    return State(
        state.dynamic,
        state.half_pair,
        state.touch,
        state.world,
        state.sample_id,
        state.candidate,
        state.wrench,
        crowd.motor[g * LANES : (g + 1) * LANES],
        state.pace,
        state.place,
        state.resident,
        state.servo,
    )


@stage
def write_frames(crowd, m):
    """Writes the frames of a block, each body's side by side."""
    solid, frame = crowd.solid[m], crowd.frame
    for i in range(LANES):
        p = m * LANES + i
        for c in range(3):
            frame[p, POSITION + c] = solid.position[c, i]
            frame[p, VELOCITY + c] = solid.velocity[c, i]
            frame[p, ANGULAR_VELOCITY + c] = solid.angular_velocity[c, i]
            frame[p, DISPLACEMENT + c] = solid.displacement[c, i]
        for c in range(9):
            frame[p, ROTATION + c] = solid.rotation[c, i]
        frame[p, ROTATION_BOUND] = solid.rotation_bound[i]


@stage
def count_far(crowd, m):
    """Adds the last drift to the motion of a block's bodies; how many are about to leave a margin.

    A body has left it when it has moved further since its pairs were searched. The next drift is
    expected to take as much again, of which bodies that collide before they touch need half.
    """
    solid, motion, margin, far = crowd.solid[m], crowd.motion[m], crowd.margin[m], 0
    d, bound = solid.displacement, solid.rotation_bound
    for i in range(LANES):
        step = math.sqrt(d[0, i] * d[0, i] + d[1, i] * d[1, i] + d[2, i] * d[2, i]) + bound[i]
        motion[i] += step
        here = motion[i] + step <= margin[i] or margin[i] == math.inf  # a copy; else NaN counts
        far += 0 if here else 1
    return far


@stage
def blocks_of(crowd, g):
    """The blocks of a group's bodies."""
    first = crowd.group[g].first_block
    return range(first, first + crowd.group[g].block_count)


@cached_by_features
def make_move_group(features):
    """Sequence of the first half of a substep: momenta change, bodies move.

    Returns how many bodies are about to leave their margin, see `count_far`.
    """
    kick, kinematics, drift = make_kick(features), make_kinematics(features), make_drift(features)
    joints, joint_drift = features.joints, make_joint_drift(features)

    @sequence
    def move_group(model, workspace, crowd, g, before, h):
        own = bundle(group_model(model, crowd, g))
        mine = bundle(group_workspace(workspace, crowd, g))
        kick(own, mine, before)
        if joints and crowd.group[g].joint_count > 0:
            joint_drift(own, mine, h)
        else:
            drift(own, mine, h)
        kinematics(own, mine)
        far = 0
        for m in blocks_of(crowd, g):
            write_frames(crowd, m)
            far += count_far(crowd, m)
        return far

    return move_group


@cached_by_features
def make_place_group(features):
    """Sequence that writes the frames of a group at rest: for a refresh."""
    kinematics = make_kinematics(features)

    @sequence
    def place_group(model, workspace, crowd, g):
        for m in blocks_of(crowd, g):
            solid = crowd.solid[m]
            for i in range(LANES):
                for c in range(3):
                    solid.displacement[c, i] = 0.0
                solid.rotation_bound[i] = 0.0
        kinematics(
            bundle(group_model(model, crowd, g)), bundle(group_workspace(workspace, crowd, g))
        )
        for m in blocks_of(crowd, g):
            write_frames(crowd, m)

    return place_group


@cached_by_features
def make_known_forces(features):
    """Sequence of all forces but those of contacts and joints: weight, fields, user, servos."""
    lag = 0.0 if features.integrator == EULER else 1.0
    present_velocities, fields = make_present_velocities(features), make_fields(features)
    drives = make_drives(features)

    @sequence
    def known_forces(model, workspace, crowd, g, drifted):
        """The last drift took `drifted` s, 0 in a refresh."""
        own = bundle(group_model(model, crowd, g))
        mine = bundle(group_workspace(workspace, crowd, g))
        present_velocities(own, mine, lag * drifted)
        gravity(own, mine)
        fields(own, mine)
        if crowd.wrench.shape[0] > 0:
            for m in blocks_of(crowd, g):
                force, torque = crowd.solid[m].force, crowd.solid[m].torque
                for i in range(LANES):
                    for c in range(3):
                        force[c, i] += crowd.wrench[m * LANES + i, c]
                        torque[c, i] += crowd.wrench[m * LANES + i, 3 + c]
        drives(own, mine, drifted)

    return known_forces


@cached_by_features
def make_hold_joints(features):
    """Sequence that adds the forces of a group's joints."""
    joints, joint_forces = features.joints, make_joint_forces(features)

    @sequence
    def hold_joints(model, state, workspace, crowd, g, h, drifted):
        """Steps take `h` s, the last drift took `drifted` s."""
        if joints and crowd.group[g].joint_count > 0:
            own = bundle(group_model(model, crowd, g))
            mine = bundle(group_workspace(workspace, crowd, g))
            joint_forces(own, bundle(group_state(state, crowd, g)), mine, h, drifted)

    return hold_joints


@cached_by_features
def make_end_step(features):
    """Sequence of the second half of a substep: the fingers of grippers are one solid; a kick."""
    couple_fingers, kick = make_finger_coupling(features), make_kick(features)

    @sequence
    def end_step(model, workspace, crowd, g, drifted, time):
        """The last drift took `drifted` s, the kick takes `time` s."""
        own = bundle(group_model(model, crowd, g))
        mine = bundle(group_workspace(workspace, crowd, g))
        couple_fingers(own, mine, drifted)
        if time > 0.0:
            kick(own, mine, time)

    return end_step


@stage
def add_contacts(crowd, pairs, m, force, torque):
    """Adds the wrenches of each body's pairs to sums [3, LANES], in a fixed order."""
    for i in range(LANES):
        body = m * LANES + i
        fx, fy, fz, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for n in range(crowd.incident_first[body], crowd.incident_first[body + 1]):
            home, side = crowd.incident[n] >> 1, 6 * (crowd.incident[n] & 1)
            if pairs.busy[home // LANES] != 0:
                row = pairs.wrench[home // LANES, home % LANES]
                fx += row[side]
                fy += row[side + 1]
                fz += row[side + 2]
                tx += row[side + 3]
                ty += row[side + 4]
                tz += row[side + 5]
        force[0, i] += fx
        force[1, i] += fy
        force[2, i] += fz
        torque[0, i] += tx
        torque[1, i] += ty
        torque[2, i] += tz


@stage
def add_normals(crowd, pairs, m):
    """Sums n n^T and the loads of friction over the pairs of each body."""
    for i in range(LANES):
        body = m * LANES + i
        sums = crowd.normals[body]
        for c in range(NORMAL_SUMS):
            sums[c] = 0.0
        for n in range(crowd.incident_first[body], crowd.incident_first[body + 1]):
            b, lane = (crowd.incident[n] >> 1) // LANES, (crowd.incident[n] >> 1) % LANES
            if pairs.busy[b] != 0:
                half_pairs = crowd.pair_kind[pairs.kind[b]].half_pair_count
                work = pairs.work[pairs.first_work[b] + half_pairs - 1]
                normal = work.normal
                x, y, z = normal[0, lane], normal[1, lane], normal[2, lane]
                sums[0] += x * x
                sums[1] += y * y
                sums[2] += z * z
                sums[3] += x * y
                sums[4] += x * z
                sums[5] += y * z
                sums[6] += work.loads[crowd.incident[n] & 1, lane]


@stage
def write_tensors(crowd, m):
    """Writes the inverse inertia of a block's bodies in the world frame."""
    R, j = crowd.solid[m].rotation, crowd.constants[m].inverse_inertia
    for i in range(LANES):
        xx, yy, zz, xy, xz, yz = world_tensor(R, i, j[0, i], j[1, i], j[2, i])
        row = crowd.tensor[m * LANES + i]
        row[0], row[1], row[2], row[3], row[4], row[5] = xx, yy, zz, xy, xz, yz


@stage
def change_velocities(crowd, m, time):
    """Changes the velocities in the frames of a block by its forces over a time."""
    force, torque = crowd.solid[m].force, crowd.solid[m].torque
    inverse_mass = crowd.constants[m].inverse_mass
    for i in range(LANES):
        frame, tensor = crowd.frame[m * LANES + i], crowd.tensor[m * LANES + i]
        tx, ty, tz = torque[0, i], torque[1, i], torque[2, i]
        step = time * inverse_mass[i]
        frame[VELOCITY] += step * force[0, i]
        frame[VELOCITY + 1] += step * force[1, i]
        frame[VELOCITY + 2] += step * force[2, i]
        frame[ANGULAR_VELOCITY] += time * (tensor[0] * tx + tensor[3] * ty + tensor[4] * tz)
        frame[ANGULAR_VELOCITY + 1] += time * (tensor[3] * tx + tensor[1] * ty + tensor[5] * tz)
        frame[ANGULAR_VELOCITY + 2] += time * (tensor[4] * tx + tensor[5] * ty + tensor[2] * tz)
