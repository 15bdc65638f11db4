"""Orientations as quaternions, rotation matrices or Euler angles, and their time derivatives.

The engine keeps unit quaternions (x, y, z, w), w >= 0. The other two are for users:

- Rotation matrices have nine numbers for three degrees of freedom. Integrated or rounded they stop
  being rotations; `orthogonalized` gives the nearest one.
- Euler angles are yaw, pitch and roll: about z, then about the new y, then about the new x, so
  R = Rz(yaw) Ry(pitch) Rx(roll). At a pitch of +-90 degrees yaw and roll turn about the same axis
  (gimbal lock): only their difference or sum is defined, and their rates are not.

All functions take any number of leading axes. Angular velocities are in the world frame.
"""

import math

import numpy as np

from physics.rotation import Array, from_rotation_vector, multiply

# below this distance from gimbal lock, in rad, yaw and roll can't be told apart: round-off
_LOCKED = 1e-12
# below this cosine of the pitch their rates would have lost six digits
_NEARLY_LOCKED = 1e-6


def from_matrix(matrix: Array) -> Array:
    """Unit quaternions [..., 4], w >= 0, of rotation matrices [..., 3, 3].

    The matrices have to be rotations to round-off; `orthogonalized` makes them so. Of the four
    components the largest comes first, from the trace, so that none is divided by a small number
    (Shepperd 1978).
    """
    R = np.asarray(matrix, dtype=float)
    trace = np.trace(R, axis1=-2, axis2=-1)[..., None]
    diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    x, y, z = (np.roll(np.arange(3), -k) for k in range(3))
    # 4 q_i q_j for all pairs: row i is proportional to q, with the factor 4 q_i
    products = np.empty((*R.shape[:-2], 4, 4))
    products[..., [0, 1, 2], [0, 1, 2]] = 1.0 - trace + 2.0 * diagonal
    products[..., 3, 3] = 1.0 + trace[..., 0]
    mixed = R + np.swapaxes(R, -1, -2)
    skew = np.swapaxes(R, -1, -2) - R  # [y, z]: 4 w x, and cyclically
    for i, j, k in zip(x, y, z, strict=True):
        products[..., i, j] = products[..., j, i] = mixed[..., i, j]
        products[..., i, 3] = products[..., 3, i] = skew[..., j, k]
    largest = np.argmax(np.diagonal(products, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    return _canonical(q / np.sqrt(np.sum(q * q, axis=-1, keepdims=True)))


def orthogonalized(matrix: Array) -> Array:
    """The rotation matrices nearest to matrices [..., 3, 3], in the Frobenius norm.

    Raises:
        ValueError: a matrix is singular or a reflection; no rotation is near it.
    """
    matrix = np.asarray(matrix, dtype=float)
    U, stretch, V = np.linalg.svd(matrix)
    determinant = np.linalg.det(matrix)
    if np.any(determinant <= 0.0) or not np.all(np.isfinite(stretch)):
        worst = np.min(determinant)
        raise ValueError(
            f"matrix has the determinant {worst:g}: it must be positive; a rotation has 1, a "
            "reflection -1"
        )
    return np.asarray(U @ V)


def from_euler(angles: Array) -> Array:
    """Unit quaternions [..., 4], w >= 0, of Euler angles [..., 3]: yaw, pitch, roll in rad."""
    angles = np.asarray(angles, dtype=float)
    about_x, about_y, about_z = (
        from_rotation_vector(angles[..., k : k + 1] * np.eye(3)[axis])
        for k, axis in ((2, 0), (1, 1), (0, 2))
    )
    return _canonical(multiply(multiply(about_z, about_y), about_x))


def to_euler(quaternion: Array) -> Array:
    """Euler angles [..., 3] of unit quaternions [..., 4]: yaw, pitch, roll in rad.

    Pitch is within +-pi/2, yaw and roll within +-pi. In gimbal lock the roll is 0. The formulas use
    half of the sum and of the difference of yaw and roll, which stay exact next to gimbal lock.
    """
    x, y, z, w = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    # with c, s of half the pitch: (c - s) cos, (c - s) sin of half the sum, and
    # (c + s) cos, (c + s) sin of half the difference
    down, up = np.hypot(x + z, w - y), np.hypot(z - x, w + y)
    half_sum, half_difference = np.arctan2(x + z, w - y), np.arctan2(z - x, w + y)
    half_sum = np.where(down < _LOCKED, half_difference, half_sum)
    half_difference = np.where(up < _LOCKED, half_sum, half_difference)
    pitch = 2.0 * np.arctan2(up, down) - 0.5 * math.pi
    angles = [half_sum + half_difference, pitch, half_sum - half_difference]
    angles = [np.remainder(a + math.pi, 2.0 * math.pi) - math.pi for a in angles]
    return np.stack(angles, axis=-1)


def matrix_rate(matrix: Array, angular_velocity: Array) -> Array:
    """R' = omega x R, in 1/s, column by column; matrix [..., 3, 3], omega [..., 3] in rad/s."""
    columns = np.swapaxes(np.asarray(matrix, dtype=float), -1, -2)
    turned = np.cross(np.asarray(angular_velocity, dtype=float)[..., None, :], columns)
    return np.swapaxes(turned, -1, -2)


def angular_velocity_of_euler(angles: Array, rates: Array) -> Array:
    """World-frame omega [..., 3] in rad/s, of Euler angles [..., 3] and their rates [..., 3]."""
    yaw, pitch, _ = np.moveaxis(np.asarray(angles, dtype=float), -1, 0)
    yaw_rate, pitch_rate, roll_rate = np.moveaxis(np.asarray(rates, dtype=float), -1, 0)
    level = np.cos(pitch) * roll_rate
    return np.stack(
        [
            np.cos(yaw) * level - np.sin(yaw) * pitch_rate,
            np.sin(yaw) * level + np.cos(yaw) * pitch_rate,
            yaw_rate - np.sin(pitch) * roll_rate,
        ],
        axis=-1,
    )


def euler_rates(angles: Array, angular_velocity: Array) -> Array:
    """Rates of yaw, pitch, roll [..., 3] in rad/s; world-frame omega [..., 3] in rad/s.

    Raises:
        ValueError: the pitch is +-90 degrees (gimbal lock); no rates give an omega then.
    """
    yaw, pitch, _ = np.moveaxis(np.asarray(angles, dtype=float), -1, 0)
    x, y, z = np.moveaxis(np.asarray(angular_velocity, dtype=float), -1, 0)
    if np.any(np.abs(np.cos(pitch)) < _NEARLY_LOCKED):
        worst = np.asarray(pitch).flat[np.argmin(np.abs(np.cos(pitch)))]
        raise ValueError(
            f"the pitch is {worst:g} rad: at +-pi/2 (gimbal lock) yaw and roll have no rates; use "
            "rotation.quaternion_rate"
        )
    roll_rate = (np.cos(yaw) * x + np.sin(yaw) * y) / np.cos(pitch)
    pitch_rate = np.cos(yaw) * y - np.sin(yaw) * x
    return np.stack([z + np.sin(pitch) * roll_rate, pitch_rate, roll_rate], axis=-1)


def _canonical(quaternion: Array) -> Array:
    """The same rotations with w >= 0."""
    return np.where(quaternion[..., 3:] < 0.0, -quaternion, quaternion)
