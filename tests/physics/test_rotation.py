"""Quaternions turn as the world-frame rotation matrix does, and stay of length one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from physics import Body, Box, Scene, rotation
from physics.reference.scenes import torque_free_box
from physics.world import World

rng = np.random.default_rng(0)
QUATERNIONS = Rotation.random(50, random_state=1).as_quat()
SPINS = rng.normal(size=(50, 3)) * 10.0


def cross_matrix(w):
    zero = np.zeros_like(w[..., 0])
    x, y, z = np.moveaxis(w, -1, 0)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def printed_matrix(q):
    """Q of the lesson, whose text says that omega is in the world frame."""
    x, y, z, w = np.moveaxis(q, -1, 0)
    rows = [[w, -z, y], [z, w, -x], [-y, x, w], [-x, -y, -z]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def test_the_quaternion_rate_is_that_of_the_matrix_equation():
    rate, step = rotation.quaternion_rate(QUATERNIONS, SPINS), 1e-5
    after = rotation.rotation_matrix(QUATERNIONS + step * rate)
    before = rotation.rotation_matrix(QUATERNIONS - step * rate)
    expected = cross_matrix(SPINS) @ rotation.rotation_matrix(QUATERNIONS)
    np.testing.assert_allclose((after - before) / (2 * step), expected, atol=1e-8)


def test_the_printed_matrix_of_the_lesson_takes_a_body_frame_spin():
    in_body = rotation.rotate_back(QUATERNIONS, SPINS)
    rate = rotation.quaternion_rate(QUATERNIONS, SPINS)
    by_body = 0.5 * np.einsum("nij,nj->ni", printed_matrix(QUATERNIONS), in_body)
    by_world = 0.5 * np.einsum("nij,nj->ni", printed_matrix(QUATERNIONS), SPINS)
    np.testing.assert_allclose(by_body, rate, atol=1e-12)
    assert np.abs(by_world - rate).max() > 1.0


@pytest.mark.parametrize(
    ("turn", "angle"),
    [(rotation.rotate_quaternion, angle) for angle in (0.0, 1e-12, 1e-3, 0.2999999)]
    + [(rotation.rotate_quaternion_far, angle) for angle in (1e-12, 0.3000001, 1.0, 3.1, 20.0)],
)
def test_a_turn_is_the_exponential_map_in_the_world_frame(turn, angle):
    axes = SPINS / np.linalg.norm(SPINS, axis=-1, keepdims=True)
    turned = np.array([turn(*q, *a) for q, a in zip(QUATERNIONS, angle * axes, strict=True)])
    expected = (Rotation.from_rotvec(angle * axes) * Rotation.from_quat(QUATERNIONS)).as_quat()
    sign = np.sign(np.sum(turned * expected, axis=-1, keepdims=True))
    np.testing.assert_allclose(turned, sign * expected, atol=4e-15)


def test_conversions_agree_with_scipy():
    np.testing.assert_allclose(
        rotation.rotation_matrix(QUATERNIONS),
        Rotation.from_quat(QUATERNIONS).as_matrix(),
        atol=1e-15,
    )
    product = rotation.multiply(QUATERNIONS, QUATERNIONS[::-1])
    expected = (Rotation.from_quat(QUATERNIONS) * Rotation.from_quat(QUATERNIONS[::-1])).as_quat()
    sign = np.sign(np.sum(product * expected, axis=-1, keepdims=True))
    np.testing.assert_allclose(product, sign * expected, atol=1e-15)
    vectors = np.concatenate([SPINS, np.zeros((1, 3))])
    np.testing.assert_allclose(
        rotation.rotation_matrix(rotation.from_rotation_vector(vectors)),
        Rotation.from_rotvec(vectors).as_matrix(),
        atol=1e-14,
    )


def test_rotate_back_undoes_rotate():
    there = rotation.rotate(QUATERNIONS, SPINS)
    np.testing.assert_allclose(there, Rotation.from_quat(QUATERNIONS).apply(SPINS), atol=1e-13)
    np.testing.assert_allclose(rotation.rotate_back(QUATERNIONS, there), SPINS, atol=1e-13)


def test_yaw_is_the_last_turn_about_z():
    yaws, pitches, rolls = rng.uniform(-1.5, 1.5, (3, 40)) * np.array([[2.0], [1.0], [2.0]])
    q = Rotation.from_euler("ZYX", np.stack([yaws, pitches, rolls], axis=-1)).as_quat()
    np.testing.assert_allclose(rotation.yaw(q), yaws, atol=1e-12)
    np.testing.assert_allclose(rotation.yaw(rotation.from_yaw(yaws)), yaws, atol=1e-15)


@pytest.mark.parametrize(("spin", "error"), [(12.5, 2e-6), (75.0, 1e-5), (1000.0, 2e-3)])
def test_a_tumbling_rod_keeps_its_energy(spin, error):
    """Its momentum would turn it far about its length in a step: by 0.95, 5.7 and 76 rad."""
    rod = Body(Box((0.0025, 0.003, 0.02)), mass=0.1, angular_velocity=(spin, spin, spin))
    world = World(Scene([rod], gravity=(0.0, 0.0, 0.0)))
    before = world.kinetic_energy()[0]
    for _ in range(20):
        world.advance(0.02)
        assert world.kinetic_energy()[0] == pytest.approx(before, rel=error)


def test_a_million_steps_leave_a_quaternion_at_length_one():
    world = World(torque_free_box((30.0, 1.0, 20.0)), "fast", count=1)
    world.advance(1e6 * world.fidelity.substep)
    assert abs(np.linalg.norm(world.orientation) - 1.0) < 1e-14
