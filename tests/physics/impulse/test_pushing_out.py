"""Bodies that overlap at the start are pushed apart slowly."""

import numpy as np

from physics import Body, Box, Ground, Material, Scene, World
from physics.impulse.sweep import MAX_PUSH_OUT_SPEED


def test_what_is_sunk_comes_out_at_no_more_than_a_metre_per_second():
    material = Material(0.5, 0.0)
    depths = np.array([0.005, 0.02, 0.04])
    cube = Body(Box((0.02, 0.02, 0.02)), mass=0.1, material=material)
    world = World(Scene([cube], [Ground(material)], gravity=(0, 0, 0)), "solid", count=3)
    position = np.zeros((3, 1, 3))
    position[:, 0, 2] = 0.02 - depths
    world.set_state(position=position)
    fastest = np.zeros(3)
    for _ in range(40):
        world.advance(world.fidelity.substep)
        fastest = np.maximum(fastest, world.linear_velocity[:, 0, 2])
    assert MAX_PUSH_OUT_SPEED == 1.0
    assert np.all(fastest <= 1.0)
    assert np.all(fastest[1:] > 0.8)  # the two that are far below, but for the contact's softness
    assert world.position[:, 0, 2].min() > 0.015  # they come out
