"""Open meshes: their convex hull, and lids on their holes."""

import sys

import numpy as np
import pytest

from physics import Body, Mesh, Scene
from physics.reference import meshes

CUBE = meshes.cuboid((0.02, 0.02, 0.02))
BALL = meshes.ball(0.03, 32)


def test_a_cube_without_a_face_is_repaired_to_the_cube():
    with pytest.warns(UserWarning, match=r"lids on its holes make 16\.67% of its volume"):
        mesh = Mesh(vertices=CUBE[0], faces=CUBE[1][2:], repair=True)
    assert mesh.volume == pytest.approx(6.4e-5)
    assert mesh.volume_change == pytest.approx(1.0 / 6.0)
    assert "16.67% of it by repair" in repr(mesh)
    assert mesh.scaled(2.0).volume_change == mesh.volume_change


@pytest.mark.parametrize("holes", [[0], [100, 101], [40, 300, 301, 302, 600]])
def test_a_ball_with_small_holes_keeps_its_volume(holes):
    whole = Mesh(vertices=BALL[0], faces=BALL[1])
    with pytest.warns(UserWarning, match="was repaired"):
        mesh = Mesh(vertices=BALL[0], faces=np.delete(BALL[1], holes, axis=0), repair=True)
    assert mesh.volume == pytest.approx(whole.volume, rel=2e-3)
    assert 0.0 < mesh.volume_change < 0.02


def test_faces_that_wind_at_random_are_turned(recwarn):
    faces, turned = BALL[1].copy(), np.random.default_rng(0).random(len(BALL[1])) < 0.5
    faces[turned] = faces[turned][:, ::-1]
    mesh = Mesh(vertices=BALL[0], faces=faces, repair=True)
    assert mesh.volume == pytest.approx(Mesh(vertices=BALL[0], faces=BALL[1]).volume)
    assert mesh.volume_change == 0.0
    assert not recwarn.list


def test_of_two_parts_the_one_that_is_turned_inwards_is_turned_and_a_cavity_stays():
    vertices, faces = meshes.hollow_ball(0.05, 0.035, 16)
    small = CUBE[0] + np.array((0.2, 0.0, 0.0))
    both = np.concatenate([vertices, small])
    joined = np.concatenate([faces, CUBE[1][:, ::-1] + len(vertices)])
    mesh = Mesh(vertices=both, faces=joined, repair=True)
    assert mesh.volume == pytest.approx(Mesh(vertices=vertices, faces=faces).volume + 6.4e-5)


def test_faces_that_are_there_twice_and_vertices_that_differ_by_round_off_count_once():
    loose = CUBE[0][CUBE[1]].reshape(-1, 3)
    loose = loose + 1e-10 * np.random.default_rng(0).normal(size=loose.shape)
    faces = np.arange(len(loose)).reshape(-1, 3)
    mesh = Mesh(vertices=loose, faces=np.concatenate([faces, faces[:2]]), repair=True)
    assert mesh.volume == pytest.approx(6.4e-5)


def test_what_repair_makes_no_solid_of_is_an_error():
    with pytest.raises(ValueError, match="Mesh must"):
        Mesh(vertices=CUBE[0], faces=CUBE[1][:1], repair=True)


@pytest.mark.parametrize("triangles", [CUBE, (CUBE[0], CUBE[1][4:]), (BALL[0], BALL[1][::2])])
def test_the_hull_of_a_convex_mesh_is_the_mesh_closed_or_not(triangles):
    pytest.importorskip("scipy")
    mesh = Mesh(vertices=triangles[0], faces=triangles[1], convex_hull=True)
    whole = Mesh(vertices=triangles[0], faces=(CUBE if len(triangles[0]) == 8 else BALL)[1])
    assert mesh.volume == pytest.approx(whole.volume)
    np.testing.assert_allclose(mesh.inertia(1.0), whole.inertia(1.0))


def test_the_hull_of_a_bowl_has_no_hollow():
    pytest.importorskip("scipy")
    vertices, faces = meshes.bowl(0.05, 0.036)
    hull = Mesh(vertices=vertices, faces=faces, convex_hull=True)
    assert hull.volume > 1.4 * Mesh(vertices=vertices, faces=faces).volume


def test_the_hull_of_points_in_a_plane_is_an_error():
    pytest.importorskip("scipy")
    with pytest.raises(ValueError, match="must span a volume for convex_hull, got 8 in a plane"):
        Mesh(vertices=CUBE[0] * np.array((1.0, 1.0, 0.0)), faces=CUBE[1], convex_hull=True)


def test_bad_settings_are_named(monkeypatch):
    with pytest.raises(ValueError, match="either convex_hull or repair"):
        Mesh(vertices=CUBE[0], faces=CUBE[1], convex_hull=True, repair=True)
    with pytest.raises(TypeError, match=r"Mesh\.repair must be True or False, got 1"):
        Mesh(vertices=CUBE[0], faces=CUBE[1], repair=1)
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    with pytest.raises(ImportError, match=r"needs scipy.*'\.\[mesh\]'"):
        Mesh(vertices=CUBE[0], faces=CUBE[1], convex_hull=True)


def test_a_scene_with_a_repaired_mesh_is_written_and_read():
    with pytest.warns(UserWarning, match="was repaired"):
        mesh = Mesh(vertices=CUBE[0], faces=CUBE[1][2:], repair=True)
    scene = Scene([Body(mesh, mass=0.1)])
    assert Scene.from_json(scene.to_json()) == scene
