"""The Fetch robot's arm.

A weld pulls the hand towards a mocap body, which each step puts ahead of where the hand is. The
robot's torso rises by 3.1 mm/s. Source of the figures: fetch/robot.xml of Gymnasium-Robotics 1.4.2,
and what its resets leave.
"""

from functools import cache
from typing import Any

import numpy as np

from physics.compiler.jit import entry
from physics.rotation import rotation_matrix
from rigid_envs.twins.arms.arm import Arm, hold_back, predict, read, write, write_part
from rigid_envs.twins.arms.chain import Link, differentiate, locate, make_chain
from rigid_envs.twins.arms.dynamics import weigh
from rigid_envs.twins.fetch.weld import (
    AHEAD,
    PIECES,
    RISE,
    SUBSTEP,
    SUBSTEPS,
    aim,
    prepare,
    pull,
)

Array = np.ndarray


def _links() -> list[Link]:
    """Offset, axis, mass, centre of mass, its frame and moments of inertia of each link."""
    x, y, z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
    rows = (
        ((0.1195, 0, 0.3486), z, 2.5587, (0.0927, -0.0056, 0.0564),
         (-0.136398, 0.76239, -0.156198, 0.612992), (0.009, 0.0086, 0.0041)),
        ((0.117, 0, 0.06), y, 2.6615, (0.1432, 0.0072, -0.0001),
         (0.438181, 0.438181, 0.554975, 0.554975), (0.0116, 0.0112, 0.0023)),
        ((0.219, 0, 0), x, 2.3311, (0.1165, 0.0014, 0),
         (-0.0136, 0.706976, 0.0136, 0.706976), (0.0047, 0.0045, 0.0019)),
        ((0.133, 0, 0), y, 2.1299, (0.1279, 0.0073, 0),
         (0.433186, 0.433186, 0.558882, 0.558882), (0.0086, 0.0084, 0.002)),
        ((0.197, 0, 0), x, 1.6563, (0.1097, -0.0266, 0),
         (-0.071498, 0.703483, 0.071498, 0.703483), (0.0035, 0.0031, 0.0015)),
        ((0.1245, 0, 0), y, 1.725, (0.0882, 0.0009, -0.0001),
         (0.489492, 0.489492, 0.510292, 0.510292), (0.0042, 0.0042, 0.0018)),
        ((0.1385, 0, 0), x, 0.1354, (0.0095, 0.0004, -0.0002),
         (1, 0, 0, 0), (0.0001, 0.0001, 0.0001)),
    )  # fmt: skip
    links = []
    for offset, axis, mass, center, (w, *xyz), inertia in rows:
        R = rotation_matrix(np.array([*xyz, w]))
        links.append(Link(offset, np.eye(3), axis, mass, center, R @ np.diag(inertia) @ R.T))
    # fixed to the last link: the hand, and two fingers that move little
    links[-1] = links[-1].carrying(
        1.5175, (0.0764, -0.0001, -0.0017), np.diag([0.0013, 0.0019, 0.0024])
    )
    for side in (0.0159, -0.0159):
        links[-1] = links[-1].carrying(4.0, (0.1564, side, 0.0), 0.1 * np.eye(3))
    return links


CHAIN = make_chain(_links(), (0.1664 + AHEAD, 0.0, 0.0), np.eye(3))


@cache
def _make_move() -> Any:
    @entry
    def move(
        chain, start, hinges, position, velocity, asked, support, moved, end, load, work, first,
        last,
    ):  # fmt: skip
        for group in range(first, last):
            read(start, hinges, position, velocity, asked, support, group, work)
            for piece in range(-1, PIECES + 1):
                inside = 0 <= piece < PIECES
                predict(work, 0.5 * SUBSTEPS / PIECES * SUBSTEP if inside else 0.0)
                locate(chain, work.vector[0], work)
                differentiate(work)
                if piece == PIECES:
                    break
                weigh(chain, work)
                prepare(work)
                if piece == -1:
                    aim(work)
                    hold_back(work)
                else:
                    pull(chain, work)
            write_part(0, group, work, moved, end)
            write(start, group, work, hinges, load)

    return move


def make_arm(base: float, angles: tuple[float, ...], speeds: tuple[float, ...]) -> Arm:
    """The arm of a robot whose base is at `base` m along x.

    Args:
        base: m.
        angles: rad, at the start of an episode.
        speeds: rad/s, at the start of an episode.
    """
    origin = np.array([base + 0.2, 0.7441, 0.378656])
    return Arm(CHAIN, _make_move, np.array(angles), np.array(speeds), origin, RISE)


# as the originals' resets leave them: of FetchReach, FetchPickAndPlace, FetchPush and FetchSlide
REACH_ARM = make_arm(
    0.4049,
    (0.009952, -0.825639, -0.003625, 1.443894, 0.003059, 0.953220, 0.005520),
    (0.000744, 0.006461, -0.001390, -0.002184, 0.001103, -0.001168, -0.000928),
)
PICK_ARM = make_arm(
    0.405,
    (0.009951, -0.825639, -0.003624, 1.443894, 0.003061, 0.953220, 0.005518),
    (0.000746, 0.006461, -0.001392, -0.002184, 0.001103, -0.001168, -0.000928),
)
PUSH_ARM = make_arm(
    0.405,
    (0.012383, -0.589417, -0.005435, 1.453137, 0.002139, 0.699147, 0.007581),
    (0.005322, 0.002748, -0.003969, 0.007792, 0.000282, 0.021637, 0.003075),
)
SLIDE_ARM = make_arm(
    0.05,
    (0.013982, -0.586468, -0.006729, 1.450737, 0.001034, 0.693262, 0.009155),
    (0.009600, 0.000782, -0.006937, 0.011945, -0.002065, 0.035686, 0.007463),
)
