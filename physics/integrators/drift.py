"""Drift: bodies and drives move and rotate by their momenta, by the rule of the integrator."""

import math
from functools import cache

from physics.compiler.jit import LANES, at, stage
from physics.integrators.euler import make_euler_rotation
from physics.integrators.far_rotation import make_far_rotation, small_rotation_limit
from physics.integrators.midpoint import make_midpoint_rotation
from physics.model.features import (
    BY_TABLE,
    EULER,
    GENERAL,
    ISOTROPIC,
    NO_ROTATION,
    cached_by_features,
)
from physics.rotation import rotate_quaternion


@cache
def make_rotate(rotation, euler):
    """Stage that rotates a body by its angular momentum for a time.

    For the broadphase it computes an upper bound of how far rotation moves any point of a core,
    whose farthest point is `core_reach` from the centre.
    """
    make_rotation = make_euler_rotation if euler else make_midpoint_rotation
    rotated = make_rotation(rotation, rotate_quaternion)
    far_rotation = make_far_rotation(rotation, euler)

    @stage
    def rotate(solid, constants, time):
        q, L, rotation_bound = solid.orientation, solid.angular_momentum, solid.rotation_bound
        j, reaches, far = constants.inverse_inertia, constants.core_reach, 0
        for i in range(LANES):
            jx, jy, jz = at(j[0], i), at(j[1], i), at(j[2], i)
            square, span = small_rotation_limit(jx, jy, jz, time), time * at(reaches, i)
            x, y, z, w = q[0, i], q[1, i], q[2, i], q[3, i]
            lx, ly, lz = L[0, i], L[1, i], L[2, i]
            nx, ny, nz, nw, ox, oy, oz = rotated(x, y, z, w, jx, jy, jz, lx, ly, lz, time)
            small = lx * lx + ly * ly + lz * lz <= square
            q[0, i] = nx if small else x
            q[1, i] = ny if small else y
            q[2, i] = nz if small else z
            q[3, i] = nw if small else w
            # the sum of absolute values is an upper bound of the length, and needs no root; inf
            # marks lanes for the second loop, which makes large rotations
            rotation_bound[i] = span * (abs(ox) + abs(oy) + abs(oz)) if small else math.inf
            far += 0 if small else 1
        if far > 0:
            for i in range(LANES):
                if rotation_bound[i] == math.inf:
                    x, y, z, w, fastest = far_rotation(
                        q[0, i], q[1, i], q[2, i], q[3, i],
                        at(j[0], i), at(j[1], i), at(j[2], i),
                        L[0, i], L[1, i], L[2, i], time,
                    )  # fmt: skip
                    q[0, i] = x
                    q[1, i] = y
                    q[2, i] = z
                    q[3, i] = w
                    rotation_bound[i] = time * at(reaches, i) * fastest

    return rotate


@cached_by_features
def make_drift(features):
    """Stage that moves bodies and drives, and rotates bodies."""
    rotation, euler = features.rotation, features.integrator == EULER
    by_table = rotation == BY_TABLE
    rotate = make_rotate(ISOTROPIC if by_table else rotation, euler)
    rotate_general = make_rotate(GENERAL, euler)

    @stage
    def drift(model, workspace, time):
        for m in range(model.dynamic.shape[0]):
            solid, constants = workspace.solid[m], model.dynamic[m]
            c, P, displacement = solid.position, solid.momentum, solid.displacement
            inverse_mass = constants.inverse_mass
            for i in range(LANES):
                step = time * at(inverse_mass, i)
                dx, dy, dz = step * P[0, i], step * P[1, i], step * P[2, i]
                c[0, i] += dx
                c[1, i] += dy
                c[2, i] += dz
                displacement[0, i] = dx
                displacement[1, i] = dy
                displacement[2, i] = dz
            if rotation == NO_ROTATION or not constants.is_body:
                continue
            if by_table:
                if constants.rotation == GENERAL:
                    rotate_general(solid, constants, time)
                elif constants.rotation == ISOTROPIC:
                    rotate(solid, constants, time)
            else:
                rotate(solid, constants, time)

    return drift
