"""Piles that ask more of contacts than one body on the ground does."""

import math
from dataclasses import replace

import numpy as np
import pytest

from physics import PRESETS, Body, Fidelity, Ground, Material, Scene, World
from physics.reference import scenes
from physics.reference.measures import wave_speed
from physics.reference.scenes import settled

SOLID = PRESETS["solid"]


def drift(world, time):
    """How far any body moves in `time` s, m."""
    start = world.position.copy()
    world.advance(time)
    return np.abs(world.position - start).max()


def test_a_pyramid_of_ten_rows_stands():
    world = settled(scenes.pyramid(10), SOLID)
    assert drift(world, 5.0) < 1e-3
    assert world.position[0, -1, 2] > 0.38 - 0.002


@pytest.mark.parametrize(
    ("ratio", "fidelity"),
    [(10.0, SOLID), (100.0, replace(SOLID, substep=0.5e-3)), (300.0, Fidelity(substep=0.1e-3))],
)
def test_a_cube_carries_one_many_times_as_dense(ratio, fidelity):
    world = settled(scenes.heavy_top(ratio), fidelity)
    assert drift(world, 5.0) < 1e-3
    assert world.position[0, 1, 2] > 0.058


@pytest.mark.parametrize("ratio", [4.0, 8.0, 16.0])
@pytest.mark.parametrize("substep", [2e-3, 0.5e-3])
def test_a_small_cube_stands_on_a_wide_one(ratio, substep):
    """All its samples are within the skin; those of its lower face must be the four that touch."""
    world = World(scenes.small_top(ratio), replace(SOLID, substep=substep))
    start = world.position[0, 1].copy()
    world.advance(3.0)
    assert np.abs(world.position[0, 1] - start).max() < 0.01 * 0.04 / ratio + 5e-5
    assert np.abs(world.angular_velocity[0, 1]).max() < 1e-3


@pytest.mark.parametrize(("substep", "deepest"), [(2e-3, 1.5e-4), (0.5e-3, 2e-5)])
@pytest.mark.parametrize("velocity", [(0.3, 0.0), (0.2, 0.07), (0.1, 0.1)])
def test_a_cube_that_slides_across_another_stays_on_top(substep, deepest, velocity):
    """The four points of the two faces slip off the other face; new ones are chosen in time."""
    smooth = Material(0.0, 0.0)
    bodies = [
        Body(scenes.CUBE, mass=0.064, position=(0, 0, height), material=smooth)
        for height in (0.02, 0.06)
    ]
    bodies[1] = replace(bodies[1], linear_velocity=(*velocity, 0.0))
    world = World(Scene(bodies, [Ground(smooth)]), replace(SOLID, substep=substep))
    for _ in range(int(0.012 / math.hypot(*velocity) / substep)):
        world.advance(substep)
        assert world.penetration()[0] < deepest
    assert world.position[0, 1, 2] > 0.06 - 2.0 * deepest


def test_the_wave_along_dominoes_converges_with_the_step():
    """A single wave scatters by 4 %: small changes decide which edge of a stone touches first."""

    def speed(*steps):
        return np.median([wave_speed(Fidelity(substep=h), stones=20) for h in steps])

    fine = speed(0.2e-3, 0.25e-3, 0.3e-3)
    errors = [abs(speed(h) / fine - 1.0) for h in (2e-3, 1e-3, 0.5e-3)]
    assert errors[0] < 0.25
    assert max(errors[1:]) < 0.03
    assert 0.8 < fine < 1.0


@pytest.mark.parametrize(
    ("degrees", "fidelity"),
    [(d, "solid") for d in (10.0, 20.0, 25.0)]
    + [(d, "balanced") for d in (20.0, 25.0)]
    + [(10.0, Fidelity(substep=1e-3))],
)
def test_two_cards_lean_against_each_other(degrees, fidelity):
    """At balanced and 10 degrees a slow mode grows from round-off, eightfold in 0.25 s."""
    world = settled(scenes.leaning_cards(math.radians(degrees)), fidelity)
    assert drift(world, 10.0) < 1e-4
    assert world.position[0, 0, 2] > 0.039


def test_contacts_support_what_is_above_them_in_at_most_four_points():
    world = World(scenes.tower(3, jitter=0.0), SOLID)
    world.advance(3.0)
    pairs = np.sort(world.contacts().pair, axis=-1)
    for below, above in ((0, 1), (1, 2)):
        assert 3 <= np.all(pairs == (below, above), axis=-1).sum() <= 4
        weight = 0.064 * scenes.GRAVITY * (3 - above)
        assert world.normal_force(below, above)[0] == pytest.approx(weight, rel=1e-3)
