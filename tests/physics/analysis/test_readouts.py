"""Accelerations, inertia and its derivative, and points of bodies, against differences and laws."""

import numpy as np
import pytest

from physics import Body, Box, Fidelity, Ground, Scene, World

SLAB = Box((0.05, 0.03, 0.02))
MASS = 2.0
TICK = 1e-5


def tumbling(**state):
    q = np.array([0.3, -0.2, 0.5, 0.7])
    body = Body(SLAB, mass=MASS, orientation=tuple(q / np.linalg.norm(q)),
                linear_velocity=(1, 2, 3), angular_velocity=(4, -5, 6), **state)  # fmt: skip
    return World(Scene([body]), Fidelity(substep=TICK), count=2)


def difference(read):
    """Central difference of a reading in time, and the world in its middle."""
    world = tumbling()
    values = []
    for _ in range(2):
        values.append(read(world).copy())
        world.advance(2 * TICK)
    middle = tumbling()
    middle.advance(TICK)
    return (values[1] - values[0]) / (2 * TICK), middle


def test_a_free_body_accelerates_by_gravity_and_turns_by_eulers_equations():
    rate, world = difference(lambda w: w.angular_velocity)
    np.testing.assert_allclose(world.angular_acceleration, rate, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(world.linear_acceleration, [[[0, 0, -9.81]]] * 2, rtol=1e-12)
    np.testing.assert_allclose(world.force(), [[[0, 0, -9.81 * MASS]]] * 2, rtol=1e-12)
    np.testing.assert_array_equal(world.torque(), 0.0)


def test_the_inertia_tensor_turns_with_the_body():
    rate, world = difference(lambda w: w.inertia())
    np.testing.assert_allclose(world.inertia_rate(), rate, rtol=1e-4, atol=1e-7)
    J = world.inertia()[0, 0]
    np.testing.assert_allclose(np.sort(np.linalg.eigvalsh(J)), np.sort(SLAB.inertia(MASS)))
    spin = world.angular_velocity[0, 0]
    np.testing.assert_allclose(0.5 * spin @ J @ spin + 0.5 * MASS * np.sum(
        world.linear_velocity[0, 0] ** 2), world.kinetic_energy()[0])  # fmt: skip


def test_a_point_of_a_body_moves_as_its_velocity_and_acceleration_say():
    point = np.array([0.05, -0.03, 0.01])
    rate, world = difference(lambda w: w.point_velocity(0, point))
    np.testing.assert_allclose(world.point_acceleration(0, point), rate, rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(
        world.point_velocity("body 0", (0, 0, 0)), world.linear_velocity[:, 0], rtol=1e-15
    )


@pytest.mark.parametrize("preset", ["balanced", "solid"])
def test_forces_on_a_body_at_rest_cancel(preset):
    world = World(Scene([Body(SLAB, mass=MASS, position=(0, 0, 0.02))], [Ground()]), preset)
    world.advance(2.0)
    np.testing.assert_allclose(world.force(), 0.0, atol=1e-6 * MASS * 9.81)
    np.testing.assert_allclose(world.torque(), 0.0, atol=1e-8)


def test_a_reading_changes_no_bit():
    plain, read = tumbling(), tumbling()
    for _ in range(3):
        read.force(), read.angular_acceleration, read.inertia_rate()
        for world in (plain, read):
            world.advance(0.01)
    np.testing.assert_array_equal(plain.orientation, read.orientation)
    with pytest.raises(ValueError, match="body must be the name or index of a body, got 'x'"):
        read.point_velocity("x", (0, 0, 0))
