"""Conversions of orientations agree with scipy, at gimbal lock too, and rates with differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from physics import orientation, rotation

RANDOM = Rotation.random(1000, random_state=2)
RNG = np.random.default_rng(3)
SPINS = RNG.normal(size=(1000, 3))
# yaw, pitch, roll in gimbal lock and next to it
LOCKED = np.array(
    [
        (yaw, sign * (0.5 * np.pi - off), roll)
        for yaw in (-3.0, 0.0, 0.4, 2.0)
        for roll in (-2.0, 0.0, 1.5)
        for sign in (-1.0, 1.0)
        for off in (0.0, 1e-15, 1e-9, 1e-6, 1e-3)
    ]
)


def same(p, q, atol=1e-14):
    """Quaternions with w >= 0 of the same rotations."""
    assert np.all(p[..., 3] >= 0.0)
    np.testing.assert_allclose(np.abs(np.sum(p * q, axis=-1)), 1.0, atol=atol)
    np.testing.assert_allclose(np.sum(p * p, axis=-1), 1.0, atol=atol)


def test_matrices_become_quaternions_as_in_scipy():
    same(orientation.from_matrix(RANDOM.as_matrix()), RANDOM.as_quat())


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -2, 3)])
@pytest.mark.parametrize("angle", [0.0, 1e-9, np.pi - 1e-9, np.pi])
def test_half_turns_lose_no_digits(axis, angle):
    turn = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis))
    found = orientation.from_matrix(turn.as_matrix())
    np.testing.assert_allclose(rotation.rotation_matrix(found), turn.as_matrix(), atol=1e-15)


def test_euler_angles_are_those_of_scipy():
    angles = orientation.to_euler(RANDOM.as_quat())
    np.testing.assert_allclose(angles, RANDOM.as_euler("ZYX"), atol=1e-13)
    same(orientation.from_euler(angles), RANDOM.as_quat())
    np.testing.assert_allclose(angles[:, 0], rotation.yaw(RANDOM.as_quat()), atol=1e-13)


def test_in_gimbal_lock_the_angles_give_the_same_rotation():
    exact = Rotation.from_euler("ZYX", LOCKED)
    angles = orientation.to_euler(exact.as_quat())
    assert np.all(np.isfinite(angles))
    assert np.all(np.abs(angles[:, 1]) <= 0.5 * np.pi)
    same(orientation.from_euler(angles), exact.as_quat())
    np.testing.assert_allclose(
        rotation.rotation_matrix(orientation.from_euler(angles)), exact.as_matrix(), atol=1e-14
    )


def test_exactly_in_gimbal_lock_the_roll_is_zero():
    half = np.sqrt(0.5)
    angles = orientation.to_euler(np.array([(0.0, half, 0.0, half), (0.0, -half, 0.0, half)]))
    np.testing.assert_allclose(
        angles, [(0.0, 0.5 * np.pi, 0.0), (0.0, -0.5 * np.pi, 0.0)], atol=1e-15
    )


def test_angles_outside_their_ranges_are_the_same_rotations():
    angles = RNG.uniform(-20.0, 20.0, (200, 3))
    same(orientation.from_euler(angles), Rotation.from_euler("ZYX", angles).as_quat(), 1e-13)


def test_a_drifted_matrix_becomes_the_nearest_rotation():
    drifted = RANDOM.as_matrix() + 1e-3 * RNG.normal(size=(1000, 3, 3))
    nearest = orientation.orthogonalized(drifted)
    identity = np.einsum("nij,nkj->nik", nearest, nearest)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(nearest), 1.0, atol=1e-14)
    distance = np.linalg.norm(drifted - nearest, axis=(1, 2))
    for turn in RNG.normal(size=(20, 3)) * 1e-3:
        other = Rotation.from_rotvec(turn).as_matrix() @ nearest
        assert np.all(np.linalg.norm(drifted - other, axis=(1, 2)) > distance)


@pytest.mark.parametrize("matrix", [np.diag([1.0, 1.0, -1.0]), np.zeros((3, 3))])
def test_no_rotation_is_near_a_reflection_or_a_singular_matrix(matrix):
    with pytest.raises(ValueError, match=r"determinant -?[01]: it must be positive"):
        orientation.orthogonalized(matrix)


def test_integrated_by_its_rate_a_matrix_turns_as_the_quaternion_does():
    R, step = RANDOM.as_matrix(), 1e-6
    rate = orientation.matrix_rate(R, SPINS)
    turned = (Rotation.from_rotvec(step * SPINS) * RANDOM).as_matrix()
    back = (Rotation.from_rotvec(-step * SPINS) * RANDOM).as_matrix()
    np.testing.assert_allclose(rate, (turned - back) / (2.0 * step), atol=1e-8)


def test_euler_rates_are_those_of_the_angles():
    angles, step = orientation.to_euler(RANDOM.as_quat()), 1e-6
    clear = np.abs(np.cos(angles[:, 1])) > 0.05
    rates = orientation.euler_rates(angles[clear], SPINS[clear])
    turned = orientation.to_euler((Rotation.from_rotvec(step * SPINS) * RANDOM).as_quat()[clear])
    back = orientation.to_euler((Rotation.from_rotvec(-step * SPINS) * RANDOM).as_quat()[clear])
    change = np.remainder(turned - back + np.pi, 2.0 * np.pi) - np.pi
    np.testing.assert_allclose(rates, change / (2.0 * step), atol=1e-5)
    spin = orientation.angular_velocity_of_euler(angles[clear], rates)
    np.testing.assert_allclose(spin, SPINS[clear], atol=1e-12)


def test_in_gimbal_lock_there_are_no_euler_rates():
    with pytest.raises(ValueError, match=r"pitch is 1\.5708 rad: .*gimbal lock"):
        orientation.euler_rates((0.3, 0.5 * np.pi, 0.1), (1.0, 0.0, 0.0))
