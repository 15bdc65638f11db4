"""Values and rates of the rows of joints in NumPy: the formulas of `constraints.rows`."""

from typing import Any, NamedTuple

import numpy as np

from physics.model.joints import held_axes
from physics.model.tables import ALONG, ANGLE, DISTANCE, EQUALITY
from physics.rotation import rotate, rotate_back
from physics.scene.drives import Drive
from physics.scene.scene import Scene
from physics.scene.solids import Body

Array = np.ndarray


class Frame(NamedTuple):
    """Pose and velocities of one solid in n worlds.

    Attributes:
        position: [n, 3] m.
        orientation: [n, 4] quaternions x y z w.
        velocity: [n, 3] m/s.
        angular_velocity: [n, 3] rad/s, world frame.
    """

    position: Array
    orientation: Array
    velocity: Array
    angular_velocity: Array


def frame_of(
    solid: int, position: Array, orientation: Array, velocity: Array, angular_velocity: Array
) -> Frame:
    """The frame of a body, from arrays [n, bodies, ...]; or of the world, beyond the last body."""
    n, bodies = position.shape[:2]
    if solid < bodies:
        columns = (position, orientation, velocity, angular_velocity)
        return Frame(*(values[:, solid] for values in columns))
    zero = np.zeros((n, 3))
    return Frame(zero, np.broadcast_to([0.0, 0.0, 0.0, 1.0], (n, 4)), zero, zero)


def pose_errors(scene: Scene, joint_row: Array, position: Array, orientation: Array) -> Array:
    """[n, joints] the largest violation of each joint by poses [n, solids, ...], m or rad."""
    n = len(position)
    largest, still = np.zeros((n, len(scene.joints))), np.zeros_like(position)
    for row in joint_row:
        if row["role"] == EQUALITY:
            ends = [
                frame_of(int(row[end]), position, orientation, still, still) for end in ("a", "b")
            ]
            violation, j = np.abs(measure(row, *ends)[0] - row["target"]), int(row["joint"])
            largest[:, j] = np.maximum(largest[:, j], violation)
    # perpendicular axes stay so if one of them is reversed
    solids: tuple[Body | Drive, ...] = (*scene.bodies, *scene.driven_bodies)
    for j, *of_joint, directions in held_axes(scene):
        now = [np.broadcast_to(directions, (n, *directions.shape))] * 2
        for e, end in enumerate(of_joint):
            if end is not None:
                fixed = rotate_back(np.array(solids[end].orientation), directions)
                now[e] = rotate(orientation[:, end, None], fixed[None])
        sine = np.linalg.norm(np.cross(now[0], now[1]), axis=-1)
        angle = np.arctan2(sine, (now[0] * now[1]).sum(-1))
        largest[:, j] = np.maximum(largest[:, j], angle.max(axis=1))
    return largest


def measure(row: Any, a: Frame, b: Frame) -> tuple[Array, Array]:
    """Value and rate [n] of a row, without its target."""
    spin = a.angular_velocity - b.angular_velocity
    if row["kind"] in (ALONG, DISTANCE):
        arm, other_arm = (
            rotate(a.orientation, row["point_a"]),
            rotate(b.orientation, row["point_b"]),
        )
        apart = a.position - b.position + (arm - other_arm)
        rate = a.velocity - b.velocity + np.cross(a.angular_velocity, arm)
        rate = rate - np.cross(b.angular_velocity, other_arm)
        if row["kind"] == DISTANCE:
            length = np.sqrt(_dot(apart, apart))
            return length, _dot(apart, rate) / length
        axis = rotate(b.orientation, row["axis_b"])
        turning = np.cross(b.angular_velocity, axis)
        return _dot(apart, axis), _dot(rate, axis) + _dot(apart, turning)
    u, w = rotate(a.orientation, row["axis_a"]), rotate(b.orientation, row["axis_b"])
    if row["kind"] == ANGLE:
        pivot = rotate(b.orientation, row["pivot"])
        return np.arctan2(_dot(u, np.cross(pivot, w)), _dot(u, w)), _dot(spin, pivot)
    return _dot(u, w), _dot(spin, np.cross(u, w))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ni,ni->n", a, b))
