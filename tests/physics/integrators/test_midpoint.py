"""Free flight is exact, free rotation second order, and what must be constant is."""

import numpy as np
import pytest

from physics import Fidelity, World
from physics.reference import closed_forms, scenes
from physics.rotation import rotate
from tests.physics.integrators.top import jacobi_spin, spin_in_body

MILLISECOND = Fidelity(substep=1e-3)


def moments_of(scene):
    (body,) = scene.bodies
    return body.shape.inertia(body.mass)


@pytest.mark.parametrize("fidelity", ["fast", "balanced", "accurate"])
def test_free_flight_is_a_parabola_to_round_off(fidelity):
    start, velocity = (0.1, -0.2, 10.0), (3.0, -2.0, 5.0)
    scene = scenes.sphere_on_ground(position=start, linear_velocity=velocity)
    world = World(scene, fidelity)
    for _ in range(7):
        world.advance(0.1)
    gravity = np.array([0.0, 0.0, -9.81])
    expected = closed_forms.ballistic(start, velocity, gravity, 0.7)
    np.testing.assert_allclose(world.position[0, 0], expected, rtol=1e-12)
    np.testing.assert_allclose(world.linear_velocity[0, 0], velocity + 0.7 * gravity, rtol=1e-12)


def test_a_tumbling_body_flies_along_the_same_parabola():
    spin, gravity = (30.0, -20.0, 10.0), np.array([0.0, 0.0, -9.81])
    scene = scenes.block_on_ground(
        (0.03, 0.02, 0.01), position=(0.0, 0.0, 10.0), angular_velocity=spin
    )
    world = World(scene)
    world.advance(1.0)
    np.testing.assert_allclose(
        world.position[0, 0],
        closed_forms.ballistic((0, 0, 10), np.zeros(3), gravity, 1.0),
        atol=1e-12,
    )


def test_a_ball_keeps_its_spin_and_turns_by_it():
    scene = scenes.sphere_on_ground(position=(0, 0, 10.0), angular_velocity=(0.0, 0.0, 2.0))
    world = World(scene)
    world.advance(1.0)
    np.testing.assert_array_equal(world.angular_velocity[0, 0], (0.0, 0.0, 2.0))
    np.testing.assert_allclose(
        world.orientation[0, 0], (0, 0, np.sin(1.0), np.cos(1.0)), atol=1e-13
    )


def test_a_torque_free_box_follows_jacobi_s_elliptic_functions():
    scene = scenes.torque_free_box()
    times = np.linspace(0.0, 2.0, 41)[1:]
    spin = np.array(scene.bodies[0].angular_velocity)
    expected = jacobi_spin(moments_of(scene), spin, times)
    world, seen = World(scene, MILLISECOND), []
    for _ in times:
        world.advance(0.05)
        seen.append(spin_in_body(world))
    np.testing.assert_allclose(seen, expected, atol=2e-4 * np.linalg.norm(spin))
    assert np.ptp(np.array(seen)[:, 1]) > 3.0  # it does tumble


def test_rotation_converges_with_the_square_of_the_step():
    scene = scenes.torque_free_box()

    def end(step):
        world = World(scene, Fidelity(substep=step))
        world.advance(0.5)
        return np.concatenate(
            [spin_in_body(world), rotate(world.orientation[0, 0], np.eye(3)).ravel()]
        )

    exact = jacobi_spin(moments_of(scene), np.array([3.0, 0.0, 5.0]), np.array([0.5]))[0]
    fine = end(0.125e-3)
    errors = np.array([np.abs(end(step) - fine).max() for step in (4e-3, 2e-3, 1e-3)])
    spins = np.array([np.abs(end(step)[:3] - exact).max() for step in (4e-3, 2e-3, 1e-3)])
    for e in (errors, spins):
        np.testing.assert_allclose(np.log2(e[:-1] / e[1:]), 2.0, atol=0.1)


def energy_error(spin, substep=1e-3):
    """Largest relative error of the kinetic energy in 10 s."""
    world = World(scenes.torque_free_box(spin), Fidelity(substep=substep))
    energy, momentum = world.kinetic_energy(), world.angular_momentum()
    worst = 0.0
    for _ in range(100):
        world.advance(0.1)
        worst = max(worst, abs(float(world.kinetic_energy()[0] / energy[0]) - 1.0))
    np.testing.assert_array_equal(world.angular_momentum(), momentum)
    return worst


@pytest.mark.parametrize("spin", [(3.0, 0.0, 5.0), (0.1, 5.0, 0.1), (3.0, 4.0, 5.0)])
def test_torque_free_rotation_keeps_energy_to_1e_6_and_momentum_to_the_last_bit(spin):
    assert energy_error(spin) <= 1e-6


@pytest.mark.parametrize("speed", [1.0, 5.0, 20.0])
def test_the_energy_of_a_tumbling_box_errs_by_the_square_of_its_turn_a_step(speed):
    spin = (0.6 * speed, 0.0, 0.8 * speed)
    assert energy_error(spin) <= 0.05 * (1e-3 * speed) ** 2


def test_a_spin_about_the_intermediate_axis_flips_over_and_back():
    world = World(scenes.torque_free_box((0.01, 10.0, 0.01)), MILLISECOND)
    along = []
    for _ in range(80):
        world.advance(0.1)
        along.append(spin_in_body(world)[1])
    assert min(along) < -9.9
    assert max(along[np.argmin(along) :]) > 9.9


@pytest.mark.parametrize("spin", [(10.0, 0.01, 0.01), (0.01, 0.01, 10.0)])
def test_a_spin_about_an_extreme_axis_stays(spin):
    world = World(scenes.torque_free_box(spin), MILLISECOND)
    for _ in range(40):
        world.advance(0.1)
        assert spin_in_body(world)[np.argmax(spin)] > 9.99
