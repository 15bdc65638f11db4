"""Pictures show what is there: the right colour at the right pixel, the nearer solid in front."""

import copy
import pickle
from dataclasses import dataclass

import numpy as np
import pytest

from physics import Torus
from physics.scene.cylinder import Cylinder
from physics.scene.shapes import Box, Capsule, Sphere
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.rays.light import TO_SUN
from rigid_envs.rendering.renderer import Renderer, grid
from rigid_envs.rendering.view import Arrow, Ghost, Goal, Item, Mark, Particles

UPRIGHT, ORIGIN = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
RED, GREEN, BLUE = (220, 40, 40), (40, 180, 60), (40, 60, 220)
CUBE = Box((0.02, 0.02, 0.02))
SIZE = 240
DOMINANT = {RED: 0, GREEN: 1, BLUE: 2}


def item(shape, position, color=RED, orientation=UPRIGHT):
    return Item(shape, position, orientation, color)


def draw(*items, camera=None, **extras):
    return Renderer(SIZE, SIZE, camera).frame(items, **extras)


def pixel_of(point, camera=None):
    (column, row), _ = (camera or Camera()).project(np.array(point), SIZE, SIZE)
    return int(row), int(column)


def shows(frame, pixel, color):
    """Whether a pixel has the hue of `color`, however it is lit."""
    value = frame[pixel].astype(int)
    others = np.delete(value, DOMINANT[color])
    return value[DOMINANT[color]] > 1.3 * others.max()


def is_grey(frame, pixel):
    return np.ptp(frame[pixel].astype(int)) < 30


def test_a_frame_is_height_by_width_by_three_bytes():
    frame = Renderer(width=120, height=90).frame([item(CUBE, (0.0, 0.0, 0.02))])
    assert frame.shape == (90, 120, 3)
    assert frame.dtype == np.uint8


def test_an_empty_scene_shows_the_ground():
    assert draw().std() > 1.0


def test_a_later_frame_leaves_an_earlier_one_alone():
    renderer = Renderer(SIZE, SIZE)
    first = renderer.frame([item(CUBE, (0.0, 0.0, 0.02))])
    kept = first.copy()
    renderer.frame([item(Sphere(0.1), (0.0, 0.0, 0.1), BLUE)])
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_array_equal(renderer.frame([item(CUBE, (0.0, 0.0, 0.02))]), kept)


def test_the_target_appears_in_the_middle_at_the_camera_distance():
    camera = Camera.around((0.3, -0.2, 0.1), 0.7, azimuth=25.0, elevation=50.0)
    pixel, depth = camera.project(np.array(camera.target), 320, 200)
    np.testing.assert_allclose(pixel, (160.0, 100.0), atol=1e-9)
    assert depth == pytest.approx(0.7)


def test_from_above_the_picture_is_a_map_with_x_right_and_y_up():
    camera = Camera.around(ORIGIN, 2.0, azimuth=-90.0, elevation=90.0, field_of_view=60.0)
    pixel, _ = camera.project(np.array([0.1, 0.2, 0.0]), 400, 400)
    per_metre = 200.0 / np.tan(np.radians(30.0)) / 2.0
    np.testing.assert_allclose(pixel, (200.0 + 0.1 * per_metre, 200.0 - 0.2 * per_metre))


@pytest.mark.parametrize("position", [(0.0, 0.0, 0.02), (0.12, 0.1, 0.02), (-0.15, -0.1, 0.1)])
@pytest.mark.parametrize(
    "shape",
    [Sphere(0.02), CUBE, Capsule(0.02, 0.03), Cylinder(0.02, 0.02)],
    ids=lambda shape: type(shape).__name__,
)
def test_a_solid_shows_its_colour_at_the_pixel_of_its_centre(shape, position):
    assert shows(draw(item(shape, position)), pixel_of(position), RED)


