"""Chains of hinges: where their links and hands are.

The frame of a link lies at its hinge, whose axis is the frame's z axis. Compiled functions work on
the arms of `LANES` worlds side by side, see `physics.compiler.jit`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from physics.compiler.jit import LANES, sequence, stage
from rigid_envs.twins.arms.work import JOINTS

Array = np.ndarray
Vector = tuple[float, float, float]


class Link(NamedTuple):
    """A link as files of robots describe it, in a frame of its own at its hinge.

    Attributes:
        offset: m, of the hinge in the frame of the link before.
        rotation: [3, 3], of the link's frame in that of the link before, at angle zero.
        axis: of the hinge, in the link's frame.
        mass: kg.
        center: m, of mass, in the link's frame.
        inertia: [3, 3] kg m^2 about the centre of mass, along the link's axes.
    """

    offset: Vector
    rotation: Array
    axis: Vector
    mass: float
    center: Vector
    inertia: Array

    def carrying(self, mass: float, center: Vector, inertia: Array) -> "Link":
        """The link with a body that is fixed to it: kg, m, [3, 3] kg m^2, as of the link."""
        total = self.mass + mass
        middle = (self.mass * np.array(self.center) + mass * np.array(center)) / total
        moments = (
            body + weight * _about(np.array(place) - middle)
            for weight, place, body in (
                (self.mass, self.center, self.inertia),
                (mass, center, inertia),
            )
        )
        return self._replace(
            mass=total, center=tuple(middle), inertia=sum(moments, np.zeros((3, 3)))
        )


class Chain(NamedTuple):
    """A chain of n hinges and a hand that is fixed to its last link.

    Attributes:
        offset: [n + 1, 3] m, of each hinge, and of the hand, in the frame of the link before.
        turn: [n + 1, 3, 3], rotation of each frame at angle zero in that of the link before.
        mass: [n] kg.
        moment: [n, 3] kg m, mass times position of the centre of mass in the link's frame.
        inertia: [n, 3, 3] kg m^2 about the frame's origin.
    """

    offset: Array
    turn: Array
    mass: Array
    moment: Array
    inertia: Array


def make_chain(links: Sequence[Link], hand_offset: Vector, hand_rotation: Array) -> Chain:
    """A chain of links and a hand in the frame of the last one.

    Args:
        links: from the base on.
        hand_offset: m.
        hand_rotation: [3, 3].
    """
    count = len(links)
    offset, turn = np.empty((count + 1, 3)), np.empty((count + 1, 3, 3))
    moment, inertia = np.empty((count, 3)), np.empty((count, 3, 3))
    last = np.eye(3)  # from the link's frame to the one whose z axis is that of the hinge
    for i, link in enumerate(links):
        to_axis = rotation_to_axis(np.array(link.axis))
        offset[i], turn[i] = last.T @ link.offset, last.T @ link.rotation @ to_axis
        center = to_axis.T @ link.center
        moment[i] = link.mass * center
        inertia[i] = to_axis.T @ link.inertia @ to_axis + link.mass * _about(center)
        last = to_axis
    offset[count], turn[count] = last.T @ hand_offset, last.T @ hand_rotation
    mass = np.array([link.mass for link in links])
    return Chain(offset, turn, mass, moment, inertia)


def _about(offset: Array) -> Array:
    """Moments of inertia [3, 3] m^2 per mass of a point at an offset [3] m."""
    return np.asarray(offset @ offset * np.eye(3) - np.outer(offset, offset))


def rotation_to_axis(axis: Array) -> Array:
    """The rotation [3, 3] that turns the z axis the shortest way to a unit vector, not -z."""
    x, y, z = axis
    a, b, c = 1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), 1.0 - y * y / (1.0 + z)
    return np.array([[a, b, x], [b, c, y], [-x, -y, z]])


@sequence
def locate(chain, angles, work):
    """Writes the poses of chains whose hinges have these angles [n, LANES] rad; bases are at zero.

    The hand is the last frame.
    """
    rotation, origin = work.rotation, work.origin
    for a in range(3):
        for b in range(3):
            for lane in range(LANES):
                rotation[0, a, b, lane] = chain.turn[0, a, b]
        for lane in range(LANES):
            origin[0, a, lane] = chain.offset[0, a]
    _turn(angles[0], rotation[0])
    for i in range(1, JOINTS + 1):
        before, turn, offset = rotation[i - 1], chain.turn[i], chain.offset[i]
        for a in range(3):
            for lane in range(LANES):
                x, y, z = before[a, 0, lane], before[a, 1, lane], before[a, 2, lane]
                along = x * offset[0] + y * offset[1] + z * offset[2]
                origin[i, a, lane] = origin[i - 1, a, lane] + along
                rotation[i, a, 0, lane] = x * turn[0, 0] + y * turn[1, 0] + z * turn[2, 0]
                rotation[i, a, 1, lane] = x * turn[0, 1] + y * turn[1, 1] + z * turn[2, 1]
                rotation[i, a, 2, lane] = x * turn[0, 2] + y * turn[1, 2] + z * turn[2, 2]
        if i < JOINTS:
            _turn(angles[i], rotation[i])


@stage
def _turn(angle, rotation):
    """Turns frames [3, 3, LANES] about their z axes by angles [LANES], within ±2 pi."""
    for lane in range(LANES):
        # the series of an eighth of the angle, then three times of the double angle
        x = 0.125 * angle[lane]
        y = x * x
        sine = x * (
            1.0
            - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (1.0 - y / 110.0))))
        )
        cosine = 1.0 - y / 2.0 * (
            1.0 - y / 12.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0 * (1.0 - y / 90.0)))
        )
        sine, cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
        sine, cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
        sine, cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
        x0, x1, x2 = rotation[0, 0, lane], rotation[1, 0, lane], rotation[2, 0, lane]
        y0, y1, y2 = rotation[0, 1, lane], rotation[1, 1, lane], rotation[2, 1, lane]
        rotation[0, 0, lane] = cosine * x0 + sine * y0
        rotation[1, 0, lane] = cosine * x1 + sine * y1
        rotation[2, 0, lane] = cosine * x2 + sine * y2
        rotation[0, 1, lane] = cosine * y0 - sine * x0
        rotation[1, 1, lane] = cosine * y1 - sine * x1
        rotation[2, 1, lane] = cosine * y2 - sine * x2


@stage
def differentiate(work):
    """Writes how the hand moves with the hinges: the Jacobian [6, n, LANES].

    Its first three rows are the hand's velocity in m/s, the others its angular velocity in rad/s,
    each per rad/s of a hinge.
    """
    jacobian = work.jacobian
    for i in range(JOINTS):
        rotation, origin, hand = work.rotation[i], work.origin[i], work.origin[JOINTS]
        for lane in range(LANES):
            x, y, z = rotation[0, 2, lane], rotation[1, 2, lane], rotation[2, 2, lane]
            rx = hand[0, lane] - origin[0, lane]
            ry = hand[1, lane] - origin[1, lane]
            rz = hand[2, lane] - origin[2, lane]
            jacobian[0, i, lane] = y * rz - z * ry
            jacobian[1, i, lane] = z * rx - x * rz
            jacobian[2, i, lane] = x * ry - y * rx
            jacobian[3, i, lane] = x
            jacobian[4, i, lane] = y
            jacobian[5, i, lane] = z
