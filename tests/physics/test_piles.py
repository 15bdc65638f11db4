"""Piles that ask more of contacts than one body on the ground does."""

import math
from dataclasses import replace

import numpy as np
import pytest

from physics import PRESETS, Fidelity, World
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


def test_the_whole_is_no_deeper_than_its_stiffness_says():
    """Each of a tower's contacts carries what is above it, four points at a quarter each."""
    world = World(scenes.tower(3, jitter=0.0), SOLID)
    world.advance(3.0)
    told = world.contacts()
    pairs = np.sort(told.pair, axis=-1)
    for below, above in ((0, 1), (1, 2)):
        here = np.all(pairs == (below, above), axis=-1)
        force = np.abs(told.force[here, 2]).sum()
        assert here.sum() == 4
        assert force == pytest.approx(0.064 * scenes.GRAVITY * (3 - above), rel=1e-3)