def test_a_sphere_fills_the_disc_that_the_camera_predicts():
    camera, radius = Camera(), 0.03
    frame = draw(item(Sphere(radius), (0.0, 0.0, 0.1)), camera=camera)
    for direction in (*camera.axes[:2], *-camera.axes[:2]):
        inside = np.array([0.0, 0.0, 0.1]) + 0.85 * radius * direction
        outside = np.array([0.0, 0.0, 0.1]) + 1.2 * radius * direction
        assert shows(frame, pixel_of(inside), RED)
        assert is_grey(frame, pixel_of(outside))


def test_a_turned_box_covers_its_corners():
    half, angle = np.array([0.08, 0.02, 0.01]), np.radians(35.0)
    turn = (0.0, 0.0, np.sin(angle / 2), np.cos(angle / 2))
    frame = draw(item(Box(tuple(half)), (0.0, 0.0, 0.01), orientation=turn))
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    for end in (-1, 1):
        top = np.array([0.0, 0.0, 0.02])
        assert shows(frame, pixel_of(top + end * 0.92 * half[0] * along), RED)
        assert not shows(frame, pixel_of(top + end * 1.2 * half[0] * along), RED)


def test_a_capsule_reaches_from_cap_to_cap_along_its_own_z():
    half = np.sin(np.pi / 4)
    lying_along_x = (0.0, half, 0.0, half)
    frame = draw(item(Capsule(0.015, 0.06), (0.0, 0.0, 0.015), orientation=lying_along_x))
    assert shows(frame, pixel_of((0.07, 0.0, 0.015)), RED)
    assert shows(frame, pixel_of((-0.07, 0.0, 0.015)), RED)
    assert not shows(frame, pixel_of((0.09, 0.0, 0.015)), RED)


def test_a_cylinder_fills_its_round_outline_and_not_the_box_around_it():
    frame = draw(item(Cylinder(0.06, 0.01), (0.0, 0.0, 0.01)))
    for angle in np.arange(8) * np.pi / 4:
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        top = np.array([0.0, 0.0, 0.02])
        assert shows(frame, pixel_of(top + 0.93 * 0.06 * way), RED)
        assert not shows(frame, pixel_of((0.0, 0.0, 0.01) + 1.25 * 0.06 * way), RED)
    half = np.sin(np.pi / 4)
    lying_along_x = (0.0, half, 0.0, half)
    frame = draw(item(Cylinder(0.015, 0.06), (0.0, 0.0, 0.015), orientation=lying_along_x))
    assert shows(frame, pixel_of((0.055, 0.0, 0.025)), RED)
    assert not shows(frame, pixel_of((0.068, 0.0, 0.015)), RED)


def test_a_torus_is_a_ring_with_a_hole():
    frame = draw(item(Torus(0.05, 0.015), (0.0, 0.0, 0.02)))
    assert not shows(frame, pixel_of((0.0, 0.0, 0.02)), RED)
    for angle in np.arange(8) * np.pi / 4:
        assert shows(frame, pixel_of((0.05 * np.cos(angle), 0.05 * np.sin(angle), 0.03)), RED)


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("near", [Sphere(0.02), CUBE, Capsule(0.015, 0.01)], ids=str)
@pytest.mark.parametrize("far", [Sphere(0.02), CUBE, Capsule(0.015, 0.01)], ids=str)
def test_the_nearer_solid_hides_the_farther(near, far, first):
    towards = Camera().eye / np.linalg.norm(Camera().eye)
    centre = np.array([0.0, 0.0, 0.1])
    pair = [item(near, centre + 0.06 * towards, BLUE), item(far, centre)]
    frame = draw(*(pair if first else pair[::-1]))
    assert shows(frame, pixel_of(centre), BLUE)
    assert not shows(frame, pixel_of(centre), RED)


