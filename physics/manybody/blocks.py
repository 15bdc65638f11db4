"""Blocks of bodies: LANES bodies side by side move as the bodies of a lane group do."""

import math

from physics.compiler.jit import LANES, sequence, stage
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
from physics.model.features import cached_by_features
from physics.model.tables import Model
from physics.model.workspace import Workspace
from physics.motion.gravity import gravity
from physics.motion.kinematics import make_kinematics


@stage
def block_model(model, crowd, m):
    """Block m as the only dynamic body, with constants of its own in every lane."""
    return Model(
        crowd.constants[m : m + 1],
        model.half_pair,
        model.compound_part,
        model.hidden_face,
        model.static,
        model.sample,
        model.field,
        model.joint_row,
        model.grid,
        model.grid_value,
        model.surface_point,
    )


@stage
def block_workspace(workspace, crowd, m):
    """The same, of the working memory."""
    return Workspace(
        crowd.solid[m : m + 1],
        workspace.relative,
        workspace.half_pair,
        workspace.lane,
        workspace.old,
        workspace.saved_memory,
        workspace.separation,
        workspace.tensor,
        workspace.contact_row,
        workspace.manifold,
        workspace.joint,
        workspace.joint_factor,
        workspace.start,
        workspace.trial,
        workspace.pace,
        workspace.timing,
        workspace.clock,
        workspace.kept,
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
        far += 0 if motion[i] + step <= margin[i] else 1  # NaN counts
    return far


@cached_by_features
def make_move_block(features):
    """Sequence of the first half of a substep: momenta change, bodies move; `count_far`."""
    kick, drift, kinematics = make_kick(features), make_drift(features), make_kinematics(features)

    @sequence
    def move_block(model, workspace, crowd, m, before, h):
        own, mine = block_model(model, crowd, m), block_workspace(workspace, crowd, m)
        kick(own, mine, before)
        drift(own, mine, h)
        kinematics(own, mine)
        write_frames(crowd, m)
        return count_far(crowd, m)

    return move_block


@cached_by_features
def make_place_block(features):
    """Sequence that writes the frames of a block at rest: for a refresh."""
    kinematics = make_kinematics(features)

    @sequence
    def place_block(model, workspace, crowd, m):
        solid = crowd.solid[m]
        for i in range(LANES):
            for c in range(3):
                solid.displacement[c, i] = 0.0
            solid.rotation_bound[i] = 0.0
        kinematics(block_model(model, crowd, m), block_workspace(workspace, crowd, m))
        write_frames(crowd, m)

    return place_block


@stage
def known_forces(model, workspace, crowd, m):
    """Weight and the user's wrenches."""
    gravity(block_model(model, crowd, m), block_workspace(workspace, crowd, m))
    force, torque = crowd.solid[m].force, crowd.solid[m].torque
    if crowd.wrench.shape[0] > 0:
        for i in range(LANES):
            for c in range(3):
                force[c, i] += crowd.wrench[m * LANES + i, c]
                torque[c, i] += crowd.wrench[m * LANES + i, 3 + c]


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
