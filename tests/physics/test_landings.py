"""Restitution and friction are those of the surfaces, however many samples stand for them."""

from dataclasses import replace

import numpy as np
import pytest

from physics import PRESETS, World
from physics.reference.scenes import landing_cube

# errors of restitution that the presets may make; and on an edge or a corner, whose samples come to
# touch one after another
ERROR = {"fast": 6e-3, "balanced": 5e-3, "accurate": 1e-3, "solid": 1e-5}
EDGE = {**ERROR, "fast": 1e-2}
CORNER = {**ERROR, "fast": 0.06, "balanced": 0.025}
SPACINGS = [1.0, 0.5, 0.25]
ON = ["face", "edge", "corner"]


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("on", ON)
@pytest.mark.parametrize("spacing", SPACINGS)
def test_restitution_is_that_of_the_point_however_a_cube_lands(on, spacing, preset):
    """Straight over what touches: no lever, and nothing that friction could act on."""
    error = {"face": ERROR, "edge": EDGE, "corner": CORNER}[on][preset]
    for restitution in (0.25, 0.5, 0.75):
        world = World(landing_cube(on, restitution, 0.1), replace(PRESETS[preset], spacing=spacing))
        world.advance(0.2)
        assert world.linear_velocity[0, 0, 2] == pytest.approx(restitution, abs=error)
        assert np.abs(world.angular_velocity).max() < 0.1


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("on", ON)
@pytest.mark.parametrize("spacing", SPACINGS)
def test_a_cube_that_skids_as_it_lands_gets_mu_times_the_normal_impulse(on, spacing, preset):
    friction, along = 0.1, 3.0
    scene = landing_cube(on, 0.5, friction, along)
    world = World(scene, replace(PRESETS[preset], spacing=spacing))
    before = world.linear_momentum()[0]
    world.advance(0.1)
    given = world.linear_momentum()[0] - before
    assert given[2] > 0.0
    assert -given[0] / given[2] == pytest.approx(friction, rel=5e-3)
    assert abs(given[1]) < 1e-3 * given[2]