def test_a_ball_on_the_far_end_of_a_slab_stays_in_front_of_it():
    # its centre is farther from the eye than the slab's, so an order by distance would hide it
    camera = Camera.around(ORIGIN, 0.88, -90.0)
    slab = item(Box((0.05, 0.2, 0.02)), (0.0, 0.0, 0.02))
    ball = item(Sphere(0.02), (0.0, 0.12, 0.06), BLUE)
    assert np.linalg.norm(camera.eye - ball.position) > np.linalg.norm(camera.eye - slab.position)
    assert shows(draw(ball, slab, camera=camera), pixel_of(ball.position, camera), BLUE)


def test_a_finger_behind_a_wall_is_hidden_though_its_centre_is_nearer():
    camera = Camera.around(ORIGIN, 0.88, -90.0, 5.0)
    wall = item(Box((0.3, 0.01, 0.1)), (0.28, 0.0, 0.1))
    finger = item(Sphere(0.015), (0.0, 0.025, 0.05), BLUE)
    assert np.linalg.norm(camera.eye - finger.position) < np.linalg.norm(camera.eye - wall.position)
    assert shows(draw(wall, finger, camera=camera), pixel_of(finger.position, camera), RED)


def test_a_touching_finger_changes_sides_with_the_camera():
    cube = item(CUBE, (0.0, 0.0, 0.02))
    finger = item(Sphere(0.015), (0.0, -0.0345, 0.02), BLUE)  # 0.5 mm deep in the face at -y
    before = Camera.around(ORIGIN, 0.88, -90.0, 10.0)
    behind = Camera.around(ORIGIN, 0.88, 90.0, 10.0)
    assert shows(draw(cube, finger, camera=before), pixel_of(finger.position, before), BLUE)
    assert shows(draw(cube, finger, camera=behind), pixel_of(finger.position, behind), RED)


def test_moving_or_turning_a_cube_changes_the_picture():
    still = draw(item(CUBE, (0.0, 0.0, 0.02)))
    assert (draw(item(CUBE, (0.01, 0.0, 0.02))) != still).any()
    assert (draw(item(CUBE, (0.0, 0.0, 0.02), orientation=(0.0, 0.0, 0.38, 0.92))) != still).any()


def test_the_shadow_lies_on_the_ground_away_from_the_light():
    centre = np.array([0.0, 0.0, 0.12])
    spot = centre - TO_SUN * centre[2] / TO_SUN[2]
    dark, plain = draw(item(Sphere(0.03), centre)), draw()
    row, column = pixel_of(spot)
    assert dark[row, column].mean() < 0.8 * plain[row, column].mean()
    mirrored = pixel_of(spot * (-1.0, -1.0, 1.0))
    np.testing.assert_array_equal(dark[mirrored], plain[mirrored])


def test_a_goal_tints_its_disc_and_hangs_a_ball_at_its_height():
    goal = Goal((0.05, 0.05, 0.15), 0.03, GREEN)
    frame, plain = draw(markers=[goal]), draw()
    ball, disc = pixel_of(goal.position), pixel_of((0.04, 0.06, 0.0))
    beside = pixel_of((0.05, -0.02, 0.0))
    for pixel in (ball, disc):
        tint = frame[pixel].astype(int) - plain[pixel]
        assert tint[1] > max(tint[0], tint[2]) + 15
    np.testing.assert_array_equal(frame[beside], plain[beside])


def test_a_solid_shows_through_the_ball_of_its_goal():
    position = (0.0, 0.0, 0.02)
    goal, pixel = Goal(position, 0.05, GREEN), pixel_of(position)
    alone, solved = draw(markers=[goal]), draw(item(CUBE, position), markers=[goal])
    assert int(solved[pixel][2]) < alone[pixel][2] - 30  # the cube takes the ground's blue


