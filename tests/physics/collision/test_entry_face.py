"""The face through which samples came in follows from the state of the pair alone."""

import math

import numpy as np
import pytest

from physics import Body, Box, Compound, Cylinder, Ground, Scene, Sphere, World
from physics.scene.fidelity import NEWTON, PRESETS

FIDELITIES = {**PRESETS, "newton": NEWTON}
LEVELS = pytest.mark.parametrize("level", FIDELITIES)
HALF = 0.02  # m, half width of a cube
CUBE = Box((HALF, HALF, HALF))


def bodies(shape, places, orientation=(0.0, 0.0, 0.0, 1.0)):
    """Equal solids on a ground."""
    return Scene(
        [Body(shape, mass=0.1, position=place, orientation=orientation) for place in places],
        [Ground()],
    )


@pytest.mark.parametrize("aside", [0.0, 2e-4])
@LEVELS
def test_a_tower_at_rest_stands_when_its_state_is_set_again(level, aside):
    count = 3 if level == "fast" else 5  # the tallest towers that `fast` promises
    places = [(aside * (n % 2), 0.0, HALF * (1 + 2 * n)) for n in range(count)]
    world = World(bodies(CUBE, places), FIDELITIES[level])
    world.advance(1.0)
    before = world.position[0, :, 2]
    world.set_state(time=0.0)
    world.advance(1.0)
    np.testing.assert_allclose(world.position[0, :, 2], before, atol=3e-5)  # it still settles


def test_a_tower_at_rest_stands_when_parameters_are_set_again():
    places = [(0.0, 0.0, HALF * (1 + 2 * n)) for n in range(5)]
    world = World(bodies(CUBE, places), per_world_parameters=True)
    world.advance(1.0)
    before = world.position[0, :, 2]
    world.set_parameters(mass=0.1)
    world.advance(1.0)
    np.testing.assert_allclose(world.position[0, :, 2], before, atol=3e-5)


@pytest.mark.parametrize("half_extents", [CUBE.half_extents, (0.06, 0.05, 0.005), (0.4, 0.3, 0.5)])
@LEVELS
def test_overlapping_boxes_come_to_rest_on_each_other(level, half_extents):
    height = half_extents[2]
    quarter = (0.0, 0.0, math.sin(0.2), math.cos(0.2))  # their edges aren't the world's axes
    for overlap in (0.05, 0.2):
        places = [(0.0, 0.0, height), (0.0, 0.0, (3.0 - overlap) * height)]
        world = World(bodies(Box(half_extents), places, quarter), FIDELITIES[level])
        world.advance(2.0)
        lower, upper = world.position[0, :, 2]
        sinks = height - lower
        # a pair of equal boxes has half the stiffness of a box and the ground and carries one box,
        # not two, so the upper box sinks by as much as the lower one: m g / (m w^2 / 2)
        sunk = 3.0 * height - upper
        least = (2.0 - 0.02) * sinks - 1e-6 * height
        # thrown up, it may land beside the lower one's edges: fewer samples share the load
        assert least < sunk < 4.0 * sinks
        assert np.abs(world.linear_velocity).max() < 1e-4


@LEVELS
def test_overlapping_cylinders_and_compounds_come_to_rest_on_each_other(level):
    three = Compound([(CUBE, (2.0 * HALF * n, 0.0, 0.0)) for n in (-1, 0, 1)])
    for shape in (Cylinder(HALF, HALF), three):
        places = [(0.0, 0.0, HALF), (0.0, 0.0, 3.0 * HALF - 2e-3)]
        world = World(bodies(shape, places), FIDELITIES[level])
        world.advance(2.0)
        lower, upper = world.position[0, :, 2]
        assert upper == pytest.approx(3.0 * HALF - 2.0 * (HALF - lower), rel=0.01)


@pytest.mark.parametrize("aside", [0.0, 1e-3])
@pytest.mark.parametrize("overlap", [3e-3, 5e-3])
@LEVELS
def test_overlapping_neighbours_part_along_the_shallowest_axis(level, overlap, aside):
    for axis in (0, 1):
        place = np.array([aside, aside, HALF])
        place[axis] = 2.0 * HALF - overlap
        world = World(bodies(CUBE, [(0.0, 0.0, HALF), tuple(place)]), FIDELITIES[level])
        world.advance(3.0)
        apart = world.position[0, 1] - world.position[0, 0]
        # friction with the ground presses them together with mu m g = (m w^2 / 2) d at most
        held = 2.0 * 0.5 * (HALF - world.position[0, 0, 2])
        assert apart[axis] > 2.0 * HALF - max(2.0 * held, 1e-5)
        assert abs(apart[1 - axis] - aside) < apart[axis] - place[axis]
        # by Newton's method a cube on the ground may rock on by less than a micrometre
        assert np.abs(world.linear_velocity).max() < (1e-3 if level == "newton" else 1e-5)


@pytest.mark.parametrize("level", ["balanced", "solid"])
def test_the_same_holds_among_many_bodies(level):
    """More than 32 bodies."""
    balls = [Body(Sphere(0.01), position=(1.0 + 0.1 * n, 0.0, 0.01)) for n in range(33)]
    places = [(0.0, 0.0, HALF), (0.0, 0.0, 3.0 * HALF - 2e-3)]
    scene = bodies(CUBE, places)
    world = World(Scene([*scene.bodies, *balls], scene.statics), FIDELITIES[level])
    world.advance(1.0)
    lower, upper = world.position[0, :2, 2]
    assert upper == pytest.approx(3.0 * HALF - 2.0 * (HALF - lower), abs=2e-5)
    world.set_state(time=0.0)
    world.advance(0.5)
    assert world.position[0, 1, 2] == pytest.approx(upper, abs=2e-5)
