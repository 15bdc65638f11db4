"""What slides over the seam of flush static boxes keeps its velocity."""

import math

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Ground,
    Material,
    Scene,
    Sphere,
    Static,
    World,
)
from physics.scene.fidelity import NEWTON, PRESETS
from physics.scene.flush_statics import FlushBox, join_flush

FIDELITIES = {**PRESETS, "newton": NEWTON}
SMOOTH = Material(friction=0.0)
CUBE = Box((0.02, 0.02, 0.02))
ON_ITS_SIDE = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
TURNED = (0.0, 0.0, math.sin(0.2), math.cos(0.2))
SHAPES = {
    "cube": (CUBE, 0.02, (0.0, 0.0, 0.0, 1.0)),
    "turned cube": (CUBE, 0.02, TURNED),
    "plate": (Box((0.04, 0.03, 0.01)), 0.01, TURNED),
    "small cube": (Box((0.005, 0.005, 0.005)), 0.005, (0.0, 0.0, 0.0, 1.0)),
    "cylinder": (Cylinder(0.02, 0.02), 0.02, (0.0, 0.0, 0.0, 1.0)),
    "capsule": (Capsule(0.02, 0.02), 0.02, ON_ITS_SIDE),
    "ball": (Sphere(0.02), 0.02, (0.0, 0.0, 0.0, 1.0)),
    "compound": (Compound([(CUBE, (0.02, 0, 0)), (CUBE, (-0.02, 0, 0))]), 0.02, TURNED),
}


def tiles(half=0.05, count=4, yaw=0.0, **fields):
    """A floor of square tiles, 0.1 m thick, that begins at half a tile from the origin."""
    orientation = (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return [
        Static(
            Box((half, half, 0.05)),
            (cosine * x - sine * y, sine * x + cosine * y, -0.05),
            orientation, SMOOTH, **fields,
        )
        for x in 2.0 * half * np.arange(count)
        for y in 2.0 * half * np.arange(count)
    ]  # fmt: skip


def slid(shape, height, orientation, floor, level, velocity, time=0.4, more=()):
    """The world after a smooth body has slid over a floor from 0.07, 0.08."""
    body = Body(
        shape, mass=0.1, position=(0.07, 0.08, height), orientation=orientation,
        linear_velocity=(*velocity, 0.0), material=SMOOTH,
    )  # fmt: skip
    world = World(Scene([body, *more], [*floor, Ground(height=-1.0)]), FIDELITIES[level])
    world.advance(time)
    return world


@pytest.mark.parametrize(
    ("level", "name"),
    [(level, "turned cube") for level in FIDELITIES]
    + [(level, name) for level in ("balanced", "solid") for name in SHAPES if name[:6] != "turned"],
)
def test_a_smooth_body_keeps_its_velocity_over_seams(level, name):
    yaw, velocity = (0.0, (0.5, 0.25)) if name != "turned cube" else (0.5, (0.15, 0.5))
    world = slid(*SHAPES[name], tiles(yaw=yaw), level, velocity)
    np.testing.assert_allclose(world.linear_velocity[0, 0, :2], velocity, atol=5e-4)
    assert abs(world.angular_velocity[0, 0, 2]) < 0.01  # rad/s


def test_a_smooth_cube_keeps_its_velocity_over_seams_among_many_bodies():
    """More than 32 bodies."""
    balls = [Body(Sphere(0.01), position=(9.0 + n, 0.0, -0.99)) for n in range(33)]
    for level in ("balanced", "solid"):
        world = slid(*SHAPES["cube"], tiles(), level, (0.5, 0.25), more=balls)
        np.testing.assert_allclose(world.linear_velocity[0, 0, :2], (0.5, 0.25), atol=5e-4)


def test_only_boxes_with_a_level_face_in_common_are_joined():
    def joined(*others):
        statics = join_flush((Static(Box((0.1, 0.1, 0.1))), *others))
        return isinstance(statics[0].shape, FlushBox)

    beside = (0.2, 0.0, 0.0)
    assert joined(Static(Box((0.1, 0.1, 0.1)), beside))
    assert joined(Static(Box((0.1, 0.3, 0.2)), (0.2, 0.0, -0.1)))  # level tops
    assert not joined(Static(Box((0.1, 0.05, 0.05)), beside))  # tops and sides differ
    assert not joined(Static(Box((0.05, 0.05, 0.2)), (0.0, 0.0, 0.3)))  # a post on it
    assert not joined(Static(Box((0.1, 0.1, 0.1)), (0.2001, 0.0, 0.0)))  # a gap
    assert not joined(Static(Box((0.1, 0.1, 0.1)), beside, TURNED))
    assert not joined(Static(Box((0.1, 0.1, 0.1)), beside, mask=1))
    assert not joined(Static(Sphere(0.1), beside))


def test_tiles_with_the_same_neighbours_are_of_one_kind():
    """In worlds of many bodies each kind has tables of its own."""
    floor = join_flush(tiles(half=0.07, count=6, yaw=0.3))
    assert len({static.shape for static in floor}) == 9  # corners, sides, inside


def test_the_sides_of_a_floor_and_of_lower_tiles_still_stop_what_comes():
    wall = Static(Box((0.05, 0.25, 0.1)), (0.4, 0.2, 0.0), material=SMOOTH)  # 0.1 m high
    for level in ("balanced", "solid"):
        world = slid(*SHAPES["cube"], [*tiles(), wall], level, (0.5, 0.0), time=1.0)
        assert world.linear_velocity[0, 0, 0] < 0.0
        assert world.position[0, 0, 0] < 0.33
        assert abs(world.angular_velocity).max() < 0.05