def test_a_ghost_tints_its_place_and_shows_its_edges_through_a_solid():
    place = Ghost(CUBE.half_extents, (0.0, 0.0, 0.02), GREEN)
    empty, plain = draw(markers=[place]), draw()
    tint = empty[pixel_of((0.0, 0.0, 0.04))].astype(int) - plain[pixel_of((0.0, 0.0, 0.04))]
    assert tint[1] > max(tint[0], tint[2]) + 15
    wall = item(Box((0.05, 0.001, 0.05)), (0.0, -0.04, 0.05))
    hidden, alone = draw(wall, markers=[place]), draw(wall)
    corner = np.array([0.02, -0.02, 0.04])
    assert shows(hidden, pixel_of(corner), GREEN)
    assert shows(alone, pixel_of(corner), RED)


def test_a_ghost_is_turned():
    """By 45 degrees about the vertical: its corners are where an upright one has no edges."""
    half = np.pi / 8.0
    turned = draw(
        markers=[
            Ghost(
                CUBE.half_extents,
                (0.0, 0.0, 0.02),
                GREEN,
                orientation=(0.0, 0.0, np.sin(half), np.cos(half)),
            )
        ]
    )
    upright = draw(markers=[Ghost(CUBE.half_extents, (0.0, 0.0, 0.02), GREEN)])
    corner = pixel_of((np.sqrt(2.0) * 0.02, 0.0, 0.04))
    assert shows(turned, corner, GREEN)
    assert not shows(upright, corner, GREEN)
    with pytest.raises(ValueError, match=r"Ghost\.orientation"):
        Ghost(CUBE.half_extents, (0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 0.0))


def test_a_cube_in_its_place_keeps_its_colour():
    place, cube = Ghost(CUBE.half_extents, (0.0, 0.0, 0.02), RED), item(CUBE, (0.0, 0.0, 0.02))
    pixel = pixel_of((0.0, 0.0, 0.04))
    np.testing.assert_array_equal(draw(cube, markers=[place])[pixel], draw(cube)[pixel])


def test_a_mark_lies_on_the_ground_under_its_position():
    frame = draw(markers=[Mark((0.05, 0.0, 0.02), 0.02, RED)])
    assert shows(frame, pixel_of((0.05, 0.0, 0.0)), RED)
    assert is_grey(frame, pixel_of((0.05, 0.03, 0.0)))


def test_particles_stand_where_their_solid_is_turned_to():
    half = np.sin(np.pi / 4)
    balls = Particles(np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]]), 0.01)
    turned = Item(CUBE, (0.0, 0.0, 0.02), (0.0, 0.0, half, half), RED, balls)
    frame = draw(turned)
    for y in (-0.1, 0.1):
        assert shows(frame, pixel_of((0.0, y, 0.02)), RED)
        assert is_grey(frame, pixel_of((y, 0.0, 0.02)))


def test_the_nearer_particle_hides_the_farther_one():
    camera, centre = Camera(), np.array([0.0, 0.0, 0.05])
    towards = (camera.eye - centre) / np.linalg.norm(camera.eye - centre)
    frames = []
    for way in (1, -1):
        balls = Particles(np.array([0.03 * towards, -0.03 * towards])[::way], 0.01)
        frames.append(draw(Item(CUBE, centre, UPRIGHT, RED, balls)))
    np.testing.assert_array_equal(*frames)


def test_a_force_points_from_its_origin_along_its_vector():
    arrow = Arrow((0.0, 0.0, 0.05), (0.1, 0.0, 0.0), RED)
    frame = draw(forces=[arrow])
    assert shows(frame, pixel_of((0.09, 0.0, 0.05)), RED)
    assert not shows(frame, pixel_of((-0.02, 0.0, 0.05)), RED)
    np.testing.assert_array_equal(draw(forces=[Arrow((0, 0, 0), (0, 0, 0))]), draw())


