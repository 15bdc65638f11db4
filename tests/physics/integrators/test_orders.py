"""Each integrator converges with its order: a top, an oscillator, Kepler's ellipse, drag."""

import math

import numpy as np
import pytest

from physics import Attractor, Body, Box, Drag, PointSpring
from tests.physics.integrators.top import (
    MOMENTS,
    SPIN,
    TOP,
    angle_between,
    exact_orientation,
    jacobi_spin,
    spin_in_body,
    world_of,
)

ORDERS = {"midpoint": 2, "euler": 1, "rk4": 4, "adaptive": 4}
MASS = 2.0
SLAB = Box((0.05, 0.03, 0.02))

every_integrator = pytest.mark.parametrize("integrator", ORDERS)


def slopes(errors):
    """Orders between errors at steps that are halved each time."""
    errors = np.array(errors)
    return np.log2(errors[:-1] / errors[1:])


def fixed_steps(body, integrator, substep, field=None):
    """A world with equal steps: the adaptive pair accepts every one at its largest tolerance."""
    return world_of(body, integrator, substep, field, tolerance=1.0)


@every_integrator
def test_a_torque_free_top_follows_jacobi_s_elliptic_functions_with_its_order(integrator):
    spin = jacobi_spin(MOMENTS, SPIN, np.array([1.0]))[0]
    orientation = exact_orientation(MOMENTS, SPIN, 1.0)
    errors = []
    for step in (2e-2, 1e-2, 5e-3):
        world = fixed_steps(TOP, integrator, step)
        world.advance(1.0)
        if integrator == "adaptive":
            assert world.steps == round(1.0 / step)
        angle = angle_between(world.orientation[0, 0], orientation)
        errors.append((np.abs(spin_in_body(world) - spin).max(), angle))
        assert np.abs(np.linalg.norm(world.orientation) - 1.0) < 1e-15
    np.testing.assert_allclose(slopes(errors), ORDERS[integrator], atol=0.1)


@every_integrator
@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_an_oscillator_has_its_period_and_decay_with_its_order(integrator, damping):
    decay = damping / (2.0 * MASS)
    fast = math.sqrt(25.0 - decay**2)
    time = 4.13 * math.pi  # not at a turning point, where errors of the phase hide
    swing = math.cos(fast * time) + decay / fast * math.sin(fast * time)
    expected = 0.3 * math.exp(-decay * time) * swing
    errors, coarse = [], 2e-3 if integrator == "euler" else 4e-2
    for step in (0.5 * coarse, 0.25 * coarse, 0.125 * coarse):
        body = Body(SLAB, mass=MASS, position=(0.3, 0.0, 0.0))
        world = fixed_steps(body, integrator, step, PointSpring(0, MASS * 25.0, damping))
        world.advance(time)
        errors.append(abs(float(world.position[0, 0, 0]) - expected))
    np.testing.assert_allclose(slopes(errors), ORDERS[integrator], atol=0.1)


@every_integrator
def test_keplers_ellipse_is_followed_with_its_order(integrator):
    e, time = 0.6, 2.0
    anomaly = time
    for _ in range(50):  # Kepler's equation, by Newton's method
        anomaly -= (anomaly - e * math.sin(anomaly) - time) / (1.0 - e * math.cos(anomaly))
    expected = math.cos(anomaly) - e, math.sqrt(1.0 - e**2) * math.sin(anomaly), 0.0
    speed, errors = math.sqrt((1.0 + e) / (1.0 - e)), []
    for step in (8e-3, 4e-3, 2e-3):
        body = Body(SLAB, mass=MASS, position=(1.0 - e, 0, 0), linear_velocity=(0, speed, 0))
        world = fixed_steps(body, integrator, step, Attractor((0, 0, 0), 1.0))
        world.advance(time)
        errors.append(np.abs(world.position[0, 0] - expected).max())
    np.testing.assert_allclose(slopes(errors), ORDERS[integrator], atol=0.1)


@every_integrator
def test_drag_slows_a_body_with_its_order(integrator):
    expected, errors = 4.0 / (1.0 + 0.7 * 4.0 / MASS), []
    for step in (5e-2, 2.5e-2, 1.25e-2) if ORDERS[integrator] == 4 else (4e-3, 2e-3, 1e-3):
        body = Body(SLAB, mass=MASS, linear_velocity=(0, 4, 0))
        world = fixed_steps(body, integrator, step, Drag(quadratic=0.7))
        world.advance(1.0)
        errors.append(abs(float(world.linear_velocity[0, 0, 1]) - expected))
    np.testing.assert_allclose(slopes(errors), ORDERS[integrator], atol=0.15)


@pytest.mark.parametrize(
    ("integrator", "drift"),
    [("midpoint", 5e-10), ("euler", np.inf), ("rk4", 1e-12), ("adaptive", 1e-12)],
)
def test_a_long_run_keeps_the_quaternion_the_momentum_and_almost_the_energy(
    integrator, drift, stress
):
    """100,000 steps of 1 ms, 10,000,000 with `make stress`: a drift may be 100 times as large.

    `drift` is that of the energy, relative. Midpoint's energy swings, but does not drift. Euler's
    is no error of round-off or of long times, but of the first order: it reaches a fifth in the
    short form.
    """
    frames = 1000 if stress else 10
    world = world_of(TOP, integrator, 1e-3, tolerance=1e-6)
    energy, momentum = float(world.kinetic_energy()[0]), world.angular_momentum().copy()
    for _ in range(frames):
        world.advance(10.0)
        assert abs(np.linalg.norm(world.orientation) - 1.0) < 1e-15
        np.testing.assert_array_equal(world.angular_momentum(), momentum)
    growth = 1 if integrator == "midpoint" else frames / 10
    assert abs(float(world.kinetic_energy()[0]) / energy - 1.0) < drift * growth


@pytest.mark.parametrize("integrator", ["midpoint", "euler"])
def test_an_oscillators_energy_does_not_drift(integrator, stress):
    body = Body(SLAB, mass=MASS, position=(0.3, 0.0, 0.0))
    world = world_of(body, integrator, 1e-3, PointSpring(0, MASS * 25.0))
    before = float(world.potential_energy()[0])
    for _ in range(1000 if stress else 10):
        world.advance(10.0)
        energy = float(world.kinetic_energy()[0] + world.potential_energy()[0])
        assert energy == pytest.approx(before, rel=3e-3)  # omega h / 2
