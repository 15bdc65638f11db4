"""Depths and solids of pictures: closed forms, and that a world's picture is its own."""

import numpy as np
import pytest

from physics import Box, Capsule, Compound, Cylinder, Mesh, Part, Particles, Sphere, Torus
from physics.reference import meshes
from physics.rotation import rotation_matrix
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.renderer import Renderer
from rigid_envs.rendering.view import Goal, Item

WIDTH, HEIGHT = 96, 72
CAMERA = Camera((0.5, -0.4, 0.35), (0.0, 0.0, 0.05), 30.0)
TURNED = np.array((0.3, -0.5, 0.2, 0.6)) / np.linalg.norm((0.3, -0.5, 0.2, 0.6))
PLACE = np.array((0.02, -0.01, 0.08))
RED = (220, 40, 40)


def depths(*items, camera=CAMERA, **settings):
    frames = Renderer(WIDTH, HEIGHT, camera, **settings).frames(items, depth=True, solid=True)
    return frames.depth[0], frames.solid[0]


def rays(camera=CAMERA):
    """Origin [3] and directions [height, width, 3] of the pixels' rays, a depth of 1 m long."""
    return camera.eye, camera.rays(WIDTH, HEIGHT)


def test_the_ground_is_as_far_as_a_plane():
    eye, ray = rays()
    depth, solid = depths()
    np.testing.assert_allclose(depth, -eye[2] / ray[..., 2], rtol=1e-6)
    assert np.all(solid == -1)


