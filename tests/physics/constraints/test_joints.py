"""Joints agree with closed forms of mechanisms, and hold to round-off."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.special import ellipk

from physics import BallJoint, Box, Distance, Fidelity, Hinge, Scene, Slider, Weld, World
from tests.physics.constraints.jointed import (
    MASS,
    ROD,
    about_y,
    energy,
    film,
    ghost,
    linkage,
    pendulum,
    pendulum_inertia,
)

G = 9.81


def angles(world, frame, frames):
    """Times [n] in s and angles of the first joint [n] in rad."""
    shown = film(world, frame, frames)
    return shown.time, np.unwrap(shown.joint_position()[:, 0])


@pytest.mark.parametrize("amplitude", [1.4, 2.0])
def test_a_pendulum_has_its_period_by_the_elliptic_integral_for_a_minute(amplitude):
    world = pendulum(amplitude)
    before, weight = float(energy(world)[0]), MASS * G * 0.25
    times, swing = angles(world, 0.02, 3000)
    curve = CubicSpline(times, swing + amplitude)  # the angle from the vertical
    crossings = curve.roots(extrapolate=False)
    crossings = crossings[curve(crossings, 1) < 0.0]
    period = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
    slow = math.sqrt(weight / pendulum_inertia())
    exact = 4.0 / slow * ellipk(math.sin(0.5 * amplitude) ** 2)
    assert len(crossings) > 25
    assert period == pytest.approx(exact, rel=1e-6)
    assert abs(float(energy(world)[0]) - before) < 1e-6 * weight
    assert world.joint_error().max() < 1e-12


def test_a_pendulum_converges_with_order_two():
    ends = []
    for substep in (8e-3, 4e-3, 2e-3, 1e-3):
        world = pendulum(2.0, Fidelity(substep=substep))
        world.advance(2.4)
        ends.append(float(world.joint_position()[0, 0]))
    changes = np.abs(np.diff(ends))
    np.testing.assert_allclose(np.log2(changes[:-1] / changes[1:]), 2.0, atol=0.15)


def double_pendulum(fidelity):
    """Two rods, both horizontal at the start."""
    bodies = [ghost(position=(0.25 + 0.5 * i, 0, 0), orientation=about_y(-0.5 * math.pi))
              for i in range(2)]  # fmt: skip
    joints = [Hinge(0, None, (0, 0, 0), (0, -1, 0)), Hinge(1, 0, (0.5, 0, 0), (0, -1, 0))]
    return World(Scene(bodies, joints=joints), fidelity)


def double_pendulum_angles(time):
    """Angles of both rods from the vertical, by the equations of Lagrange."""
    inertia, length, arm = float(ROD.inertia(MASS)[1]), 0.5, 0.25

    def rate(_, y):
        a, b, p, q = y
        c, s = math.cos(a - b), math.sin(a - b)
        coupling = MASS * length * arm
        matrix = [[inertia + MASS * (arm**2 + length**2), coupling * c],
                  [coupling * c, inertia + MASS * arm**2]]  # fmt: skip
        right = [
            -coupling * s * q * q - MASS * G * (arm + length) * math.sin(a),
            coupling * s * p * p - MASS * G * arm * math.sin(b),
        ]
        return [p, q, *np.linalg.solve(matrix, right)]

    start = [0.5 * math.pi, 0.5 * math.pi, 0.0, 0.0]
    return solve_ivp(rate, (0.0, time), start, rtol=1e-11, atol=1e-12).y[:2, -1]


def test_a_double_pendulum_follows_the_equations_of_lagrange():
    world = double_pendulum("accurate")
    world.advance(1.5)
    first, second = world.joint_position()[0]
    exact = double_pendulum_angles(1.5)
    assert first + 0.5 * math.pi == pytest.approx(exact[0], abs=2e-5)
    assert math.remainder(first + second + 0.5 * math.pi - exact[1], 2 * math.pi) == pytest.approx(
        0.0, abs=2e-5
    )


def test_a_double_pendulum_keeps_its_energy(stress):
    world = double_pendulum("accurate")
    before = float(energy(world)[0])
    frames = film(world, 0.1, 600 if stress else 200)
    assert np.abs(energy(frames) - before).max() < 1e-4 * MASS * G
    assert world.joint_error().max() < 1e-12


def test_a_four_bar_linkage_stays_closed():
    """Four hinges hold three bars with three rows too many; those are left out."""
    world = linkage([(0.0, 0.0), (-0.1, 0.3), (0.35, 0.45), (0.4, 0.0)], (0.5, 0.7, 0.9))
    before, scale = float(energy(world)[0]), 2.1 * G * 0.3
    frames = film(world, 0.02, 500)
    assert frames.joint_error().max() < 1e-10
    assert np.abs(energy(frames) - before).max() < 2e-3 * scale
    assert np.ptp(frames.joint_position()[:, 0]) > 0.5  # it does move
    assert np.abs(world.position[0, :, 1]).max() < 1e-9


def test_a_heavy_symmetric_top_precesses_steadily():
    """I1 cos(theta) p^2 - I3 s p + m g l = 0 relates precession p and spin s about the axis."""
    wheel, mass, length, tilt, spin = Box((0.08, 0.08, 0.02)), 0.6, 0.15, 0.5, 180.0
    axial = float(wheel.inertia(mass)[2])
    across = float(wheel.inertia(mass)[0]) + mass * length**2
    a, b, c = across * math.cos(tilt), -axial * spin, mass * G * length
    slow = (-b - math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    axis = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    # omega = precession about z, and about the axis what makes its part along the axis the spin
    omega = slow * np.array([0, 0, 1]) + (spin - slow * math.cos(tilt)) * axis
    body = ghost(
        wheel,
        mass,
        position=length * axis,
        orientation=about_y(tilt),
        linear_velocity=np.cross(omega, length * axis),
        angular_velocity=omega,
    )
    world = World(Scene([body], joints=[BallJoint(0, None, (0, 0, 0))]), Fidelity(substep=5e-4))
    np.testing.assert_allclose(
        world.linear_acceleration[0, 0],
        -slow**2 * length * math.sin(tilt) * np.array([1.0, 0, 0]), atol=1e-9,
    )  # fmt: skip
    turned, before, heights = 0.0, 0.0, []
    for _ in range(400):
        world.advance(0.01)
        x, y, z = world.position[0, 0]
        turned += math.remainder(math.atan2(y, x) - before, 2 * math.pi)
        before = math.atan2(y, x)
        heights.append(z)
    assert turned == pytest.approx(4.0 * slow, rel=1e-4)
    assert np.ptp(heights) < 2e-5 * length
    assert world.joint_error().max() < 1e-12


def test_a_weld_makes_one_body_of_two():
    """A tumbling pair of welded boxes keeps energy, both momenta and its shape."""
    box = Box((0.05, 0.03, 0.02))
    spin = (3.0, 1.0, -2.0)
    places = np.array([(0.0, 0.0, 0.0), (0.05, 0.06, 0.0)])
    centre = places.mean(axis=0)
    bodies = [
        ghost(
            box,
            1.0,
            position=place,
            angular_velocity=spin,
            linear_velocity=np.cross(spin, place - centre),
        )
        for place in places
    ]
    world = World(Scene(bodies, gravity=(0, 0, 0), joints=[Weld(0, 1)]), Fidelity(substep=5e-4))
    before, angular = energy(world), world.angular_momentum()
    world.advance(3.0)
    np.testing.assert_allclose(world.angular_momentum(), angular, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(world.position.mean(axis=1)[0], centre, atol=1e-12)
    np.testing.assert_allclose(energy(world), before, rtol=1e-6)
    np.testing.assert_allclose(
        world.angular_velocity[0, 0], world.angular_velocity[0, 1], atol=1e-9
    )
    assert world.joint_error().max() < 1e-12


def test_a_slider_falls_along_its_axis_and_does_not_turn():
    axis = np.array([1.0, 0.0, -1.0]) / math.sqrt(2.0)
    scene = Scene([ghost(position=(0.3, 0.1, 2.0))], joints=[Slider(0, None, axis)])
    world = World(scene, Fidelity(substep=5e-4))
    world.advance(0.5)
    fallen = 0.5 * G / math.sqrt(2.0) * 0.5**2
    assert world.joint_position()[0, 0] == pytest.approx(fallen, rel=1e-9)
    assert world.joint_velocity()[0, 0] == pytest.approx(0.5 * G / math.sqrt(2.0), rel=1e-9)
    np.testing.assert_allclose(world.position[0, 0], (0.3, 0.1, 2.0) + fallen * axis, atol=1e-9)
    np.testing.assert_allclose(world.orientation[0, 0], (0, 0, 0, 1), atol=1e-12)


def test_two_bodies_on_a_rod_circle_their_centre():
    bodies = [
        ghost(mass=1.0, position=(0.3, 0, 0), linear_velocity=(0, 1.0, 0)),
        ghost(mass=3.0, position=(-0.1, 0, 0), linear_velocity=(0, -1.0 / 3.0, 0)),
    ]
    world = World(Scene(bodies, gravity=(0, 0, 0), joints=[Distance(0, 1, 0.4)]),
                       Fidelity(substep=2e-4))  # fmt: skip
    force = 1.0 * 1.0**2 / 0.3
    np.testing.assert_allclose(world.force()[0, 0], (-force, 0, 0), atol=1e-9)
    world.advance(0.6 * math.pi)
    np.testing.assert_allclose(world.position[0, 0], (0.3, 0, 0), atol=2e-6)
    np.testing.assert_allclose(world.linear_momentum(), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(world.force()[0], axis=1), force, rtol=1e-5)


def test_a_free_chain_keeps_both_momenta():
    bodies = [ghost(position=(0.5 * i, 0, 0), orientation=about_y(0.5 * math.pi),
                    angular_velocity=(0, 0, 2.0 * i), linear_velocity=(0, 0.3 * i**2, 0.1))
              for i in range(5)]  # fmt: skip
    joints = [BallJoint(i, i + 1, (0.25 + 0.5 * i, 0, 0)) for i in range(4)]
    world = World(Scene(bodies, gravity=(0, 0, 0), joints=joints), Fidelity(substep=1e-3))
    world.advance(1e-3)  # removes what the joints don't allow of the velocities
    linear, angular, before = world.linear_momentum(), world.angular_momentum(), energy(world)
    world.advance(2.0)
    np.testing.assert_allclose(world.linear_momentum(), linear, atol=1e-11)
    np.testing.assert_allclose(world.angular_momentum(), angular, atol=1e-10)
    np.testing.assert_allclose(energy(world), before, rtol=2e-4)


def test_forces_of_a_joint_are_those_of_the_moving_pendulum():
    """The centre's acceleration, from a state that was just set and after steps."""
    world = pendulum(1.0)
    rate = 3.0
    velocity = 0.25 * rate * np.array([math.cos(1.0), 0.0, math.sin(1.0)])
    world.set_state(linear_velocity=velocity, angular_velocity=(0, -rate, 0))
    for tolerance in (1e-9, 5e-3):  # after a step it is first order in the substep
        swing = 1.0 + float(world.joint_position()[0, 0])
        speed = float(world.joint_velocity()[0, 0])
        turning = -MASS * G * 0.25 * math.sin(swing) / pendulum_inertia()
        across = np.array([math.cos(swing), 0.0, math.sin(swing)])
        inward = np.array([-math.sin(swing), 0.0, math.cos(swing)])
        np.testing.assert_allclose(
            world.linear_acceleration[0, 0],
            0.25 * (turning * across + speed**2 * inward), atol=tolerance,
        )  # fmt: skip
        np.testing.assert_allclose(
            world.angular_acceleration[0, 0], (0, -turning, 0), atol=tolerance
        )
        world.advance(0.2)


def test_wrenches_turn_a_hinged_body_about_its_hinge():
    """A torque, and a force at its lower end across the arm, give it torque/inertia."""
    inertia, end = pendulum_inertia(), (0.0, 0.0, -0.5)
    for wrench in ({"torque": (0, -0.2, 0)}, {"force": (0.4, 0, 0), "point": end}):
        world = pendulum(0.0, gravity=(0, 0, 0))
        world.apply_wrench(body=0, **wrench)
        world.advance(0.02)
        rate = 0.2 * 0.02 / inertia
        assert float(world.joint_velocity()[0, 0]) == pytest.approx(rate, rel=1e-5)
        assert world.joint_error().max() < 1e-13
