"""Motion of the solids in one lane along a part of a substep, for time control.

Forces are constant during a substep, so centres move on parabolas and momenta change linearly. The
state holds the momenta of the middle of the substep, as after the first half kick. At `offset` s
after the middle they are P + offset F. A part of the substep is a drift with the momenta of its own
middle: exact for the centres, the midpoint rule for rotations. The whole substep as one part is the
drift of `integrators/drift.py`.
"""

from functools import cache

from physics.compiler.jit import at, stage
from physics.integrators.far_rotation import make_far_rotation, small_rotation_limit
from physics.integrators.midpoint import make_midpoint_rotation
from physics.model.features import BY_TABLE, GENERAL, ISOTROPIC, NO_ROTATION, cached_by_features
from physics.motion.kinematics import make_angular_velocity, write_rotation
from physics.motion.vectors import rotated
from physics.rotation import rotate_quaternion
from physics.scene.shapes import PLANE


@cached_by_features
def make_move(features):
    """Stage that moves lane i by `span` s from `time` s after the beginning of the substep `h`."""
    rotation = features.rotation
    by_table = rotation == BY_TABLE
    rotate = _make_rotate(ISOTROPIC if by_table else rotation)
    rotate_general = _make_rotate(GENERAL)

    @stage
    def move(model, workspace, i, time, span, h):
        """The motion since the last search is added up in `displacement` and `rotation_bound`."""
        offset = time + 0.5 * span - 0.5 * h
        for m in range(model.dynamic.shape[0]):
            solid, constants = workspace.solid[m], model.dynamic[m]
            step = span * at(constants.inverse_mass, i)
            for c in range(3):
                along = step * (solid.momentum[c, i] + offset * solid.force[c, i])
                solid.position[c, i] += along
                solid.displacement[c, i] += along
            if rotation == NO_ROTATION or not constants.is_body:
                continue
            if by_table and constants.rotation == GENERAL:
                rotate_general(solid, constants, i, offset, span)
            else:
                rotate(solid, constants, i, offset, span)

    return move


@cache
def _make_rotate(rotation):
    """Stage that rotates a body in lane i by the angular momentum at `offset` s for `span` s."""
    midpoint_rotation = make_midpoint_rotation(rotation, rotate_quaternion)
    far_rotation = make_far_rotation(rotation, False)

    @stage
    def rotate(solid, constants, i, offset, span):
        L, T, q = solid.angular_momentum, solid.torque, solid.orientation
        lx, ly, lz = (
            L[0, i] + offset * T[0, i],
            L[1, i] + offset * T[1, i],
            L[2, i] + offset * T[2, i],
        )
        j = constants.inverse_inertia
        jx, jy, jz = at(j[0], i), at(j[1], i), at(j[2], i)
        square = lx * lx + ly * ly + lz * lz
        limit = small_rotation_limit(jx, jy, jz, span)
        x, y, z, w = q[0, i], q[1, i], q[2, i], q[3, i]
        if square <= limit:
            x, y, z, w, ox, oy, oz = midpoint_rotation(x, y, z, w, jx, jy, jz, lx, ly, lz, span)
            fastest = abs(ox) + abs(oy) + abs(oz)
        else:
            x, y, z, w, fastest = far_rotation(x, y, z, w, jx, jy, jz, lx, ly, lz, span)
        q[0, i] = x
        q[1, i] = y
        q[2, i] = z
        q[3, i] = w
        solid.rotation_bound[i] += span * fastest * at(constants.core_reach, i)

    return rotate


@cached_by_features
def make_place_dynamic(features):
    """Stage that updates frames and velocities of dynamic bodies in lane i.

    They are those at `offset` s after the substep's middle.
    """
    angular_velocity = make_angular_velocity(features)

    @stage
    def place_dynamic(model, workspace, i, offset):
        for m in range(model.dynamic.shape[0]):
            solid, constants = workspace.solid[m], model.dynamic[m]
            inverse_mass = at(constants.inverse_mass, i)
            for c in range(3):
                solid.velocity[c, i] = inverse_mass * (
                    solid.momentum[c, i] + offset * solid.force[c, i]
                )
            if constants.is_body:
                write_rotation(solid, i)
                L, T = solid.angular_momentum, solid.torque
                ox, oy, oz = angular_velocity(
                    constants.rotation == GENERAL,
                    solid.orientation,
                    constants.inverse_inertia,
                    i,
                    L[0, i] + offset * T[0, i],
                    L[1, i] + offset * T[1, i],
                    L[2, i] + offset * T[2, i],
                )
                solid.angular_velocity[0, i] = ox
                solid.angular_velocity[1, i] = oy
                solid.angular_velocity[2, i] = oz

    return place_dynamic