def test_above_the_horizon_there_is_nothing():
    level = Camera((0.0, -1.0, 0.1), (0.0, 0.0, 0.1), 40.0)
    depth, _ = depths(camera=level)
    assert np.all(np.isinf(depth[: HEIGHT // 2]))
    assert np.all(np.isfinite(depth[HEIGHT // 2 :]))


def test_a_sphere_is_as_far_as_the_root_of_its_equation():
    radius = 0.06
    depth, solid = depths(Item(Sphere(radius), PLACE, TURNED, RED, solid=7))
    eye, ray = rays()
    offset = eye - PLACE
    a, b = (ray**2).sum(-1), ray @ offset
    root = b**2 - a * (offset @ offset - radius**2)
    hit = root > 0.0
    np.testing.assert_allclose(depth[hit], ((-b - np.sqrt(np.abs(root))) / a)[hit], rtol=1e-6)
    np.testing.assert_array_equal(solid == 7, hit)


def test_a_box_is_as_far_as_the_nearest_of_its_faces():
    """Every face's plane is cut by itself; a cut counts where it lies within the face."""
    half = np.array((0.05, 0.03, 0.04))
    depth, solid = depths(Item(Box(tuple(half)), PLACE, TURNED, RED, solid=3))
    eye, ray = rays()
    turn = rotation_matrix(TURNED)
    o, e = (eye - PLACE) @ turn, ray @ turn
    best = np.full(depth.shape, np.inf)
    for axis in range(3):
        for side in (-1.0, 1.0):
            t = (side * half[axis] - o[axis]) / e[..., axis]
            on = np.abs(o + t[..., None] * e) <= half + 1e-12
            best = np.where(on.all(axis=-1) & (t > 0.0), np.minimum(best, t), best)
    hit = np.isfinite(best)
    assert hit.sum() > 200
    np.testing.assert_allclose(depth[hit], best[hit], rtol=1e-6)
    np.testing.assert_array_equal(solid == 3, hit)


def outside(shape, points):
    """How far points of the shape's frame are from its surface, negative inside."""
    across = np.linalg.norm(points[..., :2], axis=-1)
    z = points[..., 2]
    if isinstance(shape, Capsule):
        beyond = np.abs(z) - shape.half_length
        return np.hypot(across, np.maximum(beyond, 0.0)) - shape.radius
    if isinstance(shape, Cylinder):
        return np.maximum(across - shape.radius, np.abs(z) - shape.half_length)
    return np.hypot(across - shape.major_radius, z) - shape.minor_radius


@pytest.mark.parametrize(
    "shape", [Capsule(0.03, 0.04), Cylinder(0.04, 0.03), Torus(0.05, 0.02)], ids=repr
)
def test_a_round_solid_is_seen_where_its_surface_is_and_nothing_is_in_front(shape):
    depth, solid = depths(Item(shape, PLACE, TURNED, RED, solid=0))
    eye, ray = rays()
    turn = rotation_matrix(TURNED)
    o, e = (eye - PLACE) @ turn, ray @ turn
    t = np.linspace(0.3, 1.2, 6000)
    seen = solid == 0
    assert seen.sum() > 200
    surface = o + depth[..., None].astype(float) * e
    assert np.abs(outside(shape, surface[seen])).max() < 1e-6
    for row, column in np.argwhere(np.ones_like(seen))[::7]:
        along = outside(shape, o + t[:, None] * e[row, column])
        entered = t[np.argmax(along < -1e-5)] if (along < -1e-5).any() else np.inf
        if seen[row, column]:
            assert entered > depth[row, column]
        else:
            assert np.isinf(entered)


def test_a_mesh_is_seen_like_the_box_that_it_is():
    half = (0.05, 0.03, 0.04)
    vertices, faces = meshes.cuboid(half)
    boxed, _ = depths(Item(Box(half), PLACE, TURNED, RED))
    meshed, _ = depths(Item(Mesh(vertices=vertices, faces=faces), PLACE, TURNED, RED))
    # a ray along an edge may meet either side of it
    assert np.mean(np.abs(boxed - meshed) < 1e-6) > 0.999


def test_a_compound_is_its_parts_and_particles_are_spheres():
    parts = [Part(Sphere(0.03), (-0.04, 0.0, 0.0)), Part(Sphere(0.03), (0.04, 0.0, 0.0))]
    compound, _ = depths(Item(Compound(parts), PLACE, TURNED, RED))
    pair, _ = depths(Item(Particles([(-0.04, 0, 0), (0.04, 0, 0)], 0.03), PLACE, TURNED, RED))
    turn = rotation_matrix(TURNED)
    spheres = [Item(Sphere(0.03), PLACE + turn @ (x, 0, 0), TURNED, RED) for x in (-0.04, 0.04)]
    apart, _ = depths(*spheres)
    np.testing.assert_allclose(compound, apart, rtol=1e-6)
    np.testing.assert_allclose(pair, apart, rtol=1e-6)


def test_a_world_is_drawn_as_if_it_were_alone_with_any_number_of_threads():
    rng, worlds = np.random.default_rng(0), 37
    turns = rng.normal(size=(worlds, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    places = rng.uniform(-0.1, 0.1, (2, worlds, 3)) + np.array((0.0, 0.0, 0.1))
    sizes = rng.uniform(0.5, 1.5, worlds)

    def items(chosen):
        return [
            Item(Box((0.03, 0.02, 0.02)), places[0][chosen], turns[chosen], RED, solid=0,
                 size=sizes[chosen]),
            Item(Sphere(0.02), places[1][chosen], turns[chosen], (40, 60, 220), solid=1),
        ]  # fmt: skip

    def draw(chosen, threads):
        renderer = Renderer(48, 32, CAMERA, soft=threads == 1, threads=threads)
        overlays = [renderer.overlay([Goal(places[0, w], 0.03)]) for w in chosen]
        count = len(chosen)
        return renderer.frames(items(chosen), overlays, worlds=count, depth=True, solid=True)

    everyone = np.arange(worlds)
    for threads in (1, 3):
        many = draw(everyone, threads)
        for w in (0, 5, 36):
            alone = draw(everyone[w : w + 1], threads)
            for of_many, of_one in zip(many, alone, strict=True):
                np.testing.assert_array_equal(of_many[w], of_one[0])


def test_only_what_is_asked_for_is_drawn():
    frames = Renderer(16, 16).frames([], rgb=False, depth=True)
    assert frames.rgb is None
    assert frames.solid is None
    assert frames.depth.shape == (1, 16, 16)
