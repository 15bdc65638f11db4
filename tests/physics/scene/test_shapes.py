"""Samples lie on the core, weights sum as promised, distances are those of brute force."""

import numpy as np
import pytest

from physics.collision.distances import box_distance, capsule_distance, sphere_distance
from physics.scene.shapes import Box, Capsule, Shape, Sphere

BOXES = [Box((0.02, 0.02, 0.02)), Box((0.02, 0.03, 0.07)), Box((0.1, 0.1, 0.004))]
SPACINGS = [1.0, 0.5, 0.25]


def samples_of(box, spacing, rounding=0.0):
    return box.samples(spacing * box.width, rounding)


@pytest.mark.parametrize("shape", [*BOXES, Sphere(0.1), Capsule(0.1, 0.2)], ids=str)
def test_every_shape_keeps_the_protocol(shape):
    assert isinstance(shape, Shape)
    assert 0.0 < shape.width <= 2.0 * shape.reach
    assert 0.0 < shape.volume <= 4.2 * shape.reach**3


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("box", BOXES, ids=str)
def test_samples_of_a_box_lie_on_the_edges_of_its_core(box, spacing):
    points, _, radius, _ = samples_of(box, spacing, 1e-3)
    core = np.array(box.half_extents) - 1e-3
    assert radius == 1e-3
    on_face = np.isclose(np.abs(points), core)
    assert np.all(np.abs(points) <= core + 1e-12)
    assert np.all(on_face.sum(axis=-1) >= 2)
    assert len(np.unique(np.round(points, 9), axis=0)) == len(points)


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("box", BOXES, ids=str)
def test_neighbours_along_an_edge_are_no_further_apart_than_the_spacing(box, spacing):
    points, *_ = samples_of(box, spacing)
    for axis in range(3):
        others = [i for i in range(3) if i != axis]
        edge = np.all(np.isclose(points[:, others], np.array(box.half_extents)[others]), axis=-1)
        gaps = np.diff(np.sort(points[edge, axis]))
        assert gaps.max() <= spacing * box.width * (1 + 1e-9)
        np.testing.assert_allclose(gaps, gaps[0])


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("box", BOXES, ids=str)
def test_every_face_of_a_box_has_weight_one(box, spacing):
    points, weights, *_ = samples_of(box, spacing)
    for axis in range(3):
        for sign in (-1, 1):
            face = np.isclose(points[:, axis], sign * box.half_extents[axis])
            assert weights[face].sum() == pytest.approx(1.0)


@pytest.mark.parametrize("spacing", [0.5, 0.25])
def test_edges_and_corners_weigh_the_same_at_every_spacing(spacing):
    points, weights, *_ = samples_of(BOXES[0], spacing)
    faces = np.isclose(np.abs(points), 0.02).sum(axis=-1)
    assert weights[faces == 3] == pytest.approx(1 / 8)
    edge = np.isclose(points[:, 0], 0.02) & np.isclose(points[:, 1], 0.02)
    assert weights[edge].sum() == pytest.approx(3 / 8)


def test_a_cube_has_8_20_and_44_samples():
    assert [len(samples_of(BOXES[0], s).weights) for s in SPACINGS] == [8, 20, 44]


def test_a_capsule_has_its_samples_on_its_axis():
    for spacing in (1.0, 0.1, 0.05):
        points, weights, radius, _ = Capsule(0.1, 0.2).samples(spacing, 0.0)
        assert radius == 0.1
        np.testing.assert_array_equal(points[:, :2], 0.0)
        assert points[:, 2].min() == -0.2
        assert points[:, 2].max() == 0.2
        assert weights.sum() == pytest.approx(1.0)
        assert np.diff(points[:, 2]).max() <= spacing + 1e-12


@pytest.mark.parametrize("spacing", SPACINGS)
@pytest.mark.parametrize("box", BOXES, ids=str)
def test_particles_fill_a_box_out_to_its_faces(box, spacing):
    points, weights, radius, _ = box.particles(spacing * box.width)
    np.testing.assert_allclose(points.max(axis=0) + radius, box.half_extents)
    np.testing.assert_allclose(points.min(axis=0) - radius, -np.array(box.half_extents))
    assert np.all(weights == weights[0])


def test_a_face_of_particles_of_a_cube_has_weight_one():
    points, weights, radius, _ = BOXES[0].particles(0.01)
    assert weights[np.isclose(points[:, 2] + radius, 0.02)].sum() == pytest.approx(1.0)


def box_surface(half, n=81):
    line = np.linspace(-1, 1, n)
    u, v = (a.ravel() for a in np.meshgrid(line, line))
    faces = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            faces.append(np.insert(np.stack([u, v], axis=-1), axis, sign, axis=-1) * half)
    return np.concatenate(faces)


HALF = np.array([0.3, 0.2, 0.1])
CORES = {
    "sphere": (sphere_distance, (0.0, 0.0, 0.0), np.zeros((1, 3)), None),
    "capsule": (
        capsule_distance,
        (0.0, 0.0, 0.3),
        np.linspace([0, 0, -0.3], [0, 0, 0.3], 4001),
        None,
    ),
    "box": (
        lambda *p: box_distance(*p, 0.0, 1e-3, False)[:4],
        tuple(HALF),
        box_surface(HALF),
        HALF,
    ),
}


@pytest.mark.parametrize("name", CORES)
def test_distance_and_normal_agree_with_brute_force(name):
    distance, core, surface, half = CORES[name]
    for point in np.random.default_rng(0).uniform(-0.6, 0.6, (200, 3)):
        away = point - surface
        lengths = np.sqrt(np.sum(away**2, axis=-1))
        expected = lengths.min()
        inside = half is not None and bool(np.all(np.abs(point) < half))
        d, *normal = distance(*point, *core)
        assert d == pytest.approx(-expected if inside else expected, abs=3e-4)
        assert np.linalg.norm(normal) == pytest.approx(1.0)
        # the normal is the gradient of the distance
        step = 1e-6 * np.eye(3)
        slope = [
            (distance(*(point + s), *core)[0] - distance(*(point - s), *core)[0]) / 2e-6
            for s in step
        ]
        np.testing.assert_allclose(normal, slope, atol=1e-4)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("sharp", [False, True])
def test_a_point_inside_a_box_leaves_by_the_face_it_came_through(axis, side, sharp):
    rng = np.random.default_rng(axis)
    normal = np.zeros(3)
    normal[axis] = side
    for _ in range(50):
        # over the face, then anywhere inside, nearer to other faces or beyond the middle
        over = rng.uniform(-1.0, 1.0, 3) * HALF
        over[axis] = side * (HALF[axis] + 0.01)
        *_, face = box_distance(*over, *HALF, 0.0, 1e-3, sharp)
        assert face == side * (axis + 1)
        within = rng.uniform(-1.0, 1.0, 3) * HALF
        d, *found, kept = box_distance(*within, *HALF, face, 1e-3, sharp)
        assert d == pytest.approx(side * within[axis] - HALF[axis])
        np.testing.assert_array_equal(found, normal)
        assert kept == face


@pytest.mark.parametrize("name", CORES)
def test_the_middle_of_a_core_has_a_normal_too(name):
    distance, core, *_ = CORES[name]
    d, *normal = distance(0.0, 0.0, 0.0, *core)
    assert np.isfinite(d)
    assert np.linalg.norm(normal) == pytest.approx(1.0)
