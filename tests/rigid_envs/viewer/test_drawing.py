"""Triangles are closed surfaces of the shapes' size; the camera sees all worlds."""

import numpy as np
import pytest

from physics import Box, Capsule, Compound, Cylinder, Mesh, Part, Particles, Sphere, Torus
from rigid_envs.tasks import Push, Stack, Throw
from rigid_envs.viewer.layout import GAP, Layout
from rigid_envs.viewer.triangles import triangles

CORNERS = ((0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1))
SHAPES = [
    Sphere(0.1),
    Box((0.1, 0.2, 0.05)),
    Capsule(0.02, 0.1),
    Cylinder(0.1, 0.05),
    Torus(0.1, 0.02),
    Mesh(vertices=CORNERS, faces=((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))),
    Compound(
        [
            Part(Box((0.05, 0.02, 0.02)), position=(0.05, 0.0, 0.0)),
            Part(Sphere(0.02), position=(-0.05, 0.0, 0.0)),
        ]
    ),
    Particles(((0.0, 0.0, -0.05), (0.0, 0.0, 0.05)), 0.02),
]


def volume(mesh):
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return np.einsum("ni,ni->", a, np.cross(b, c)) / 6.0


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_triangles_face_outwards_and_enclose_the_volume(shape):
    mesh = triangles(shape)
    assert volume(mesh) == pytest.approx(shape.volume, rel=0.07)
    reach = np.linalg.norm(mesh.vertices, axis=1).max()
    assert reach == pytest.approx(shape.reach, rel=0.03)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_surfaces_are_closed(shape):
    mesh = triangles(shape)
    _, place = np.unique(mesh.vertices.round(9), axis=0, return_inverse=True)
    faces = place.reshape(-1)[mesh.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = sorted(map(tuple, edges.tolist()))
    assert there == sorted(map(tuple, edges[:, ::-1].tolist()))


def test_another_object_can_t_be_drawn():
    with pytest.raises(TypeError, match="a str can't be drawn"):
        triangles("box")


@pytest.mark.parametrize("count", [1, 2, 5, 16])
@pytest.mark.parametrize("task", [Push, Stack, Throw])
def test_floors_do_not_overlap_and_the_camera_sees_all_of_them(task, count):
    layout = Layout(count, task.camera)
    middles = layout.offsets[:, :2] + layout.centre
    apart = np.abs(middles[:, None] - middles).max(axis=-1)
    apart[np.diag_indices(count)] = np.inf
    assert (apart > 2.0 * layout.half_width + 0.99 * GAP).all()
    view = layout.view(1.5)
    corners = middles[:, None] + layout.half_width * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    points = np.pad(corners.reshape(-1, 2), ((0, 0), (0, 1)))
    pixels, depth = view.project(points, 1500, 1000)
    assert (depth > 0.0).all()
    assert ((pixels > 0.0) & (pixels < (1500.0, 1000.0))).all()
