"""Joints that are hard to hold: energy never grows, and no joint comes apart."""

import math

import numpy as np
import pytest

from physics import Box, Hinge, Scene, SimulationDiverged, World
from tests.physics.constraints.jointed import about_y, energy, film, ghost, linkage, pendulum

FOUR_BARS = [(0.0, 0.0), (-0.1, 0.3), (0.35, 0.45), (0.4, 0.0)]


def energies(world, seconds, frame=0.01):
    """[frames] J; on the way the joints hold."""
    frames = film(world, frame, round(seconds / frame))
    assert frames.joint_error().max() < 1e-9
    return energy(frames)


@pytest.mark.parametrize("speed", [1.0, 10.0])
def test_a_parallelogram_passes_its_change_points_at_constant_energy(speed):
    """With all bars in a line, two motions are possible, and constraints depend on each other."""
    world = linkage([(0, 0), (0, 0.3), (0.5, 0.3), (0.5, 0)], gravity=(0, 0, 0))
    omega = np.array([(0, speed, 0), (0, 0, 0), (0, speed, 0)])
    crank, rocker = omega[0], world.position[0, 2] - (0.5, 0, 0)
    velocity = [np.cross(crank, world.position[0, 0]), np.cross(crank, (0, 0, 0.3)),
                np.cross(crank, rocker)]  # fmt: skip
    world.set_state(linear_velocity=np.array(velocity), angular_velocity=omega)
    before = float(energy(world)[0])
    np.testing.assert_allclose(energies(world, 10.0), before, rtol=1e-5)


def test_a_rhombus_that_folds_under_gravity_keeps_its_energy():
    world = linkage([(0, 0), (0.2, 0.3), (0.6, 0.3), (0.4, 0.0)])
    before, scale = float(energy(world)[0]), 3 * 9.81 * 0.3
    assert np.abs(energies(world, 10.0) - before).max() < 1e-3 * scale


@pytest.mark.parametrize("mass", [10.0, 1000.0])
def test_a_light_chain_with_a_heavy_end_never_gains_energy(mass):
    rods = 8
    bodies = [
        ghost(
            Box((0.02, 0.02, 0.1)) if i < rods - 1 else Box((0.1, 0.1, 0.1)),
            1.0 if i < rods - 1 else mass,
            position=(0.2 * i + 0.1, 0, 0),
            orientation=about_y(0.5 * math.pi),
        )
        for i in range(rods)
    ]
    joints = [Hinge(i, i - 1 if i else None, (0.2 * i, 0, 0), (0, 1, 0)) for i in range(rods)]
    world = World(Scene(bodies, joints=joints), "balanced")
    before, scale = float(energy(world)[0]), mass * 9.81 * 1.5
    gained = energies(world, 4.0).max() - before
    assert gained < 5e-3 * scale


@pytest.mark.parametrize("spin", [300.0, 1000.0])
def test_a_fast_pendulum_keeps_its_joint_and_gains_no_energy(spin):
    """At 2 ms it turns by 0.6 and 2 rad in a substep; up to 0.6 it loses none either."""
    world = pendulum(0.0, "balanced", gravity=(0, 0, 0))
    world.set_state(linear_velocity=(0.25 * spin, 0, 0), angular_velocity=(0, -spin, 0))
    before = float(energy(world)[0])
    found = energies(world, 0.5)
    assert found.max() < before * (1.0 + 1e-4)
    if spin == 300.0:
        assert found.min() > before * (1.0 - 1e-3)


def test_a_joint_that_cannot_be_held_is_named():
    world = linkage(FOUR_BARS, (1.0, 1.0, 1e6))
    with pytest.raises(SimulationDiverged, match=r"joint 2, a Hinge between 2 and 1, came apart"):
        world.advance(5.0)
