"""Every preset holds what physics/reference/promises.py says of it."""

from functools import partial

import numpy as np
import pytest

from physics import PRESETS, World
from physics.reference.measures import creep, rebounds, slide, stand
from physics.reference.promises import PROMISES
from physics.reference.scenes import CUBE, block_on_ground

MILLIMETRE = 1e-3


def test_every_preset_has_a_promise():
    assert PROMISES.keys() == PRESETS.keys()


@pytest.mark.parametrize("name", PRESETS)
class TestPreset:
    def make(self, name):
        return partial(World, fidelity=name)

    def test_its_tower_stands(self, name):
        standing = stand(PROMISES[name].cubes, 10.0, self.make(name))
        assert standing.drift < MILLIMETRE
        assert standing.sink < CUBE.half_extents[2] / 2

    def test_a_cube_sinks_no_deeper(self, name):
        world = World(block_on_ground(), name)
        world.advance(1.0)
        sink = CUBE.half_extents[2] - world.position[0, 0, 2]
        assert 0.0 < sink < PROMISES[name].sink

    def test_a_cube_rests_on_a_slope(self, name):
        assert creep(CUBE.half_extents, self.make(name)) < PROMISES[name].creep

    def test_a_slide_ends_where_it_should(self, name):
        assert slide(CUBE.half_extents, 0.5, self.make(name)) < PROMISES[name].slide

    def test_a_ball_rebounds_as_it_should(self, name):
        for e in (0.0, 0.25, 0.5, 0.75):
            error = np.abs(rebounds(e, PRESETS[name]) - e).max()
            assert error < PROMISES[name].restitution, e
