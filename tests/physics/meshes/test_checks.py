"""Meshes that are no solid raise errors that say what is wrong and what to do."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from physics import Body, Mesh, Scene
from physics.reference import meshes

VERTICES, FACES = meshes.cuboid((0.02, 0.02, 0.02))


def test_an_open_mesh_names_the_number_of_open_edges():
    with pytest.raises(ValueError, match=r"must be closed, got 3 open edges.*fill_holes"):
        Mesh(vertices=VERTICES, faces=FACES[:-1])


def test_an_inverted_mesh_says_how_to_turn_it():
    with pytest.raises(ValueError, match=r"got an inverted mesh .*faces\[:, ::-1\]"):
        Mesh(vertices=VERTICES, faces=FACES[:, ::-1])


def test_faces_that_disagree_are_named():
    faces = FACES.copy()
    faces[3] = faces[3, ::-1]
    with pytest.raises(ValueError, match=r"got 3 edges at which two faces disagree.*fix_normals"):
        Mesh(vertices=VERTICES, faces=faces)


def together(*parts):
    """Several meshes in one, each with its offset in m and whether it is turned inwards."""
    vertices, faces, count = [], [], 0
    for half, offset, inwards in parts:
        v, f = meshes.cuboid(half)
        vertices.append(v + np.array(offset))
        faces.append((f[:, ::-1] if inwards else f) + count)
        count += len(v)
    return {"vertices": np.concatenate(vertices), "faces": np.concatenate(faces)}


LARGE = ((0.05, 0.05, 0.05), (0.0, 0.0, 0.0), False)


@pytest.mark.parametrize("place", [0.075, 0.076, 0.2, 100.0])
def test_a_part_that_is_turned_inwards_beside_another_is_named(place):
    """Flush, apart or far apart; its volume would count negative."""
    small = ((0.025, 0.025, 0.025), (place, 0.0, 0.0), True)
    with pytest.raises(ValueError, match=r"a part of 12 faces from \(.*volume -0.000125 m\^3"):
        Mesh(**together(LARGE, small))


def test_of_a_large_part_turned_inwards_and_a_small_one_the_large_one_is_named():
    large = (LARGE[0], LARGE[1], True)
    with pytest.raises(ValueError, match=r"a part of 12 faces.*volume -0.001 m\^3"):
        Mesh(**together(large, ((0.025, 0.025, 0.025), (0.2, 0.0, 0.0), False)))


def test_a_part_turned_inwards_that_shares_an_edge_is_named():
    small = ((0.05, 0.05, 0.025), (0.1, 0.1, 0.025), True)
    with pytest.raises(ValueError, match="a part of 12 faces"):
        Mesh(**together(LARGE, small))


def test_a_cavity_that_sticks_out_of_its_part_is_named():
    with pytest.raises(ValueError, match="not a cavity"):
        Mesh(**together(LARGE, ((0.04, 0.01, 0.01), (0.03, 0.0, 0.0), True)))


def test_cavities_solids_in_them_and_several_parts_are_right():
    cavity = ((0.04, 0.04, 0.04), (0.0, 0.0, 0.0), True)
    inner = ((0.02, 0.02, 0.02), (0.0, 0.0, 0.0), False)
    beside = ((0.025, 0.025, 0.025), (0.075, 0.0, 0.0), False)
    mesh = Mesh(**together(LARGE, cavity, inner, beside))
    assert mesh.volume == pytest.approx(0.001 - 0.000512 + 0.000064 + 0.000125)


def test_a_flat_mesh_has_no_volume():
    flat = VERTICES * np.array([1.0, 1.0, 0.0])
    with pytest.raises(ValueError, match="must enclose a volume"):
        Mesh(vertices=flat, faces=FACES)


def test_a_sheet_as_thin_as_round_off_has_no_volume():
    """A file in single precision: it took minutes to build."""
    with pytest.raises(ValueError, match=r"a sheet of 2e-09 m; give it a thickness"):
        Mesh(vertices=VERTICES * np.array((1.0, 1.0, 5e-8)), faces=FACES)


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({}, TypeError, "either a source or vertices and faces"),
        ({"vertices": VERTICES}, TypeError, "either a source or vertices and faces"),
        ({"vertices": VERTICES[:, :2], "faces": FACES}, ValueError, r"\(n, 3\), got \(8, 2\)"),
        ({"vertices": VERTICES * np.nan, "faces": FACES}, ValueError, "must be finite"),
        ({"vertices": VERTICES, "faces": FACES + 1}, ValueError, "of the vertices, got 1 to 8"),
        ({"vertices": VERTICES, "faces": FACES * 1.0}, TypeError, "must be integers, got float64"),
        ({"vertices": VERTICES, "faces": FACES[:, :2]}, ValueError, r"triangles of shape \(m, 3\)"),
        ({"vertices": VERTICES, "faces": FACES[:2]}, ValueError, "enclose a volume, got 2"),
        ({"vertices": VERTICES, "faces": FACES, "scale": 0.0}, ValueError, "Mesh.scale"),
        ({"vertices": VERTICES, "faces": FACES, "cells": 4}, ValueError, "Mesh.cells must be at"),
        ({"vertices": VERTICES, "faces": FACES, "fill": "full"}, ValueError, "'shell', 'solid'"),
        ({"vertices": VERTICES, "faces": FACES, "particle_count": 0}, ValueError, "particle_count"),
    ],
)  # fmt: skip
def test_other_bad_input_names_the_field(settings, error, message):
    with pytest.raises(error, match=message):
        Mesh(**settings)


def test_degenerate_triangles_and_doubled_vertices_do_no_harm():
    """As files of separate triangles have them."""
    loose = VERTICES[FACES].reshape(-1, 3)
    faces = np.concatenate([np.arange(len(loose)).reshape(-1, 3), [[0, 0, 1], [2, 2, 2]]])
    assert Mesh(vertices=loose, faces=faces).volume == pytest.approx(6.4e-5)


def test_walls_thinner_than_the_cells_of_the_grid_warn_with_the_number_of_cells():
    thin = Mesh(vertices=meshes.bowl(0.05, 0.048)[0], faces=meshes.bowl(0.05, 0.048)[1], cells=16)
    with pytest.warns(UserWarning, match=r"walls 0.0\d+ m thick.*Mesh.cells.*at least \d\d"):
        _ = thin.grid


def test_walls_thinner_than_the_particles_warn_and_a_mesh_without_particles_is_an_error():
    thin = Mesh(vertices=meshes.bowl(0.05, 0.048)[0], faces=meshes.bowl(0.05, 0.048)[1])
    with pytest.warns(UserWarning, match=r"thinner than the spacing of 0.00769 m of particles"):
        thin.particles(0.008)
    hole = meshes.hollow_ball(0.05, 0.0499, 16)
    with pytest.raises(ValueError, match="has no particle: its walls"):
        Mesh(vertices=hole[0], faces=hole[1]).particles(0.06)


def test_a_scene_with_a_mesh_is_written_and_read_bit_by_bit():
    mesh = Mesh(vertices=VERTICES, faces=FACES, scale=0.3, cells=20, particle_count=100)
    scene = Scene([Body(mesh, mass=0.1)])
    again = Scene.from_json(scene.to_json())
    assert again == scene
    assert hash(again) == hash(scene)
    assert again != Scene([Body(replace(mesh, cells=21), mass=0.1)])


def test_the_text_of_a_mesh_is_short():
    assert repr(Mesh(vertices=VERTICES, faces=FACES)).startswith("Mesh(8 vertices, 12 faces")


# --- files; they need trimesh ---------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["stl", "obj", "ply"])
def test_a_file_gives_the_same_solid_as_its_arrays(ending, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    whole = trimesh.Trimesh(VERTICES, FACES)
    whole.export(tmp_path / f"cube.{ending}")
    for source in (whole, tmp_path / f"cube.{ending}", str(tmp_path / f"cube.{ending}")):
        mesh = Mesh(source)
        assert mesh.volume == pytest.approx(6.4e-5, rel=1e-6)
        assert mesh.width == pytest.approx(0.04, rel=1e-6)


def test_what_is_not_a_mesh_file_is_named(tmp_path):
    pytest.importorskip("trimesh")
    with pytest.raises(ValueError, match=r"must be an existing file, got .*none.stl"):
        Mesh(tmp_path / "none.stl")
    for name, content in {"text.stl": "a letter", "empty.obj": "", "data.xyz1": "1 2 3"}.items():
        (tmp_path / name).write_text(content)
        with pytest.raises(ValueError, match=rf"Mesh.source must .*{name}"):
            Mesh(tmp_path / name)
    with pytest.raises(TypeError, match=r"must be a path or a .*Trimesh, got 3"):
        Mesh(3)


def test_without_trimesh_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(ImportError, match=r"constraints.txt -e '\.\[mesh\]'"):
        Mesh("cube.stl")
    assert Mesh(vertices=VERTICES, faces=FACES).volume > 0.0
