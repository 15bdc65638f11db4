"""Frames of all solids: rotation matrix, velocity and angular velocity from the state."""

from functools import cache

from physics.compiler.jit import LANES, at, stage
from physics.model.features import BY_TABLE, GENERAL, ISOTROPIC, NO_ROTATION, cached_by_features
from physics.rotation import rotation_entries


@stage
def write_rotation(solid, i):
    """Writes the rotation matrix of a solid in lane i from its quaternion."""
    q, R = solid.orientation, solid.rotation
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation_entries(
        q[0, i], q[1, i], q[2, i], q[3, i]
    )
    R[0, i] = r00
    R[1, i] = r01
    R[2, i] = r02
    R[3, i] = r10
    R[4, i] = r11
    R[5, i] = r12
    R[6, i] = r20
    R[7, i] = r21
    R[8, i] = r22


@stage
def write_static_frames(model, workspace):
    """Writes the rows of the statics, once for all worlds and steps."""
    dynamic_count = model.dynamic.shape[0]
    for s in range(model.static.shape[0]):
        solid = workspace.solid[dynamic_count + s]
        for i in range(LANES):
            for c in range(3):
                solid.position[c, i] = model.static[s, c]
                solid.velocity[c, i] = 0.0
                solid.angular_velocity[c, i] = 0.0
                solid.displacement[c, i] = 0.0
            for c in range(4):
                solid.orientation[c, i] = model.static[s, 3 + c]
            solid.rotation_bound[i] = 0.0
            write_rotation(solid, i)


@stage
def write_drive_frames(model, workspace):
    """Writes what never changes of the drives, once for all steps: they never rotate."""
    for m in range(model.dynamic.shape[0]):
        if not model.dynamic[m].is_body:
            solid = workspace.solid[m]
            for i in range(LANES):
                # `kinematics` computes it too, but time control looks ahead before that
                for c in range(3):
                    solid.angular_velocity[c, i] = 0.0
                write_rotation(solid, i)


@stage
def angular_velocity_of(x, y, z, w, jx, jy, jz, lx, ly, lz):
    """Omega = R J0^-1 R^T L of a body with quaternion x y z w; jx, jy, jz are 1/moments."""
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation_entries(x, y, z, w)
    bx = jx * (r00 * lx + r10 * ly + r20 * lz)
    by = jy * (r01 * lx + r11 * ly + r21 * lz)
    bz = jz * (r02 * lx + r12 * ly + r22 * lz)
    return (
        r00 * bx + r01 * by + r02 * bz,
        r10 * bx + r11 * by + r12 * bz,
        r20 * bx + r21 * by + r22 * bz,
    )


@cached_by_features
def make_angular_velocity(features):
    """Formula for omega in lane i of orientations q, 1/moments j and angular momenta l.

    `general`: whether the rotation by the table is GENERAL; otherwise not read.
    """
    return _angular_velocity_by(features.rotation)


@cache
def _angular_velocity_by(rotation):
    by_table = rotation == BY_TABLE

    @stage
    def angular_velocity(general, q, j, i, lx, ly, lz):
        jx, jy, jz = at(j[0], i), at(j[1], i), at(j[2], i)
        if rotation == NO_ROTATION:
            ox, oy, oz = 0.0, 0.0, 0.0
        elif rotation == GENERAL or (by_table and general):
            ox, oy, oz = angular_velocity_of(
                q[0, i], q[1, i], q[2, i], q[3, i], jx, jy, jz, lx, ly, lz
            )
        else:
            ox, oy, oz = jx * lx, jx * ly, jx * lz
        return ox, oy, oz

    return angular_velocity


@cache
def _make_write_velocities(rotation):
    """Stage that writes velocity and angular velocity of a dynamic body."""
    angular_velocity = _angular_velocity_by(rotation)

    @stage
    def write_velocities(solid, constants):
        q, P, L = solid.orientation, solid.momentum, solid.angular_momentum
        v, omega = solid.velocity, solid.angular_velocity
        inverse_mass, j = constants.inverse_mass, constants.inverse_inertia
        # drives have an inverse inertia of zero. Without omega the loop would be so short that LLVM
        # unrolls it instead of vectorising it
        for i in range(LANES):
            v[0, i] = at(inverse_mass, i) * P[0, i]
            v[1, i] = at(inverse_mass, i) * P[1, i]
            v[2, i] = at(inverse_mass, i) * P[2, i]
            ox, oy, oz = angular_velocity(False, q, j, i, L[0, i], L[1, i], L[2, i])
            omega[0, i] = ox
            omega[1, i] = oy
            omega[2, i] = oz

    return write_velocities


@cached_by_features
def make_kinematics(features):
    """Stage that updates the frames of the dynamic bodies from their state."""
    rotation = features.rotation
    by_table = rotation == BY_TABLE
    write = _make_write_velocities(ISOTROPIC if by_table else rotation)
    write_general = _make_write_velocities(GENERAL)

    @stage
    def kinematics(model, workspace):
        for m in range(model.dynamic.shape[0]):
            solid, constants = workspace.solid[m], model.dynamic[m]
            # the loop over lanes has no branch
            if by_table and constants.rotation == GENERAL:
                write_general(solid, constants)
            else:
                write(solid, constants)
            if constants.is_body:  # the others: `write_drive_frames`
                for i in range(LANES):
                    write_rotation(solid, i)

    return kinematics