@cached_by_features
def make_place(features):
    """The same, and of the parts of compounds."""
    place_dynamic, compound = make_place_dynamic(features), features.compound

    @stage
    def place(model, workspace, i, offset):
        place_dynamic(model, workspace, i, offset)
        if compound:
            first = model.dynamic.shape[0] + model.static.shape[0]
            for p in range(model.compound_part.shape[0]):
                constants, part = model.compound_part[p], workspace.solid[first + p]
                solid, turn, away = (
                    workspace.solid[constants.solid],
                    constants.rotation,
                    constants.position,
                )
                R = solid.rotation
                for column in range(3):
                    x, y, z = rotated(R, i, turn[column], turn[3 + column], turn[6 + column])
                    part.rotation[column, i] = x
                    part.rotation[3 + column, i] = y
                    part.rotation[6 + column, i] = z
                x, y, z = rotated(R, i, at(away[0], i), at(away[1], i), at(away[2], i))
                part.position[0, i] = solid.position[0, i] + x
                part.position[1, i] = solid.position[1, i] + y
                part.position[2, i] = solid.position[2, i] + z

    return place


@stage
def shift_momenta(model, workspace, i, offset):
    """Adds the impulses of the forces over `offset` s in lane i."""
    for m in range(model.dynamic.shape[0]):
        solid = workspace.solid[m]
        for c in range(3):
            solid.momentum[c, i] += offset * solid.force[c, i]
            solid.angular_momentum[c, i] += offset * solid.torque[c, i]


@stage
def keep_pose(model, workspace, row, i):
    """Copies the poses of lane i, and their motion since the last search, into a kept row."""
    for m in range(model.dynamic.shape[0]):
        copy_pose(workspace.solid[m], workspace.kept[row, m], i)


@stage
def restore_pose(model, workspace, row, i):
    """The reverse of `keep_pose`."""
    for m in range(model.dynamic.shape[0]):
        copy_pose(workspace.kept[row, m], workspace.solid[m], i)


@stage
def copy_pose(source, target, i):
    """Copies a solid's pose in lane i, and its motion since the last search."""
    for c in range(3):
        target.position[c, i] = source.position[c, i]
        target.displacement[c, i] = source.displacement[c, i]
    for c in range(4):
        target.orientation[c, i] = source.orientation[c, i]
    target.rotation_bound[i] = source.rotation_bound[i]


@stage
def rest_since_search(model, workspace, i):
    """Clears the motion since the last search in lane i."""
    for m in range(model.dynamic.shape[0]):
        solid = workspace.solid[m]
        for c in range(3):
            solid.displacement[c, i] = 0.0
        solid.rotation_bound[i] = 0.0


@cached_by_features
def make_relative_speed(features):
    """Stage: upper bound in m/s of the speed of a half-pair's solids relative to each other.

    In lane i, with the present momenta, as the broadphase measures motion.
    """
    rotation, angular_velocity = features.rotation, make_angular_velocity(features)

    @stage
    def tip_speed(model, workspace, m, i):
        if rotation == NO_ROTATION or m >= model.dynamic.shape[0] or not model.dynamic[m].is_body:
            return 0.0
        q, L = workspace.solid[m].orientation, workspace.solid[m].angular_momentum
        inverse, general = model.dynamic[m].inverse_inertia, model.dynamic[m].rotation == GENERAL
        x, y, z = angular_velocity(general, q, inverse, i, L[0, i], L[1, i], L[2, i])
        return (abs(x) + abs(y) + abs(z)) * at(model.dynamic[m].core_reach, i)

    @stage
    def relative_speed(model, workspace, k, i):
        half_pair = model.half_pair[k]
        o, s = half_pair.owner, half_pair.surface
        ma, mb = at(half_pair.owner_inverse_mass, i), at(half_pair.surface_inverse_mass, i)
        P, Q = workspace.solid[o].momentum, workspace.solid[s].momentum
        vx = abs(ma * P[0, i] - mb * Q[0, i])
        vy = abs(ma * P[1, i] - mb * Q[1, i])
        vz = abs(ma * P[2, i] - mb * Q[2, i])
        straight = vz if half_pair.kind == PLANE else vx + vy + vz
        turning = tip_speed(model, workspace, o, i) + tip_speed(model, workspace, s, i)
        return straight + turning

    return relative_speed
