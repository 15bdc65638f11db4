"""A mesh is drawn as balls along its surface, in a box."""

import numpy as np

from physics import Mesh
from physics.reference import meshes
from rigid_envs.rendering.scene_view import _items


def test_a_mesh_is_balls_that_touch_its_surface_from_inside_in_a_box_around_it():
    vertices, faces = meshes.knight(around=12, along=20)
    mesh = Mesh(vertices=vertices, faces=faces)
    (item,) = _items(mesh, np.zeros(3), np.array((0.0, 0.0, 0.0, 1.0)), (200, 0, 0), None)
    corners = np.abs(mesh.triangles).max(axis=(0, 1))
    np.testing.assert_allclose(item.shape.half_extents, corners)
    assert len(item.particles.positions) > 50
    assert np.all(np.abs(item.particles.positions) <= corners)
