"""The samples of a solid can be read: they are what the engine touches with."""

import numpy as np
import pytest

from physics import Body, Box, Drive, Fidelity, Ground, Scene, Sphere, World

HALF = 0.02
BALL, FINGER, GROUND = 1, 2, 3


def world_of(**fidelity):
    bodies = [
        Body(Box((HALF,) * 3), mass=0.1, position=(0, 0, HALF)),
        Body(Sphere(0.01), mass=0.1, position=(0.1, 0, 0.01)),
    ]
    finger = Drive(Box((0.01,) * 3), mass=0.1, force_limit=1.0, position=(0, 0, 0.2))
    return World(Scene(bodies, [Ground()], [finger]), Fidelity(**fidelity))


@pytest.mark.parametrize("geometry", ["shape", "particle"])
def test_balls_about_the_samples_fill_the_box_to_its_faces(geometry):
    positions, radius = world_of(geometry=geometry).samples(0)
    assert len(positions) > 8
    np.testing.assert_allclose(positions.max(axis=0) + radius, HALF)
    np.testing.assert_allclose(positions.min(axis=0) - radius, -HALF)


def test_a_ball_is_one_sample_and_the_ground_has_none():
    world = world_of()
    positions, radius = world.samples(BALL)
    np.testing.assert_array_equal(positions, np.zeros((1, 3)))
    assert radius == 0.01
    assert world.samples(GROUND)[0].shape == (0, 3)
    assert len(world.samples(FINGER)[0]) > 0


def test_what_is_read_is_a_copy():
    world = world_of()
    world.samples(0)[0][:] = 7.0
    assert world.samples(0)[0].max() < 7.0


def test_a_solid_that_is_not_there_is_named():
    with pytest.raises(ValueError, match=r"solid must be the name or index .*0 to 3 .*got 4"):
        world_of().samples(4)
