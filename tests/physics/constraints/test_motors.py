"""Limits stop and only push; motors reach their velocity with a limited force."""

import math

import numpy as np
import pytest

from physics import Box, Drive, Fidelity, Hinge, Motor, Scene, Slider, World
from physics.rotation import rotate_back
from tests.physics.constraints.jointed import (
    MASS,
    energy,
    ghost,
    linkage,
    pendulum,
    pendulum_inertia,
)

G = 9.81


def test_a_limit_stops_a_pendulum_and_holds_it():
    """It stops without a rebound, never passes the limit, and never gains energy."""
    world = pendulum(1.2, "balanced", limits=(-0.9, 0.5))
    before = float(energy(world)[0])
    for _ in range(300):
        world.advance(0.01)
        assert -0.9 - 1e-9 <= world.joint_position()[0, 0] <= 0.5
        assert float(energy(world)[0]) < before + 1e-6
        before = float(energy(world)[0])
    assert world.joint_position()[0, 0] == pytest.approx(-0.9, abs=1e-12)
    assert world.joint_velocity()[0, 0] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(world.force()[0, 0], 0.0, atol=1e-7)


def test_a_limit_lets_go():
    world = pendulum(1.2, "balanced", limits=(-0.9, 0.5), motor=Motor(20.0, -1.0))
    world.advance(2.0)
    assert world.joint_position()[0, 0] == pytest.approx(-0.9, abs=1e-9)
    world.command_motors(1.0)
    world.advance(0.5)
    assert world.joint_position()[0, 0] == pytest.approx(-0.4, abs=6e-3)  # it has to start


def test_a_motor_accelerates_with_its_limit_and_then_keeps_its_velocity():
    joint = Hinge(0, None, (0, 0, 0), (0, 0, 1), motor=Motor(0.02, 2.0))
    body = ghost()
    world = World(Scene([body], gravity=(0, 0, 0), joints=[joint]), Fidelity(substep=1e-3))
    inertia = float(body.shape.inertia(MASS)[2])
    world.advance(0.01)
    assert world.joint_velocity()[0, 0] == pytest.approx(0.02 / inertia * 0.01, rel=0.06)
    world.advance(2.0)
    assert world.joint_velocity()[0, 0] == pytest.approx(2.0, rel=1e-9)
    world.command_motors([[-1.0]])
    world.advance(2.0)
    assert world.joint_velocity()[0, 0] == pytest.approx(-1.0, rel=1e-9)


def test_a_motor_holds_what_its_torque_can_hold():
    """A horizontal pendulum: it needs m g l; with less it falls with what is left."""
    needed = MASS * G * 0.25
    strong = pendulum(0.5 * math.pi, "balanced", motor=Motor(1.01 * needed))
    strong.advance(1.0)
    assert abs(strong.joint_position()[0, 0]) < 1e-6
    weak = pendulum(0.5 * math.pi, Fidelity(substep=5e-4), motor=Motor(0.4 * needed))
    weak.advance(0.05)
    falls = -0.5 * 0.6 * needed / pendulum_inertia() * 0.05**2
    assert weak.joint_position()[0, 0] == pytest.approx(falls, rel=0.02)


def test_a_slider_with_motor_lifts_to_its_limit():
    joint = Slider(0, None, (0, 0, 1), limits=(-0.1, 0.2), motor=Motor(1.5 * MASS * G, 0.5))
    world = World(Scene([ghost()], joints=[joint]), "balanced")
    world.advance(0.3)
    # the first 0.1 s accelerate with half of g
    assert world.joint_velocity()[0, 0] == pytest.approx(0.5, rel=1e-6)
    assert world.joint_position()[0, 0] == pytest.approx(
        0.5 * 0.3 - 0.5 * 0.5**2 / (0.5 * G), abs=2e-3
    )
    world.advance(1.0)
    assert world.joint_position()[0, 0] == pytest.approx(0.2, abs=1e-9)


def test_worlds_have_motors_of_their_own_and_neighbours_change_no_bit():
    motor = Motor(3.0)
    many = pendulum(1.2, "balanced", count=19, limits=(-1.0, 0.8), motor=motor)
    speeds = np.linspace(-2.0, 2.0, 19)[:, None]
    many.command_motors(speeds)
    alone = pendulum(1.2, "balanced", limits=(-1.0, 0.8), motor=motor)
    alone.command_motors(speeds[17])
    for _ in range(20):
        many.advance(0.04)
        alone.advance(0.04)
    np.testing.assert_array_equal(many.position[17], alone.position[0])
    np.testing.assert_array_equal(many.angular_velocity[17], alone.angular_velocity[0])
    assert np.ptp(many.joint_position()) > 0.5
    saved = many.snapshot()
    many.advance(0.2)
    after = many.position.copy()
    many.command_motors(0.0)
    many.restore(saved)
    many.advance(0.2)
    np.testing.assert_array_equal(many.position, after)
    many.reset()
    many.advance(1.0)
    np.testing.assert_array_equal(many.position[0], many.position[18])


