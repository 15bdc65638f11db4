"""Poses and velocities of all movers: what tasks look at after every frame."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from physics.features import GENERAL, NO_ROTATION, Features
from physics.group import make_constants
from physics.jit import LANES, SOURCES, at, entry, kernel
from physics.stages.kinematics import spin_of

Array = np.ndarray

WIDTH = 13


class Readout(NamedTuple):
    """A copy of the movers' kinematics: bodies, then drives, in scene order.

    Attributes:
        rows: [count, movers, 13] position m, quaternion x y z w with w >= 0, linear velocity m/s,
            angular velocity rad/s, in the world frame.
    """

    rows: Array

    @property
    def position(self) -> Array:
        """[count, movers, 3] m."""
        return self.rows[..., 0:3]

    @property
    def orientation(self) -> Array:
        """[count, movers, 4] quaternions x y z w, w >= 0."""
        return self.rows[..., 3:7]

    @property
    def linear_velocity(self) -> Array:
        """[count, movers, 3] m/s."""
        return self.rows[..., 7:10]

    @property
    def angular_velocity(self) -> Array:
        """[count, movers, 3] rad/s."""
        return self.rows[..., 10:13]


@cache
def make_write_rows(features: Features):
    """Kernel that writes the rows of one world."""
    rotation = features.rotation

    @kernel
    def write_rows(model, state, w, rows):
        """`model`: of the world's group."""
        lane = w % LANES
        for i in range(rows.shape[1]):
            m, constants = state.mover[w, i], model.mover[i]
            rows[w, i, 0] = m.position[0]
            rows[w, i, 1] = m.position[1]
            rows[w, i, 2] = m.position[2]
            x, y = m.orientation[0], m.orientation[1]
            z, s = m.orientation[2], m.orientation[3]
            # q and -q are the same rotation
            sign = -1.0 if s < 0.0 else 1.0
            rows[w, i, 3] = sign * x
            rows[w, i, 4] = sign * y
            rows[w, i, 5] = sign * z
            rows[w, i, 6] = sign * s
            inverse_mass = at(constants.inverse_mass, lane)
            rows[w, i, 7] = inverse_mass * m.momentum[0]
            rows[w, i, 8] = inverse_mass * m.momentum[1]
            rows[w, i, 9] = inverse_mass * m.momentum[2]
            ox = 0.0
            oy = 0.0
            oz = 0.0
            if rotation != NO_ROTATION and constants.turns:
                L, j = m.angular_momentum, constants.inverse_inertia
                jx, jy, jz = at(j[0], lane), at(j[1], lane), at(j[2], lane)
                if rotation == GENERAL:
                    ox, oy, oz = spin_of(x, y, z, s, jx, jy, jz, L[0], L[1], L[2])
                else:
                    ox, oy, oz = jx * L[0], jx * L[1], jx * L[2]
            rows[w, i, 10] = ox
            rows[w, i, 11] = oy
            rows[w, i, 12] = oz

    return write_rows


@cache
def make_readout(features: Features) -> Any:
    """Entry point that writes the rows of all worlds."""
    sources = SOURCES
    constants, write_rows = make_constants(features), make_write_rows(features)

    @entry
    def readout(model, state, rows):
        _ = sources
        for w in range(rows.shape[0]):
            write_rows(constants(model, w // LANES), state, w, rows)

    return readout
