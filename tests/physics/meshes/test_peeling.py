"""Depth peeling finds every layer: volumes of any mesh in any pose, cavities, and their limits."""

import warnings

import numpy as np
import pytest

from physics import Mesh
from physics.meshes.lattice import lattice
from physics.meshes.peeling import PixelGrid, peel
from physics.meshes.properties import properties
from physics.reference import meshes
from physics.rotation import rotation_matrix


def poses(triangles, count, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        q = rng.normal(size=4)
        yield triangles[0] @ rotation_matrix(q / np.linalg.norm(q)).T, triangles[1]


def errors(triangles, along, count):
    """Relative errors of the volume, by the number of particles and by the intervals."""
    volume, found = properties(*triangles).volume, []
    for vertices, faces in poses(triangles, count):
        spacing = np.ptp(vertices, axis=0).max() / along
        points = lattice(vertices, faces, spacing)
        found.append(
            (len(points.positions) * spacing**3 / volume - 1.0, points.volume / volume - 1.0)
        )
    return np.sqrt(np.mean(np.square(found), axis=0))


@pytest.mark.parametrize("name", meshes.SHAPES)
def test_forty_particles_along_a_mesh_have_its_volume(name):
    by_count, by_intervals = errors(meshes.SHAPES[name](), 40, 20)
    assert by_count < 0.04
    assert by_intervals < 0.01


@pytest.mark.parametrize("name", meshes.SHAPES)
def test_the_volume_converges_over_five_spacings(name):
    found = np.array([errors(meshes.SHAPES[name](), along, 8) for along in (10, 20, 40, 80, 160)])
    # by the count of points in a volume with a smooth surface at least as the spacing, on average
    slopes = np.polyfit(np.log([10, 20, 40, 80, 160]), np.log(found), 1)[0]
    assert np.all(slopes < -1.0)
    assert np.all(found[-1] < 2e-3)


@pytest.mark.parametrize("axis", range(3))
def test_the_cavity_of_a_hollow_ball_is_empty(axis):
    triangles = meshes.hollow_ball(0.05, 0.035)
    points = lattice(*triangles, 0.1 / 40, axis)
    distance = np.linalg.norm(points.positions, axis=1)
    assert distance.min() > 0.034
    assert distance.max() < 0.05
    # a ray through the middle has two layers of wall
    middle = peel(*triangles, PixelGrid(axis, (1e-5, 2e-5), 1.0, (1, 1)))
    np.testing.assert_allclose(middle.low, [-0.05, 0.035], atol=2e-4)
    np.testing.assert_allclose(middle.high, [-0.035, 0.05], atol=2e-4)


def test_rays_through_edges_and_vertices_count_once():
    """Of a cube of cubes: every ray passes through vertices, edges or along faces."""
    vertices, faces = meshes.cuboid((1.0, 1.0, 1.0))
    for axis in range(3):
        grid = PixelGrid(axis, (-1.5, -1.5), 0.5, (7, 7))
        found = peel(vertices, faces, grid)
        i, j = np.divmod(found.ray, 7)
        assert set(zip(i.tolist(), j.tolist(), strict=True)) in (
            {(a, b) for a in range(1, 5) for b in range(1, 5)},
            {(a, b) for a in range(1, 5) for b in range(2, 6)},
            {(a, b) for a in range(2, 6) for b in range(1, 5)},
            {(a, b) for a in range(2, 6) for b in range(2, 6)},
        )
        np.testing.assert_array_equal(found.low, -1.0)
        np.testing.assert_array_equal(found.high, 1.0)


def test_every_ray_of_a_closed_mesh_leaves_as_often_as_it_enters():
    """Also where rays pass through the vertices themselves: on a lattice of the same points."""
    vertices, faces = meshes.knight(around=16, along=24)
    vertices = np.round(vertices, 3)
    exact = properties(vertices, faces).volume
    found = peel(vertices, faces, PixelGrid(2, (-0.03, -0.03), 5e-4, (121, 121)))
    assert np.sum(found.high - found.low) * 5e-4**2 == pytest.approx(exact, rel=0.02)


def test_solids_that_overlap_count_once():
    a, b = meshes.cuboid((0.02, 0.02, 0.02)), meshes.cuboid((0.02, 0.02, 0.02))
    vertices = np.concatenate([a[0], b[0] + np.array([0.02, 0.0, 0.0])])
    faces = np.concatenate([a[1], b[1] + len(a[0])])
    assert lattice(vertices, faces, 1e-3).volume == pytest.approx(0.06 * 0.04 * 0.04, rel=1e-9)


def test_particles_of_a_box_fill_it_exactly():
    mesh = Mesh(
        vertices=meshes.cuboid((0.02, 0.03, 0.05))[0],
        faces=meshes.cuboid((0.02, 0.03, 0.05))[1],
        fill="solid",
    )
    positions, weights, radius, _ = mesh.particles(0.01)
    assert len(positions) == 4 * 6 * 10
    assert radius == pytest.approx(0.005)
    np.testing.assert_allclose(positions.max(axis=0) + radius, (0.02, 0.03, 0.05))
    for axis in range(3):
        face = np.isclose(positions[:, axis], positions[:, axis].max())
        assert weights[face].sum() <= 1.0 + 1e-12
    assert weights[np.isclose(positions[:, 0], positions[:, 0].max())].sum() == pytest.approx(1.0)


@pytest.mark.parametrize("fill", ["shell", "solid"])
def test_a_budget_of_particles_is_kept_and_nearly_used(fill):
    vertices, faces = meshes.knight(around=16, along=24)
    for budget in (50, 400):
        mesh = Mesh(vertices=vertices, faces=faces, fill=fill, particle_count=budget)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # fifty are coarser than its muzzle
            count = len(mesh.particles(1.0).weights)
        assert 0.8 * budget <= count <= budget


def test_a_hundred_thousand_particles_fill_a_knight():
    vertices, faces = meshes.knight()
    spacing = (properties(vertices, faces).volume / 100_000) ** (1.0 / 3.0)
    assert len(lattice(vertices, faces, spacing).positions) == pytest.approx(100_000, rel=0.02)
