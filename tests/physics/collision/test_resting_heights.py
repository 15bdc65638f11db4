"""What lies on a surface lies where the surface is, at any height and on every shape."""

import math

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Ground,
    Material,
    Scene,
    Sphere,
    Static,
    World,
)

RADIUS, HALF = 0.03, 0.02  # m, of a ball and of a cube
LAWS = ("balanced", "solid")
# shape of a static, and how far its top is above its centre, m
TOPS = {
    "sphere": (Sphere(0.3), 0.3),
    "box": (Box((0.2, 0.1, 0.15)), 0.15),
    "capsule": (Capsule(0.1, 0.2), 0.3),
    "cylinder": (Cylinder(0.2, 0.1), 0.1),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("height", [-0.7, 0.4])
def test_a_cube_lies_on_a_ground_at_any_height(height, law):
    material = Material(0.5, 0.0)
    cube = Body(Box((HALF,) * 3), mass=0.1, position=(0, 0, height + HALF), material=material)
    world = World(Scene([cube], [Ground(material, height)]), law)
    world.advance(1.0)
    sunk = height + HALF - world.position[0, 0, 2]
    assert 0.0 < sunk < 1e-3
    assert world.penetration()[0] == pytest.approx(sunk, rel=1e-4)


@pytest.mark.parametrize("law", LAWS)
def test_a_ball_lies_on_the_top_of_every_shape(law):
    """Held there by symmetry alone."""
    material = Material(0.5, 0.0)
    bodies, statics = [], [Ground(material, -9.0)]
    for n, (shape, top) in enumerate(TOPS.values()):
        place = (2.0 * n, 0.0, 1.0)
        statics.append(Static(shape, place, material=material))
        position = (*place[:2], place[2] + top + RADIUS)
        bodies.append(Body(Sphere(RADIUS), mass=0.1, position=position, material=material))
    world = World(Scene(bodies, statics), law)
    start = world.position.copy()
    world.advance(0.5)
    sunk = start[0, :, 2] - world.position[0, :, 2]
    for name, depth in zip(TOPS, sunk, strict=True):
        assert 0.0 <= depth < 1e-3, name
    np.testing.assert_allclose(world.position[0, :, :2], start[0, :, :2], atol=1e-9)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0])
def test_a_ball_lies_on_the_end_of_a_capsule_however_the_capsule_is_turned(degrees):
    """The capsule's end is half a sphere about a point of its axis."""
    material, angle = Material(0.5, 0.0), math.radians(degrees)
    half_length, radius = 0.2, 0.1
    turn = (0.0, math.sin(angle / 2), 0.0, math.cos(angle / 2))
    end = np.array([half_length * math.sin(angle), 0.0, half_length * math.cos(angle)])
    position = end + np.array([0.0, 0.0, radius + RADIUS])
    ball = Body(Sphere(RADIUS), mass=0.1, position=tuple(position), material=material)
    static = Static(Capsule(radius, half_length), (0, 0, 0), turn, material=material)
    world = World(Scene([ball], [static, Ground(material, -9.0)]))
    world.advance(0.2)
    assert 0.0 < position[2] - world.position[0, 0, 2] < 1e-3
    assert abs(world.position[0, 0, 0] - position[0]) < 1e-4
