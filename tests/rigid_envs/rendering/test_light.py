"""Shadows and smooth borders: closed forms, and what rounding must not do."""

import numpy as np
import pytest

from physics import Box, Compound, Part, Sphere
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.rays.light import TO_SUN
from rigid_envs.rendering.renderer import Renderer
from rigid_envs.rendering.view import Item

UPRIGHT, RED = (0.0, 0.0, 0.0, 1.0), (220, 40, 40)
SIZE = 160
CAMERA = Camera((0.5, -0.6, 0.5), (0.0, 0.0, 0.05), 30.0)
TURNED = np.array((0.1, 0.2, 0.9, 0.4)) / np.linalg.norm((0.1, 0.2, 0.9, 0.4))


def frames(*items, **settings):
    return Renderer(SIZE, SIZE, CAMERA, **settings).frames(items, depth=True, solid=True)


@pytest.mark.parametrize("height", [0.03, 0.1, 0.3])
def test_the_shadow_of_a_sphere_is_the_cylinder_along_the_light(height):
    radius, centre = 0.03, np.array((0.02, 0.05, height))
    ball = Item(Sphere(radius), centre, UPRIGHT, RED)
    found, empty = (frames(*items, soft=False, smooth=False) for items in ((ball,), ()))
    seen = CAMERA.eye + found.depth[0][..., None] * CAMERA.rays(SIZE, SIZE)
    towards = centre - seen
    aside = np.linalg.norm(towards - (towards @ TO_SUN)[..., None] * TO_SUN, axis=-1)
    # the ground, but for points at which rounding decides
    ground = (found.depth[0] == empty.depth[0]) & (np.abs(aside - radius) > 1e-4)
    dark = (found.rgb[0] != empty.rgb[0]).any(axis=-1)
    assert dark[ground].sum() > 20
    np.testing.assert_array_equal(dark[ground], (aside < radius)[ground])


@pytest.mark.parametrize("orientation", [UPRIGHT, TURNED], ids=["upright", "turned"])
def test_parts_with_a_common_face_do_not_shade_it(orientation):
    arms = [Part(Box((0.1, 0.03, 0.02))), Part(Box((0.03, 0.1, 0.02)))]
    place = (0.0, 0.0, 0.2)
    cross = frames(Item(Compound(arms), place, orientation, RED), smooth=False)
    whole = frames(Item(Box((0.1, 0.1, 0.02)), place, orientation, RED), smooth=False)
    same = (np.abs(cross.depth - whole.depth)[0] < 1e-6) & (cross.depth[0] < frames().depth[0])
    assert same.sum() > 500
    apart = np.abs(cross.rgb[0].astype(int) - whole.rgb[0]).max(axis=-1)
    assert np.mean(apart[same] > 1) < 0.15  # the edges of the parts


def test_the_ground_hides_the_lower_half_of_a_sphere_at_smooth_borders_too():
    """Against a picture of four times the size, which is then reduced."""
    ball = Item(Sphere(0.08), (0.0, 0.0, 0.0), UPRIGHT, RED)
    large = Renderer(4 * SIZE, 4 * SIZE, CAMERA, soft=False, smooth=False)
    fine, empty = large.frame([ball]), large.frame([])
    wanted = fine.reshape(SIZE, 4, SIZE, 4, 3).mean(axis=(1, 3))
    changed = (fine != empty).any(axis=-1).reshape(SIZE, 4, SIZE, 4).any(axis=(1, 3))
    off = {}
    for smooth in (False, True):
        frame = Renderer(SIZE, SIZE, CAMERA, soft=False, smooth=smooth).frame([ball])
        off[smooth] = np.abs(frame - wanted)[changed].sum()
    assert off[True] < 0.75 * off[False]


def test_the_ground_may_lie_at_another_height_or_be_absent():
    low = frames(Item(Sphere(0.05), (0.0, 0.0, 0.05), UPRIGHT, RED))
    lifted = Camera((0.5, -0.6, 0.7), (0.0, 0.0, 0.25), 30.0)
    renderer = Renderer(SIZE, SIZE, lifted, floor=0.2)
    ball = Item(Sphere(0.05), (0.0, 0.0, 0.25), UPRIGHT, RED)
    high = renderer.frames([ball], depth=True)
    np.testing.assert_allclose(high.depth, low.depth, rtol=1e-6)
    assert np.mean(np.abs(high.rgb.astype(int) - low.rgb) > 2) < 1e-3
    none = Renderer(SIZE, SIZE, CAMERA, floor=None).frames([], depth=True)
    assert np.all(np.isinf(none.depth))
    with pytest.raises(ValueError, match=r"above the ground at z = 0\.6 m"):
        Renderer(SIZE, SIZE, CAMERA, floor=0.6)


def test_see_through_solids_are_blended_from_far_to_near():
    walls = [
        Item(Box((0.1, 0.001, 0.1)), (0.0, y, 0.1), UPRIGHT, color, opacity=0.5)
        for y, color in ((-0.05, (220, 40, 40)), (0.05, (40, 60, 220)))
    ]
    renderer = Renderer(SIZE, SIZE, CAMERA)
    np.testing.assert_array_equal(renderer.frame(walls), renderer.frame(walls[::-1]))


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"camera": "top"}, TypeError, "camera must be Camera, got 'top'"),
        ({"soft": "no"}, TypeError, "soft must be bool"),
        ({"width": 5000}, ValueError, "width must be at most 4096, got 5000"),
    ],
)
def test_settings_that_are_none_are_named(given, error, message):
    with pytest.raises(error, match=message):
        Renderer(**given)


def test_overlays_are_none_or_one_a_world():
    renderer = Renderer(16, 16)
    with pytest.raises(ValueError, match="overlays must be none or 3, one a world, got 1"):
        renderer.frames([], [renderer.overlay([])], worlds=3)
