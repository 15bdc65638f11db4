"""Restitution and friction are those of the surfaces, however many samples stand for them."""

from dataclasses import replace

import numpy as np
import pytest

from physics import PRESETS, World
from physics.reference.scenes import landing_cube

# errors of restitution that a preset may make
ERROR = {
    "fast": {"face": 1.3e-3, "edge": 1.5e-3, "corner": 1.9e-3},
    "balanced": {"face": 1e-3, "edge": 1.4e-3, "corner": 9e-4},
    "accurate": {"face": 3e-5, "edge": 5e-5, "corner": 2e-5},
    "solid": {"face": 1e-5, "edge": 1e-5, "corner": 1e-5},
}
SPACINGS = [1.0, 0.5, 0.25]
ON = ["face", "edge", "corner"]
SPEEDS = [0.3, 0.7, 1.0, 1.5, 2.0, 3.0]
PHASES = 8


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("on", ON)
@pytest.mark.parametrize("spacing", SPACINGS)
def test_restitution_is_that_of_the_point_however_a_cube_lands(on, spacing, preset):
    """Straight over what touches: no lever, and nothing that friction could act on."""
    fidelity = replace(PRESETS[preset], spacing=spacing)
    speed = np.repeat(SPEEDS, PHASES)
    phase = np.tile(np.arange(PHASES) / PHASES, len(SPEEDS))
    down = -speed[:, None, None] * (0.0, 0.0, 1.0)
    for restitution in (0.25, 0.5, 0.75):
        world = World(landing_cube(on, restitution, 0.1), fidelity, len(speed))
        position = world.position.copy()
        position[:, 0, 2] += speed * fidelity.substep * phase
        world.set_state(position=position, linear_velocity=down)
        world.advance(0.3)
        error = world.linear_velocity[:, 0, 2] / speed - restitution
        assert np.abs(error).max() < ERROR[preset][on]
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
