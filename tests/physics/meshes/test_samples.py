"""Samples and sides of meshes, and the distances of their grids."""

import numpy as np
import pytest

from physics import Box, Mesh
from physics.collision.grid_distance import grid_distance, interpolated
from physics.meshes.distance_grid import distance_grid, triangle_square
from physics.meshes.sides import sides, weights
from physics.model.tables import GRID_TABLE
from physics.reference import meshes


def mesh_of(triangles, **settings):
    return Mesh(vertices=triangles[0], faces=triangles[1], **settings)


CUBE = mesh_of(meshes.cuboid((0.02, 0.02, 0.02)))


@pytest.mark.parametrize("spacing", [0.04, 0.02])
def test_a_meshed_cube_has_the_samples_and_weights_of_a_box(spacing):
    mesh, box = CUBE.samples(spacing, 2e-3), Box((0.02, 0.02, 0.02)).samples(spacing, 2e-3)
    assert mesh.radius == box.radius
    rows = [np.column_stack([s.positions, s.weights]).round(12) for s in (mesh, box)]
    np.testing.assert_allclose(*(row[np.lexsort(row.T)] for row in rows), atol=1e-11)


@pytest.mark.parametrize("spacing", [0.02, 0.01, 0.005])
@pytest.mark.parametrize("name", ["bowl", "knight"])
def test_each_flat_side_of_a_mesh_has_weight_one_at_every_spacing(name, spacing):
    mesh = mesh_of(meshes.SHAPES[name]())
    positions, shares, *_ = mesh.samples(spacing, 0.0)
    assert len(mesh.sides()) >= 1
    for normal in mesh.sides():
        height = positions @ normal
        assert shares[height > height.max() - 1e-6].sum() == pytest.approx(1.0, abs=0.25)


def test_no_side_has_more_than_weight_one():
    points = np.random.default_rng(0).normal(size=(40, 3))
    shares = weights(points, points, 0.0)
    for normal in sides(points):
        height = points @ normal
        assert shares[height > height.max() - 1e-9].sum() <= 1.0 + 1e-9


def test_sides_are_planes_that_at_least_three_points_touch_and_none_is_above():
    points = np.random.default_rng(1).normal(size=(60, 3))
    found = sides(points)
    heights = found @ points.T
    highest = heights.max(axis=1, keepdims=True)
    assert np.all((heights > highest - 1e-9).sum(axis=1) >= 3)
    assert len(found) > 20


@pytest.mark.parametrize("spacing", [0.02, 0.01, 0.005])
def test_no_point_of_a_round_mesh_is_farther_from_a_sample_than_the_spacing_allows(spacing):
    mesh = mesh_of(meshes.ball(0.02, 48))
    positions = mesh.samples(spacing, 0.0).positions
    corners = mesh.triangles.reshape(-1, 3)
    apart = np.linalg.norm(corners[:, None] - positions, axis=2).min(axis=1)
    assert apart.max() <= spacing / np.sqrt(3.0) * (1.0 + 1e-9)


def test_samples_of_a_round_mesh_touch_its_surface_from_inside():
    positions, _, radius, _ = mesh_of(meshes.ball(0.02, 48)).samples(0.01, 2e-3)
    np.testing.assert_allclose(np.linalg.norm(positions, axis=1) + radius, 0.02, rtol=2e-3)


# --- distances ------------------------------------------------------------------------------------


class Grids:
    """A model of one grid, as kernels read it."""

    def __init__(self, grid):
        row = np.zeros(1, dtype=GRID_TABLE)
        row["count"], row["origin"], row["cell"] = grid.values.shape, grid.origin, grid.cell
        row["low"], row["high"] = grid.low, grid.high
        row["first_point"], row["point_count"] = grid.values.size, len(grid.points)
        self.grid = row.view(np.recarray)
        self.grid_value = np.concatenate([grid.values.ravel(), grid.points.ravel()])


def test_the_grid_of_a_box_is_exact_at_its_nodes():
    grid = distance_grid(*meshes.cuboid((0.02, 0.03, 0.05)), 24)
    nodes = grid.origin + grid.cell * np.moveaxis(np.indices(grid.values.shape), 0, -1)
    beyond = np.abs(nodes) - np.array((0.02, 0.03, 0.05))
    outside = np.sqrt(np.sum(np.maximum(beyond, 0.0) ** 2, axis=-1))
    exact = outside + np.minimum(beyond.max(axis=-1), 0.0)
    np.testing.assert_allclose(grid.values, exact, atol=1e-15)


def ball_errors(cells, distances):
    """Largest error of distance in m and normal in rad, at distances in m from a ball's surface."""
    model = Grids(distance_grid(*meshes.ball(0.02, 96), cells))
    rng, found = np.random.default_rng(0), []
    for away in distances:
        for _ in range(60):
            way = rng.normal(size=3)
            way /= np.linalg.norm(way)
            d, *normal = grid_distance(model, 0, 1.0, *((0.02 + away) * way))
            found.append((abs(d - away), np.arccos(min(1.0, float(way @ normal)))))
    return np.max(found, axis=0)


def test_distance_and_normal_converge_with_the_cells():
    """With the square of the cell and with the cell, until the faces of the mesh show."""
    coarse, fine = (ball_errors(cells, (-2e-3, 0.0, 1e-3)) for cells in (12, 36))
    assert coarse[0] / fine[0] > 5.0
    assert coarse[1] / fine[1] > 2.0
    assert fine[0] < 5e-5
    assert fine[1] < 0.05


@pytest.mark.parametrize("name", ["ball", "cuboid", "knight"])
def test_points_beyond_the_grid_have_the_distance_of_the_nearest_triangle(name):
    triangles = {
        "ball": meshes.ball(0.02),
        "cuboid": meshes.cuboid((0.02, 0.03, 0.05)),
        "knight": meshes.knight(around=16, along=24),
    }[name]
    grid = distance_grid(*triangles, 32)
    corners, rng, seen = triangles[0][triangles[1]], np.random.default_rng(0), 0
    for reach in np.repeat((0.05, 0.1, 0.3), 8):
        way = rng.normal(size=3)
        point = triangles[0].mean(axis=0) + reach * way / np.linalg.norm(way)
        if np.linalg.norm(point - np.clip(point, grid.low, grid.high)) > 4.0 * grid.cell:
            exact = np.sqrt(min(triangle_square(corners, t, *point) for t in range(len(corners))))
            d, *normal = grid_distance(Grids(grid), 0, 1.0, *point)
            assert d == pytest.approx(exact, abs=0.1 * grid.cell)
            assert np.linalg.norm(normal) == pytest.approx(1.0)
            seen += 1
    assert seen > 10


def test_a_grid_scales_with_its_mesh():
    model = Grids(distance_grid(*meshes.ball(0.02, 48), 16))
    point = np.array((0.01, 0.02, 0.005))
    once, larger = (grid_distance(model, 0, s, *(s * point)) for s in (1.0, 3.0))
    np.testing.assert_allclose(larger[0], 3.0 * once[0])
    np.testing.assert_allclose(larger[1:], once[1:])


def test_a_position_that_is_not_finite_stays_within_the_grid():
    model = Grids(distance_grid(*meshes.cuboid((0.02, 0.02, 0.02)), 8))
    for bad in (np.nan, np.inf, -np.inf, 1e300):
        assert np.isfinite(interpolated(model, 0, bad, 0.0, 0.0)[0])
