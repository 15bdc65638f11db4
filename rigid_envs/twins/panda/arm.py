"""The Panda robot's arm.

Inverse kinematics turns a displacement of the hand into angles of the hinges, and motors of limited
torque drive them there. The original observes the hand one substep late, and so does `move`: it
ends with the angles before the last substep, and the speeds after it.

Sources of figures: the robot's file in PyBullet (franka_panda/panda.urdf), with the moments of
inertia that PyBullet gives its links, and panda-gym 3.0.7.
"""

import math
from functools import cache
from typing import Any

import numpy as np

from physics.compiler.jit import entry
from rigid_envs.twins.arms.arm import Arm, hold_back, predict, read, write, write_part
from rigid_envs.twins.arms.chain import Link, differentiate, locate, make_chain
from rigid_envs.twins.arms.dynamics import factor_masses, weigh
from rigid_envs.twins.panda.inverse_kinematics import solve_for_angles
from rigid_envs.twins.panda.motors import PIECES, SUBSTEP, SUBSTEPS, begin, drive

Array = np.ndarray

BASE = np.array([-0.6, 0.0, 0.0])  # m
NEUTRAL = np.array([0.0, 0.41, 0.0, -1.85, 0.0, 2.26, 0.79])  # rad

_HALF = math.sqrt(0.5)
HAND_FRAME = np.array(
    [[_HALF, _HALF, 0.0], [-_HALF, _HALF, 0.0], [0.0, 0.0, 1.0]]
)  # the hand's frame in that of the last link


def _turned(quarters: int) -> Array:
    """Rotation [3, 3] by quarters of a turn about the x axis."""
    cosine, sine = (1.0, 0.0) if quarters == 0 else (0.0, float(quarters))
    return np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])


def _links() -> list[Link]:
    """Offset, quarters of a turn, mass, centre of mass, moments of inertia of each link."""
    rows = (
        ((0, 0, 0.333), 0, 2.7, (0, -0.04, -0.05), (0.022971, 0.017769, 0.011484)),
        ((0, 0, 0), -1, 2.73, (0, -0.04, 0.06), (0.023491, 0.011613, 0.018228)),
        ((0, -0.316, 0), 1, 2.04, (0.01, 0.01, -0.05), (0.01092, 0.012581, 0.011968)),
        ((0.0825, 0, 0), 1, 2.08, (-0.03, 0.03, 0.02), (0.011335, 0.012249, 0.013057)),
        ((-0.0825, 0.384, 0), -1, 3.0, (0, 0.04, -0.12), (0.035676, 0.029848, 0.012802)),
        ((0, 0, 0), 1, 1.3, (0.04, 0, 0), (0.003428, 0.005117, 0.005988)),
        ((0.088, 0, 0), 1, 0.2, (0, 0, 0.08), (0.000362, 0.000362, 0.000592)),
    )
    # fixed to the last link: the hand, and two fingers that move little
    carried = (
        (0.81, (0, 0, 0.147), (0.003719, 0.001016, 0.003388)),
        (0.1, (0.007071, 0.007071, 0.1854), (4.2e-5, 3.9e-5, 1.7e-5)),
        (0.1, (-0.007071, -0.007071, 0.1854), (4.2e-5, 3.9e-5, 1.7e-5)),
    )
    axis = (0.0, 0.0, 1.0)
    links = [
        Link(offset, _turned(quarters), axis, mass, center, np.diag(inertia))
        for offset, quarters, mass, center, inertia in rows
    ]
    for mass, center, inertia in carried:
        links[-1] = links[-1].carrying(mass, center, HAND_FRAME @ np.diag(inertia) @ HAND_FRAME.T)
    return links


CHAIN = make_chain(_links(), (0.0, 0.0, 0.212), HAND_FRAME)


@cache
def _make_move() -> Any:
    @entry
    def move(
        chain, start, hinges, position, velocity, asked, support, moved, end, load, work, first,
        last,
    ):  # fmt: skip
        for group in range(first, last):
            read(start, hinges, position, velocity, asked, support, group, work)
            for phase in range(2 * PIECES + 1):  # start, and middle and end of each piece
                middle = phase % 2 == 1
                predict(work, 0.5 * SUBSTEPS / PIECES * SUBSTEP if middle else 0.0)
                locate(chain, work.vector[0], work)
                differentiate(work)
                if phase > 0 and not middle:
                    write_part(phase // 2 - 1, group, work, moved, end)
                    continue
                weigh(chain, work)
                if middle:
                    drive(work)
                else:
                    factor_masses(work)
                    hold_back(work)
                    solve_for_angles(chain, SUBSTEP, work)
                    begin(work)
            write(start, group, work, hinges, load)

    return move


ARM = Arm(CHAIN, _make_move, NEUTRAL, np.zeros(len(NEUTRAL)), BASE, parts=PIECES)
