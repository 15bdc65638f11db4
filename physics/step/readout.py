"""Readout: poses and velocities of all dynamic bodies, which tasks read after every frame."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from physics.compiler.bundles import bundle
from physics.compiler.jit import LANES, at, entry, stage
from physics.model.features import BY_TABLE, GENERAL, NO_ROTATION, Features, cached_by_features
from physics.model.lanes import make_constants
from physics.motion.kinematics import angular_velocity_of

Array = np.ndarray

WIDTH = 16


class Readout(NamedTuple):
    """Kinematics of all dynamic bodies at one time: bodies, then drives, in scene order; read-only.

    In memory the worlds come last, so NumPy expressions run over all of them in one loop.

    Attributes:
        rows: [count, dynamic bodies, 16] position in m, quaternion x y z w with w >= 0, linear
            velocity in m/s and angular velocity in rad/s, in the world frame; set point of a
            drive's servo in m.
    """

    rows: Array

    @property
    def position(self) -> Array:
        """[count, dynamic bodies, 3] m."""
        return self.rows[..., 0:3]

    @property
    def orientation(self) -> Array:
        """[count, dynamic bodies, 4] quaternions x y z w, w >= 0."""
        return self.rows[..., 3:7]

    @property
    def linear_velocity(self) -> Array:
        """[count, dynamic bodies, 3] m/s."""
        return self.rows[..., 7:10]

    @property
    def angular_velocity(self) -> Array:
        """[count, dynamic bodies, 3] rad/s."""
        return self.rows[..., 10:13]

    @property
    def kinematics(self) -> Array:
        """[count, dynamic bodies, 13] the four above, side by side."""
        return self.rows[..., :13]

    @property
    def reference(self) -> Array:
        """[count, dynamic bodies, 3] m, set points of servos; for bodies without meaning."""
        return self.rows[..., 13:16]


@cached_by_features
def make_write_rows(features: Features):
    """Stage that writes the rows of one world."""
    rotation = features.rotation
    by_table = rotation == BY_TABLE

    @stage
    def write_rows(model, state, w, lane, table):
        """`model`: of the world's group; `lane`: that of the world."""
        for i in range(table.shape[0]):
            m, constants = state.dynamic[w, i], model.dynamic[i]
            table[i, 0, w] = m.position[0]
            table[i, 1, w] = m.position[1]
            table[i, 2, w] = m.position[2]
            x, y = m.orientation[0], m.orientation[1]
            z, s = m.orientation[2], m.orientation[3]
            table[i, 3, w] = x
            table[i, 4, w] = y
            table[i, 5, w] = z
            table[i, 6, w] = s
            inverse_mass = at(constants.inverse_mass, lane)
            table[i, 7, w] = inverse_mass * m.momentum[0]
            table[i, 8, w] = inverse_mass * m.momentum[1]
            table[i, 9, w] = inverse_mass * m.momentum[2]
            ox = 0.0
            oy = 0.0
            oz = 0.0
            if rotation != NO_ROTATION and constants.is_body:
                L, j = m.angular_momentum, constants.inverse_inertia
                jx, jy, jz = at(j[0], lane), at(j[1], lane), at(j[2], lane)
                if rotation == GENERAL or (by_table and constants.rotation == GENERAL):
                    ox, oy, oz = angular_velocity_of(x, y, z, s, jx, jy, jz, L[0], L[1], L[2])
                else:
                    ox, oy, oz = jx * L[0], jx * L[1], jx * L[2]
            table[i, 10, w] = ox
            table[i, 11, w] = oy
            table[i, 12, w] = oz
            table[i, 13, w] = m.reference[0]
            table[i, 14, w] = m.reference[1]
            table[i, 15, w] = m.reference[2]

    return write_rows


@cache
def make_readout(features: Features) -> Any:
    """Entry point that writes the rows of all worlds."""
    constants, write_rows = make_constants(features), make_write_rows(features)

    @entry
    def readout(model, state, table):
        state = bundle(state)
        for w in range(state.dynamic.shape[0]):
            g, lane = state.place[w] // LANES, state.place[w] % LANES
            write_rows(bundle(constants(model, g)), state, w, lane, table)

    return readout
