"""A World warns of scenes that were hardly meant: bodies that begin inside statics, other units."""

import warnings

import numpy as np
import pytest

import physics
from physics import (
    Body,
    Box,
    Capsule,
    Compound,
    Fidelity,
    Ground,
    Material,
    Mesh,
    Part,
    Scene,
    Sphere,
    Static,
    Torus,
)
from physics.analysis.odd_scenes import OddScene, warn_of_odd_scenes

CUBE = Box((0.05, 0.05, 0.05))
WALL = Box((0.5, 0.5, 0.5))


def found(scene, fidelity="balanced"):
    """The messages of a scene's warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn_of_odd_scenes(scene, physics.PRESETS[fidelity])
    assert all(one.category is OddScene for one in caught)
    return [str(one.message) for one in caught]


def one(z, statics, shape=CUBE, **kwargs):
    return Scene(bodies=[Body(shape, mass=1.0, position=(0.0, 0.0, z), **kwargs)], statics=statics)


def test_a_world_warns_before_it_compiles():
    with pytest.warns(OddScene, match=r"body 0 begins 0\.5 m below .*up to 147 m/s"):
        physics.World(one(-0.5, [Ground()]), "balanced")


def test_the_speed_is_not_exceeded():
    elastic = Material(restitution=1.0)
    scene = one(-0.5, [Ground(elastic)], shape=Sphere(0.05), material=elastic)
    with pytest.warns(OddScene, match="up to 138 m/s"):
        world = physics.World(scene, Fidelity(), kernel="general")
    world.advance(0.1)
    assert 0.9 * 137.5 < world.linear_velocity[0, 0, 2] < 137.5


def test_impulses_have_words_of_their_own():
    assert "impulses push it out" in found(one(-0.5, [Ground()]), "solid")[0]


@pytest.mark.parametrize(
    ("static", "depth"),
    [
        (Ground(height=0.2), "0.2"),
        (Static(WALL, position=(0.4, 0.0, 0.0)), "0.1"),
        (Static(Sphere(0.5), position=(0.4, 0.0, 0.0)), "0.1"),
        (Static(Capsule(0.3, 0.5), position=(0.0, 0.2, 0.5)), "0.1"),
        (Static(Compound([Part(WALL)]), position=(0.4, 0.0, 0.0)), "0.1"),
    ],
)
def test_depths(static, depth):
    message = found(one(0.0, [Ground(height=-5.0), static]))[0]
    assert f"body 0 begins {depth} m below the surface of static 1" in message


@pytest.mark.parametrize("z", [0.001, 0.05, 3.0])
def test_bodies_outside_are_fine(z):
    assert not found(one(z, [Ground(), Static(WALL, position=(0.0, 0.0, z - 0.6))]))


def test_what_passes_through_is_fine():
    assert not found(one(-0.5, [Ground()], mask=2))


def test_the_deepest_is_named():
    bodies = [Body(CUBE, mass=1.0, position=(k, 0.0, -0.1 * k), name=f"b{k}") for k in range(1, 4)]
    assert "b3" in found(Scene(bodies=bodies, statics=[Ground()]))[0]


def cube_mesh(width):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    return Mesh(
        vertices=width * (corners - 0.5), convex_hull=True, faces=np.zeros((1, 3), dtype=int)
    )


def test_a_mesh_in_millimetres():
    other = Body(CUBE, mass=1.0, position=(100.0, 0.0, 1.0))
    big = Body(cube_mesh(60.0), mass=1.0, position=(0.0, 0.0, 40.0))
    (message,) = found(Scene(bodies=[other, big], statics=[Ground()]))
    assert "Mesh of body 1 is 60 m wide, the next solid 0.1 m" in message
    assert "scale=0.001" in message
    fits = Body(cube_mesh(0.06), mass=1.0, position=(0.0, 0.0, 40.0))
    assert not found(Scene(bodies=[other, fits], statics=[Ground()]))
    terrain = Static(cube_mesh(60.0), position=(0.0, 0.0, -40.0))
    assert not found(Scene(bodies=[other, fits], statics=[terrain]))


def test_a_ring_around_a_peg_is_fine():
    sides = [Part(Box((0.1, 0.01, 0.02)), (0.0, y, 0.0)) for y in (-0.1, 0.1)]
    sides += [Part(Box((0.01, 0.1, 0.02)), (x, 0.0, 0.0)) for x in (-0.1, 0.1)]
    peg = Static(Capsule(0.02, 0.3))
    assert not found(one(0.1, [peg], shape=Compound(sides)))
    assert not found(one(0.1, [peg], shape=Torus(0.1, 0.02)))
    assert found(one(-0.1, [Ground()], shape=Torus(0.1, 0.02)))
    assert found(one(0.1, [peg], shape=Compound([Part(CUBE)])))