def test_a_servo_turns_to_its_set_point_and_holds_a_load():
    """It approaches as exp(-frequency t) where its force suffices."""
    world = pendulum(1.0, Fidelity(substep=1e-3), motor=Motor(40.0, position=0.0, frequency=20.0))
    world.move_motors(-0.3)
    world.advance(0.2)
    assert world.joint_position()[0, 0] == pytest.approx(-0.3 * (1 - math.exp(-4.0)), abs=5e-3)
    world.advance(1.0)
    assert world.joint_position()[0, 0] == pytest.approx(-0.3, abs=1e-6)
    world.move_motors(math.pi - 1.0)  # upright
    world.advance(1.5)
    world.move_motors(-0.9 * math.pi)  # the shorter way, through pi
    world.advance(0.05)
    assert world.joint_position()[0, 0] > math.pi - 1.0
    world.advance(1.0)
    assert world.joint_position()[0, 0] == pytest.approx(-0.9 * math.pi, abs=1e-6)


def test_a_body_on_a_drive_turns_with_a_limited_torque():
    """A drive translates; a body on a hinge with a servo makes it turn."""
    drive = Drive(Box((0.02, 0.02, 0.02)), mass=1.0, force_limit=50.0, name="carriage", mask=0)
    wheel = ghost(position=(0, 0, 0.1))
    joint = Hinge(0, "carriage", (0, 0, 0.1), (0, 0, 1), motor=Motor(1.0, position=0.0))
    world = World(Scene([wheel], drives=[drive], joints=[joint]), Fidelity(substep=1e-3))
    world.move_drives((0.3, 0.0, 0.0), 0.5)
    world.move_motors(1.2)
    world.advance(1.5)
    assert world.joint_position()[0, 0] == pytest.approx(1.2, abs=1e-6)
    sag = MASS * G / (1.0 * 60.0**2)  # of the servo, under the body's weight
    np.testing.assert_allclose(world.drive_position[0, 0], (0.3, 0, -sag), atol=1e-5)
    np.testing.assert_allclose(world.position[0, 0], (0.3, 0, 0.1 - sag), atol=1e-5)
    assert world.joint_error().max() < 1e-12
    with pytest.raises(ValueError, match="violate joint 0, a Hinge between 0 and 'carriage'"):
        world.set_state(drive_position=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("limits", "spin", "end"), [((-1.0, 3.1), 160.0, 3.1), ((-2.8, 2.9), -400.0, -2.8)]
)
def test_a_limit_near_half_a_turn_stops_a_fast_body(limits, spin, end):
    """In a substep it passes the angle pi, where the angle jumps by a full turn."""
    world = pendulum(0.0, "balanced", gravity=(0, 0, 0), limits=limits)
    world.set_state(linear_velocity=(0.25 * spin, 0, 0), angular_velocity=(0, -spin, 0))
    world.advance(0.1)
    assert float(world.joint_position()[0, 0]) == pytest.approx(end, abs=1e-9)
    assert float(world.kinetic_energy()[0]) < 1e-12


def test_a_servo_between_limits_takes_the_way_that_is_free():
    motor = Motor(50.0, position=-2.9)
    world = pendulum(0.0, "balanced", limits=(-3.0, 2.7), motor=motor)
    world.advance(1.0)
    assert float(world.joint_position()[0, 0]) == pytest.approx(-2.9, abs=1e-3)
    world.move_motors(2.6)  # across pi it would be nearer
    world.advance(3.0)
    assert float(world.joint_position()[0, 0]) == pytest.approx(2.6, abs=1e-3)


def test_a_servo_with_a_set_point_beyond_a_limit_rests_at_the_limit():
    world = pendulum(0.0, "balanced", limits=(-1.0, 1.0), motor=Motor(20.0, position=2.0))
    world.advance(3.0)
    assert float(world.joint_position()[0, 0]) == pytest.approx(1.0, abs=1e-3)
    assert abs(float(world.joint_velocity()[0, 0])) < 1e-3


@pytest.mark.parametrize("frequency", [300.0, 1e6])
def test_a_servo_faster_than_the_substep_does_not_overshoot(frequency):
    motor = Motor(5000.0, position=1.0, frequency=frequency)
    world = pendulum(0.0, "balanced", motor=motor)
    for _ in range(50):
        world.advance(0.002)
        assert float(world.joint_position()[0, 0]) < 1.0 + 1e-3
    assert float(world.joint_position()[0, 0]) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("driven", [(0, 1), (0, 3), (0, 1, 2)])
def test_motors_that_contradict_each_other_do_not_open_a_linkage(driven):
    """Four bars have one motion; a motor that depends on the others is left out."""
    corners = [(0.0, 0.0), (-0.1, 0.3), (0.35, 0.45), (0.4, 0.0)]
    world = linkage(corners, motors={i: Motor(500.0, 1.0) for i in driven})
    for _ in range(20):
        world.advance(0.01)
        assert world.joint_error().max() < 1e-9
    for i, (a, b) in enumerate([(0, None), (1, 0), (2, 1), (2, None)]):
        anchor, rates = np.array(world.scene.joints[i].anchor), []
        for end in (a, b):
            if end is None:
                rates.append(np.zeros(3))
                continue
            body = world.scene.bodies[end]
            point = rotate_back(np.array(body.orientation), anchor - np.array(body.position))
            rates.append(world.point_velocity(end, point)[0])
        assert np.abs(rates[0] - rates[1]).max() < 1e-9
