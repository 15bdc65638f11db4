"""A world of many bodies looks as it would if each body were drawn by itself."""

import numpy as np
import pytest

from physics import Box, World
from physics.reference.many_bodies import SCENES
from rigid_envs.rendering.cameras import looking_at
from rigid_envs.rendering.crowd import Crowd
from rigid_envs.rendering.renderer import Renderer
from rigid_envs.rendering.view import Item


def test_bodies_are_drawn_as_items_would_be():
    scene, fidelity = SCENES["rubble"](60, 0)
    world = World(scene, fidelity)
    crowd = Crowd(world, 96)
    world.advance(0.02)
    items = [
        Item(body.shape, world.position[0, i], world.orientation[0, i], tuple(crowd._colors[i]))
        for i, body in enumerate(scene.bodies)
    ]
    items += [
        Item(wall.shape, wall.position, wall.orientation, (170, 170, 165), opacity=0.12)
        for wall in scene.statics[1:]
    ]
    alone = Renderer(96, 96, crowd._renderer.camera, soft=False).frame(items)
    np.testing.assert_array_equal(crowd.frame(), alone)


def test_shadows_of_many_are_those_that_each_casts():
    """Of a row of solids apart from each other, the shadows are those of pictures of one."""
    camera = looking_at((-1.0, -1.0, 0.0), (1.0, 1.0, 0.3))
    cube, upright = Box((0.04, 0.03, 0.05)), (0.0, 0.0, 0.0, 1.0)
    places = [(x, y, 0.05 + 0.2 * (k % 2)) for k, x in enumerate(np.linspace(-0.9, 0.9, 6))
              for y in (-0.8, 0.0, 0.8)]  # fmt: skip
    renderer = Renderer(160, 160, camera, smooth=False)
    empty = renderer.frame([]).astype(int)
    items = [Item(cube, place, upright, (220, 40, 40)) for place in places]
    darkened = [renderer.frame([item]).astype(int) - empty for item in items]
    together = renderer.frame(items).astype(int) - empty
    np.testing.assert_array_equal(together, np.sum(darkened, axis=0))


def test_a_camera_sees_a_box_from_as_near_as_it_can():
    low, high = np.array((-1.0, -0.5, 0.0)), np.array((2.0, 0.5, 1.5))
    camera = looking_at(low, high)
    corners = low + (high - low) * np.array(np.meshgrid(*[(0, 1)] * 3)).reshape(3, -1).T
    pixels, _ = camera.project(corners, 200, 200)
    assert np.abs(pixels - 100.0).max() == pytest.approx(100.0)
