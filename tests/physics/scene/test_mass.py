"""Closed forms of inertia, and what sets of particles converge to."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from physics.scene import mass
from physics.scene.shapes import Box, Capsule, Sphere

SOLIDS = {
    "sphere": (Sphere(0.3), lambda p: np.sum(p**2, axis=-1) < 0.09),
    "box": (
        Box((0.1, 0.2, 0.3)),
        lambda p: np.all(np.abs(p) < np.array([0.1, 0.2, 0.3]), axis=-1),
    ),
    "capsule": (
        Capsule(0.1, 0.2),
        lambda p: (
            p[..., 0] ** 2 + p[..., 1] ** 2 + np.maximum(np.abs(p[..., 2]) - 0.2, 0.0) ** 2 < 0.01
        ),
    ),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_a_lattice_of_particles_converges_to_the_solid(name):
    shape, inside = SOLIDS[name]
    axis = 0.33 * ((np.arange(90) + 0.5) / 45 - 1.0)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[inside(points)]
    cell = (0.66 / 90) ** 3
    assert len(points) * cell == pytest.approx(shape.volume, rel=0.02)
    particles = mass.of_particles(points, np.full(len(points), 7.0 / len(points)))
    np.testing.assert_allclose(particles.center, 0.0, atol=1e-12)
    np.testing.assert_allclose(
        particles.inertia, np.diag(shape.inertia(7.0)), rtol=0.02, atol=1e-12
    )


def test_the_parallel_axis_theorem_agrees_with_the_sum_over_particles():
    rng = np.random.default_rng(0)
    points, masses, offset = (
        rng.normal(size=(20, 3)),
        rng.uniform(1, 2, 20),
        np.array([1.0, 2.0, -3.0]),
    )
    body = mass.of_particles(points, masses)
    r = points - (body.center + offset)
    about = np.einsum("n,nk,nk->", masses, r, r) * np.eye(3) - np.einsum(
        "n,ni,nj->ij", masses, r, r
    )
    np.testing.assert_allclose(
        mass.parallel_axis(body.inertia, body.mass, offset), about, rtol=1e-12
    )


def test_eight_small_boxes_make_up_a_large_one():
    half = np.array([0.1, 0.2, 0.3])
    small = np.diag(mass.box_inertia(1.0, half / 2))
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    place = np.array([5.0, -1.0, 2.0])
    whole = mass.combine([mass.MassProperties(1.0, place + c * half / 2, small) for c in corners])
    assert whole.mass == 8.0
    np.testing.assert_allclose(whole.center, place)
    np.testing.assert_allclose(whole.inertia, np.diag(mass.box_inertia(8.0, half)), atol=1e-12)


def test_a_part_that_is_turned_brings_its_turned_tensor():
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    part = mass.MassProperties(
        2.0, np.zeros(3), np.diag(mass.box_inertia(2.0, np.array([1, 2, 3])))
    )
    whole = mass.combine([part], [turn])
    expected = np.diag(mass.box_inertia(2.0, np.array([2, 1, 3])))
    np.testing.assert_allclose(whole.inertia, expected, atol=1e-12)


def test_compound_and_particles_agree_on_a_dumbbell():
    # two balls on a rod without mass
    ball = np.diag(mass.sphere_inertia(1.0, 0.1))
    ends = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5]])
    compound = mass.combine([mass.MassProperties(1.0, e, ball) for e in ends])
    particles = mass.of_particles(ends, np.ones(2), radius=0.1)
    np.testing.assert_allclose(compound.inertia, particles.inertia)


@pytest.mark.parametrize("points", [[[1.0, 2.0, 3.0]], [[0, 0, 0], [1, 1, 1], [2, 2, 2]]])
def test_a_radius_makes_the_tensor_of_a_point_or_a_line_regular(points):
    masses = np.ones(len(points))
    bare = np.linalg.eigvalsh(mass.of_particles(points, masses).inertia)
    round_ = np.linalg.eigvalsh(mass.of_particles(points, masses, radius=0.1).inertia)
    assert abs(bare[0]) < 1e-12
    np.testing.assert_allclose(round_, bare + 0.4 * len(points) * 0.01)


def test_a_capsule_of_no_length_is_a_sphere():
    np.testing.assert_allclose(
        mass.capsule_inertia(2.0, 0.1, 1e-12), mass.sphere_inertia(2.0, 0.1), rtol=1e-9
    )
