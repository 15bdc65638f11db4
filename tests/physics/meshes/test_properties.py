"""Mass properties of meshes: exact for their triangles, and where the body frame is."""

import numpy as np
import pytest
import trimesh

from physics import Box, Mesh
from physics.meshes.properties import properties
from physics.model.rocking import face_contacts
from physics.reference import meshes
from physics.rotation import rotation_matrix

HALF = (0.02, 0.03, 0.05)


def mesh_of(triangles, **settings):
    return Mesh(vertices=triangles[0], faces=triangles[1], **settings)


def turned(triangles, quaternion, shift):
    vertices, faces = triangles
    q = np.array(quaternion) / np.linalg.norm(quaternion)
    return vertices @ rotation_matrix(q).T + np.array(shift), faces


def test_a_meshed_box_has_the_mass_properties_of_a_box():
    mesh, box = mesh_of(meshes.cuboid(HALF)), Box(HALF)
    assert mesh.volume == pytest.approx(box.volume, rel=1e-12)
    np.testing.assert_allclose(mesh.inertia(2.0), box.inertia(2.0), rtol=1e-12)
    np.testing.assert_allclose(mesh.centre, 0.0, atol=1e-15)
    np.testing.assert_array_equal(mesh.rotation, np.eye(3))
    assert mesh.width == pytest.approx(box.width)
    assert mesh.thickness == pytest.approx(box.width)
    assert mesh.reach == pytest.approx(box.reach)


def test_moments_that_are_equal_are_bitwise_equal():
    """Only then the engine leaves out the gyroscopic torque."""
    assert (
        len(set(mesh_of(turned(meshes.cuboid((0.02,) * 3), (1, 2, 3, 4), HALF)).inertia(1.0))) == 1
    )


def test_a_rotated_and_shifted_box_has_the_same_principal_moments():
    mesh = mesh_of(turned(meshes.cuboid(HALF), (0.1, 0.2, 0.3, 0.9), (1.0, -2.0, 0.5)))
    np.testing.assert_allclose(
        np.sort(mesh.inertia(2.0)), np.sort(Box(HALF).inertia(2.0)), rtol=1e-9
    )
    np.testing.assert_allclose(mesh.centre, (1.0, -2.0, 0.5), rtol=1e-12)
    assert np.linalg.det(mesh.rotation) == pytest.approx(1.0)


CLOSED_FORMS = {
    # volume and moments per kg
    "ball": (
        lambda n: meshes.ball(0.05, n),
        4.0 / 3.0 * np.pi * 0.05**3,
        [0.4 * 0.05**2] * 3,
    ),
    "hollow ball": (
        lambda n: meshes.hollow_ball(0.05, 0.04, n),
        4.0 / 3.0 * np.pi * (0.05**3 - 0.04**3),
        [0.4 * (0.05**5 - 0.04**5) / (0.05**3 - 0.04**3)] * 3,
    ),
    "torus": (
        lambda n: meshes.torus(0.04, 0.015, n, n),
        2.0 * np.pi**2 * 0.04 * 0.015**2,
        [0.5 * 0.04**2 + 0.625 * 0.015**2] * 2 + [0.04**2 + 0.75 * 0.015**2],
    ),
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_round_meshes_converge_to_the_closed_form_with_the_square_of_their_faces(name):
    make, volume, moments = CLOSED_FORMS[name]
    errors = []
    for n in (16, 32, 64):
        found = properties(*make(n))
        errors.append(
            [found.volume / volume - 1.0, *(np.diag(found.tensor) / np.array(moments) - 1.0)]
        )
    ratios = np.abs(errors[:-1]) / np.abs(errors[1:])
    np.testing.assert_allclose(ratios, 4.0, rtol=0.05)


def test_placed_puts_the_frame_of_the_file_at_a_pose():
    """A vertex of the file, moved with its frame, is the same vertex of the body."""
    triangles = meshes.knight(around=12, along=20)
    mesh = mesh_of(triangles, scale=2.0)
    position, orientation = mesh.placed((0.3, 0.2, 0.1), (0.1, 0.2, 0.3, 0.9))
    turn = rotation_matrix(np.array((0.1, 0.2, 0.3, 0.9)) / np.linalg.norm((0.1, 0.2, 0.3, 0.9)))
    expected = 2.0 * triangles[0][triangles[1]] @ turn.T + np.array((0.3, 0.2, 0.1))
    found = mesh.triangles @ rotation_matrix(np.array(orientation)).T + np.array(position)
    order = [np.sort(x.round(9).reshape(-1, 9), axis=0) for x in (expected, found)]
    np.testing.assert_allclose(order[0], order[1], atol=1e-8)


def test_a_scaled_mesh_is_the_mesh_in_other_units():
    mesh = mesh_of(meshes.knight(around=12, along=20))
    large = mesh.scaled(3.0)
    assert large == mesh_of(meshes.knight(around=12, along=20), scale=3.0)
    assert large.volume == pytest.approx(27.0 * mesh.volume)
    np.testing.assert_allclose(large.inertia(1.0), 9.0 * mesh.inertia(1.0))
    np.testing.assert_array_equal(large.rotation, mesh.rotation)
    small, same = mesh.samples(0.01, 1e-3), large.samples(0.03, 3e-3)
    np.testing.assert_allclose(same.positions, 3.0 * small.positions)
    np.testing.assert_array_equal(same.weights, small.weights)


def test_the_contacts_of_a_flat_side_are_those_of_that_side():
    """On a slanted side a pyramid has many samples; opposite is its apex or a corner."""
    cone = trimesh.creation.cone(0.05, 0.1, sections=3)
    pyramid = Mesh(vertices=cone.vertices, faces=cone.faces)
    slanted = [n for n in pyramid.sides() if np.abs(n).max() < 0.999]
    along = face_contacts(pyramid, 0.02)[6:]
    assert len(along) >= len(slanted) > 0
    for matrix, _ in along:  # several points resist up and down as well as two rotations
        assert np.linalg.matrix_rank(matrix) == 3
