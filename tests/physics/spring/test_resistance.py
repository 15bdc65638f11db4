"""Resistance against rolling and spinning, and viscous friction: closed forms, by both laws."""

import math

import numpy as np
import pytest

from physics import Body, Box, Fidelity, Ground, Material, Scene, Sphere, Static, World
from physics.reference import closed_forms, scenes
from physics.reference.scenes import GRAVITY, settled

RADIUS, LENGTH, FAR = 0.05, 0.002, 50.0  # m
TOLERANCE = {"balanced": 3e-3, "accurate": 5e-4, "solid": 5e-4}


def ball(angle=0.0, **material):
    """A ball on the ground that resists, at rest."""
    stuff = Material(0.5, 0.0, **material)
    gravity = scenes.tilted_gravity(angle)
    # the other ball and the post are out of reach, so that all springs here share a kernel
    bodies = [
        Body(Sphere(RADIUS), mass=0.1, position=(0, y, RADIUS), material=stuff) for y in (0, FAR)
    ]
    return Scene(bodies, [Ground(stuff), Static(Sphere(RADIUS), (0, 0, FAR))], gravity=gravity)


def roll(world, velocity, spin):
    """Gives the first body velocities, and leaves the others as they are."""
    linear, angular = world.linear_velocity.copy(), world.angular_velocity.copy()
    linear[0, 0], angular[0, 0] = velocity, spin
    world.set_state(linear_velocity=linear, angular_velocity=angular)


@pytest.mark.parametrize("fidelity", TOLERANCE)
def test_a_rolling_ball_stops_after_the_way_that_its_resistance_gives(fidelity):
    world = settled(ball(rolling_resistance=LENGTH), fidelity)
    start = world.position[0, 0, 0]
    roll(world, (1.0, 0, 0), (0, 1.0 / RADIUS, 0))
    world.advance(6.0)
    expected = closed_forms.rolling_distance(1.0, LENGTH, RADIUS, GRAVITY)
    way = world.position[0, 0, 0] - start
    assert way == pytest.approx(expected, rel=TOLERANCE[fidelity])
    assert np.abs(world.linear_velocity[0, 0]).max() < 1e-7
    assert np.abs(world.angular_velocity[0, 0]).max() < 1e-6


@pytest.mark.parametrize("fidelity", TOLERANCE)
def test_a_spinning_ball_slows_down_evenly_and_stops(fidelity):
    world = settled(ball(spinning_resistance=LENGTH), fidelity)
    roll(world, (0, 0, 0), (0.0, 0.0, 20.0))
    lasts = closed_forms.spinning_time(20.0, LENGTH, RADIUS, GRAVITY)
    world.advance(0.5 * lasts)
    assert world.angular_velocity[0, 0, 2] == pytest.approx(10.0, rel=1e-6)
    world.advance(0.7 * lasts)
    assert np.abs(world.angular_velocity[0, 0]).max() < 1e-9


@pytest.mark.parametrize("fidelity", TOLERANCE)
def test_a_ball_lies_still_on_a_slope_below_c_over_r_and_rolls_above(fidelity):
    slope = LENGTH / RADIUS
    below, angle = math.atan(0.9 * slope), math.atan(1.5 * slope)
    world = settled(ball(below, rolling_resistance=LENGTH), fidelity, time=5.0)
    start = world.position[0, 0].copy()
    world.advance(5.0)
    assert np.abs(world.position[0, 0] - start).max() < 1e-9
    world = settled(ball(angle, rolling_resistance=LENGTH), fidelity)
    before = world.linear_velocity[0, 0, 0]
    world.advance(1.0)
    expected = 5 / 7 * GRAVITY * (math.sin(angle) - slope * math.cos(angle))
    gained = world.linear_velocity[0, 0, 0] - before
    assert gained == pytest.approx(expected, rel=2 * TOLERANCE[fidelity])


def test_resistance_acts_on_both_bodies_of_a_pair():
    """Two balls in free fall, pressed together by their approach: angular momentum is kept."""
    stuff = Material(0.5, 0.0, rolling_resistance=LENGTH, spinning_resistance=LENGTH)
    bodies = [
        Body(Sphere(RADIUS), mass=0.1, position=(0, 0, x), linear_velocity=(0, 0, -10 * x),
             angular_velocity=(3.0, 0.0, 40.0 * x), material=stuff)
        for x in (-0.051, 0.051)
    ]  # fmt: skip
    around = [Ground(height=-FAR), Static(Sphere(RADIUS), (FAR, 0, 0))]  # as in `ball`
    world = World(Scene(bodies, around))
    momentum, spin = world.angular_momentum(), np.ptp(world.angular_velocity[0, :2, 2])
    world.advance(0.2)
    np.testing.assert_allclose(world.angular_momentum(), momentum, atol=1e-15)
    assert np.ptp(world.angular_velocity[0, :2, 2]) < spin * (1 - 1e-6)


@pytest.mark.parametrize("name", ["rolling_resistance", "spinning_resistance"])
def test_a_resistance_is_a_length_and_not_negative(name):
    with pytest.raises(ValueError, match=rf"Material\.{name} must be finite and at least 0"):
        Material(**{name: -1e-3})
    with pytest.raises(TypeError, match=rf"Material\.{name} must be a number, got 'soft'"):
        Material(**{name: "soft"})


# --- viscous friction ---------------------------------------------------------------------------

VISCOUS = Fidelity(friction="viscous")


def settled_block(time=1.0, **scene):
    """A cube that has come to rest, with a small kernel: no other test has viscous springs."""
    world = World(scenes.block_on_ground(**scene), VISCOUS, kernel="special")
    world.advance(time)
    return world


def test_viscous_friction_is_coulombs_while_the_slip_is_fast():
    world = settled_block()
    world.set_state(linear_velocity=(2.0, 0.0, 0.0))
    world.advance(0.2)
    expected = 2.0 - 0.5 * GRAVITY * 0.2
    assert world.linear_velocity[0, 0, 0] == pytest.approx(expected, rel=1e-3)


def test_viscous_friction_creeps_where_coulombs_holds():
    """At m g sin = c v: slow, and so is what a user pays with."""
    angle = math.radians(10.0)
    world = settled_block(2.0, angle=angle)
    damping = float(world._simulation.model.half_pair["shear_damping"][0])
    expected = 0.1 * GRAVITY * math.sin(angle) / damping
    assert world.linear_velocity[0, 0, 0] == pytest.approx(expected, rel=1e-6)
    assert expected < 0.02


def test_viscous_friction_needs_no_memory():
    scene = Scene([Body(Box((0.02,) * 3), mass=0.1)], [Ground()])
    assert World(scene, VISCOUS).nbytes < World(scene).nbytes


def test_viscous_friction_belongs_to_the_spring_law():
    with pytest.raises(ValueError, match=r"Fidelity\.friction 'viscous' requires law='spring'"):
        Fidelity(law="impulse", friction="viscous")