@pytest.mark.parametrize("distance", [1.1, 3.0, 300.0])
def test_what_lies_behind_the_camera_is_not_drawn(distance):
    place = distance * Camera().eye * (1.0, 1.0, 1.0 / distance)
    shapes = (Sphere(0.02), CUBE, Capsule(0.02, 0.02))
    extras = {"markers": [Goal(place, 0.05)], "forces": [Arrow(place, (0.0, 0.1, 0.0))]}
    np.testing.assert_array_equal(draw(*[item(s, place) for s in shapes], **extras), draw())


def test_frames_tile_row_by_row():
    frames = [np.full((2, 3, 3), k, np.uint8) for k in range(5)]
    tiled = grid(frames)
    assert tiled.shape == (4, 9, 3)
    assert tiled[0, 0, 0] == 0
    assert tiled[1, 8, 0] == 2
    assert tiled[2, 3, 0] == 4
    assert tiled[3, 8, 0] == 255
    assert grid(frames, columns=1).shape == (10, 3, 3)


@pytest.mark.parametrize(
    "frames", [[], [np.zeros((2, 2, 3)), np.zeros((3, 2, 3))], [np.zeros((2, 2))]]
)
def test_frames_that_cannot_be_tiled_are_named(frames):
    with pytest.raises(ValueError, match="one shape"):
        grid(frames)


def test_a_grid_needs_a_column():
    with pytest.raises(ValueError, match="columns must be at least 1, got 0"):
        grid([np.zeros((2, 2, 3), np.uint8)], columns=0)


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda r: pickle.loads(pickle.dumps(r))])
def test_a_copied_renderer_draws_the_same(clone):
    renderer = Renderer(64, 48, Camera.around(ORIGIN, 0.88, 10.0))
    cube = [item(CUBE, (0.0, 0.0, 0.02))]
    np.testing.assert_array_equal(clone(renderer).frame(cube), renderer.frame(cube))


@pytest.mark.parametrize("field", ["width", "height"])
def test_a_size_must_be_positive(field):
    with pytest.raises(ValueError, match=f"{field}.*got 0"):
        Renderer(**{field: 0})


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("position", (0.0, 1.0, -0.1)),
        ("position", ORIGIN),
        ("position", (0.0, 1.0)),
        ("target", (0.0, np.nan, 0.0)),
        ("field_of_view", 180.0),
    ],
)
def test_a_camera_names_what_it_cannot_use(field, value):
    with pytest.raises(ValueError, match=f"Camera.{field}"):
        Camera(**{field: value})


def test_a_camera_at_its_target_is_refused():
    with pytest.raises(ValueError, match=r"apart from Camera\.target"):
        Camera(position=(0.0, 0.0, 1.0), target=(0.0, 0.0, 1.0))


def test_a_shape_that_cannot_be_drawn_is_named():
    @dataclass(frozen=True)
    class Cone:
        radius: float

    with pytest.raises(TypeError, match="Particles or Compound to be drawn, got Cone"):
        draw(item(Cone(0.1), ORIGIN))


@pytest.mark.parametrize(
    ("position", "orientation", "field"),
    [((0, 0, np.nan), UPRIGHT, "position"), ((0, 0, 0), (0, 0, 0, 0), "orientation")],
)
def test_a_pose_that_is_none_is_named(position, orientation, field):
    with pytest.raises(ValueError, match=f"Item.{field}"):
        item(CUBE, position, orientation=orientation)


def test_a_marker_or_force_that_is_not_finite_is_named():
    with pytest.raises(ValueError, match=r"Goal\.position"):
        Goal((np.inf, 0.0, 0.0), 0.05)
    with pytest.raises(ValueError, match=r"Goal\.radius"):
        Goal((0.0, 0.0, 0.0), 0.0)
    with pytest.raises(ValueError, match=r"Ghost\.half_extents"):
        Ghost((np.nan, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"Mark\.radius"):
        Mark((0.0, 0.0, 0.0), 0.0)
    with pytest.raises(ValueError, match=r"Arrow\.vector"):
        Arrow((0.0, 0.0, 0.0), (0.0, 0.0, np.nan))
