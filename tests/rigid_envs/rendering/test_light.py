"""Shadows and smooth borders: closed forms, and what rounding must not do."""

import numpy as np
import pytest

from physics import Box, Capsule, Compound, Cylinder, Part, Sphere, Torus
from physics.rotation import rotation_matrix
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.rays.light import GROUND_SHADOW, TO_SUN, sun_points
from rigid_envs.rendering.renderer import SOFT, Renderer
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


def meets(shape, origin, direction):
    """Whether rays [n, 3] in a shape's frame meet it, by points every 0.4 mm near its centre."""
    middle = -(origin @ direction)
    met = np.linalg.norm(origin + middle[:, None] * direction, axis=1) < 0.08  # others pass by
    t = (middle[met] + np.linspace(-0.08, 0.08, 400)[:, None])[..., None]
    x, y, z = np.moveaxis(origin[met] + t * direction, -1, 0)
    if isinstance(shape, Sphere):
        inside = x * x + y * y + z * z < shape.radius**2
    elif isinstance(shape, Box):
        a, b, c = shape.half_extents
        inside = (np.abs(x) < a) & (np.abs(y) < b) & (np.abs(z) < c)
    elif isinstance(shape, Cylinder):
        inside = (x * x + y * y < shape.radius**2) & (np.abs(z) < shape.half_length)
    elif isinstance(shape, Capsule):
        end = z - np.clip(z, -shape.half_length, shape.half_length)
        inside = x * x + y * y + end * end < shape.radius**2
    else:
        ring = np.hypot(x, y) - shape.major_radius
        inside = ring * ring + z * z < shape.minor_radius**2
    met[met] = inside.any(axis=0)
    return met


SHAPES = [
    Sphere(0.04), Box((0.05, 0.03, 0.02)), Capsule(0.025, 0.04), Cylinder(0.03, 0.03),
    Torus(0.04, 0.012),
]  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
@pytest.mark.parametrize("height", [0.08, 0.25])
def test_a_soft_shadow_is_the_fraction_of_the_sun_that_is_hidden(shape, height):
    """On the ground, seen from low down, against rays to every point of the sun."""
    points, place = sun_points(SOFT), np.array((0.02, 0.03, height))
    below = place - place[2] / TO_SUN[2] * TO_SUN
    low = Camera.around(tuple(below.tolist()), 0.6, 20.0, 20.0, 30.0)
    pictures = [
        Renderer(96, 96, low, smooth=False).frames(items, depth=True, solid=True)
        for items in ([Item(shape, place, TURNED, RED)], [])
    ]
    found, empty = pictures
    ground = (found.solid[0] < 0) & (found.depth[0] == empty.depth[0]) & (empty.depth[0] < 2.0)
    seen = (low.eye + found.depth[0][..., None] * low.rays(96, 96))[ground]
    turn = rotation_matrix(TURNED)
    hidden = (
        sum(
            meets(shape, (seen - place) @ turn, point @ turn / np.linalg.norm(point))
            for point in points
        )
        / SOFT
    )
    tiles = empty.rgb[0][ground].astype(float)
    expected = tiles * (1.0 - hidden[:, None] * GROUND_SHADOW)
    off = np.abs(found.rgb[0][ground] - expected).max(axis=-1)
    assert (hidden == 1.0).any() or height > 0.1
    assert ((hidden > 0.0) & (hidden < 1.0)).sum() > 25
    # a point of the sun is an eighth, 10 of 255 levels; at its rim rounding decides
    assert (off > 2.0).sum() <= 0.03 * (hidden > 0.0).sum()


def test_a_renderer_draws_any_number_of_solids_one_after_another():
    renderer, draw = Renderer(SIZE, SIZE, CAMERA), np.random.default_rng(0)
    for count in (0, 3, 50, 1):
        items = [
            Item(SHAPES[n % 5], draw.uniform((-0.2, -0.2, 0.05), 0.2), TURNED, RED)
            for n in range(count)
        ]
        fresh = Renderer(SIZE, SIZE, CAMERA).frame(items)
        np.testing.assert_array_equal(renderer.frame(items), fresh)


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
