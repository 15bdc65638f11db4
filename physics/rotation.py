"""Rotations: unit quaternions (x, y, z, w), rotation matrices, and their time derivatives.

With the angular velocity in the world frame (r' = omega x r, J = R J0 R^T) the quaternion moves as
q' = 1/2 omega (x) q. Some texts print q (x) omega, which belongs to an omega in the body frame; the
cross product of its vector part has the other sign. test_rotation.py checks this against the matrix
equation R' = omega x R.
"""

import math

import numpy as np

from physics.compiler.jit import stage

Array = np.ndarray


@stage
def rotation_entries(x, y, z, w):
    """The nine entries of the rotation matrix, row by row, of a unit quaternion."""
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    return (
        1.0 - 2.0 * (yy + zz),
        2.0 * (xy - wz),
        2.0 * (xz + wy),
        2.0 * (xy + wz),
        1.0 - 2.0 * (xx + zz),
        2.0 * (yz - wx),
        2.0 * (xz - wy),
        2.0 * (yz + wx),
        1.0 - 2.0 * (xx + yy),
    )


# rad: up to here the series of `rotate_quaternion` is exact to round-off
SMALL_ROTATION = 0.3


@stage
def compose(x, y, z, w, px, py, pz, c):
    """The product (p, c) (x) (x, y, z, w); one Newton step brings its length back to 1."""
    nx = c * x + w * px + (py * z - pz * y)
    ny = c * y + w * py + (pz * x - px * z)
    nz = c * z + w * pz + (px * y - py * x)
    nw = c * w - (px * x + py * y + pz * z)
    n = 1.5 - 0.5 * (nx * nx + ny * ny + nz * nz + nw * nw)
    return nx * n, ny * n, nz * n, nw * n


@stage
def rotate_quaternion(x, y, z, w, ax, ay, az):
    """Quaternion after a rotation by the world-frame rotation vector (ax, ay, az), in rad.

    The exponential map exp(a/2) (x) q, for angles up to SMALL_ROTATION: the series of sin(s)/s
    and cos(s) to s^10 need no branch and no trigonometric function, so LLVM can vectorise them.
    """
    s2 = 0.25 * (ax * ax + ay * ay + az * az)
    k = 0.5 - s2 * (0.5 / 6) * (1.0 - s2 * (1 / 20) * (1.0 - s2 * (1 / 42) * (1.0 - s2 * (1 / 72))))
    c = 1.0 - s2 * (1 / 2) * (
        1.0 - s2 * (1 / 12) * (1.0 - s2 * (1 / 30) * (1.0 - s2 * (1 / 56) * (1.0 - s2 * (1 / 90))))
    )
    return compose(x, y, z, w, k * ax, k * ay, k * az, c)


@stage
def rotate_quaternion_far(x, y, z, w, ax, ay, az):
    """As `rotate_quaternion`, by an angle of any size above zero."""
    s = 0.5 * math.sqrt(ax * ax + ay * ay + az * az)
    k = 0.5 * math.sin(s) / s
    return compose(x, y, z, w, k * ax, k * ay, k * az, math.cos(s))


def rotation_matrix(quaternion: Array) -> Array:
    """Rotation matrices of unit quaternions.

    Args:
        quaternion: [..., 4], x y z w.

    Returns:
        [..., 3, 3], body frame to world frame.
    """
    x, y, z, w = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    entries = rotation_entries(x, y, z, w)
    return np.stack(entries, axis=-1).reshape(*x.shape, 3, 3)


def rotate(quaternion: Array, vector: Array) -> Array:
    """Vectors [..., 3] rotated from the body frame into the world frame by quaternions [..., 4]."""
    return np.einsum("...ij,...j->...i", rotation_matrix(quaternion), vector)


def rotate_back(quaternion: Array, vector: Array) -> Array:
    """Vectors [..., 3] rotated from the world frame into the body frame by quaternions [..., 4]."""
    return np.einsum("...ji,...j->...i", rotation_matrix(quaternion), vector)


def multiply(p: Array, q: Array) -> Array:
    """Hamilton product p (x) q of quaternions [..., 4], x y z w: first q's rotation, then p's."""
    px, py, pz, pw = np.moveaxis(np.asarray(p, dtype=float), -1, 0)
    qx, qy, qz, qw = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    return np.stack(
        [
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
            pw * qw - px * qx - py * qy - pz * qz,
        ],
        axis=-1,
    )


def quaternion_rate(quaternion: Array, angular_velocity: Array) -> Array:
    """Q' = 1/2 omega (x) q, in 1/s; quaternion [..., 4], world-frame omega [..., 3] in rad/s."""
    omega = np.concatenate([angular_velocity, np.zeros_like(angular_velocity[..., :1])], axis=-1)
    return 0.5 * multiply(omega, quaternion)


def from_rotation_vector(vector: Array) -> Array:
    """Unit quaternions [..., 4] of rotation vectors [..., 3] in rad (axis times angle)."""
    vector = np.asarray(vector, dtype=float)
    angle = np.sqrt(np.sum(vector**2, axis=-1, keepdims=True))
    # np.sinc(x) is sin(pi x)/(pi x), which is right at zero too
    return np.concatenate(
        [0.5 * np.sinc(angle / (2 * np.pi)) * vector, np.cos(0.5 * angle)], axis=-1
    )


def from_yaw(yaw: Array) -> Array:
    """Unit quaternions [..., 4] of rotations about the world's z axis by yaw [...] in rad."""
    yaw = np.asarray(yaw, dtype=float)
    zero = np.zeros_like(yaw)
    return np.stack([zero, zero, np.sin(0.5 * yaw), np.cos(0.5 * yaw)], axis=-1)


def yaw(quaternion: Array) -> Array:
    """Yaw in rad of unit quaternions [..., 4]: the rotation about z in the order z, y, x."""
    x, y, z, w = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
