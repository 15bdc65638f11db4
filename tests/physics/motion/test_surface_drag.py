"""Drag integrated over the surface that faces the flow agrees with closed forms."""

import math

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Fidelity,
    Mesh,
    Particles,
    Scene,
    Sphere,
    SurfaceDrag,
    Torus,
    World,
)
from physics.reference import meshes
from physics.scene.surface_points import surface_points

RHO, C, G = 1.2, 1.5, 9.81
SHAPES = {
    "sphere": (Sphere(0.1), 0.04 * math.pi),
    "box": (Box((0.1, 0.07, 0.03)), 8 * (0.007 + 0.0021 + 0.003)),
    "capsule": (Capsule(0.05, 0.1), 4 * math.pi * 0.05 * 0.15),
    "cylinder": (Cylinder(0.05, 0.08), 2 * math.pi * 0.05 * 0.21),
    "torus": (Torus(0.1, 0.03), 4 * math.pi**2 * 0.003),
}


def one(shape, gravity=(0.0, 0.0, 0.0), substep=2e-3, drag=None, **state):
    """A world in which nothing can touch and a box is far away, so that all share a kernel."""
    drag = drag or SurfaceDrag(RHO, C, body=0)
    far = Body(Box((0.1, 0.2, 0.3)), position=(0, 0, 99.0), mask=0)
    bodies = [Body(shape, mass=0.05, mask=0, **state), far]
    return World(Scene(bodies, gravity=gravity, fields=[drag]), Fidelity(substep=substep))


def pressure(points, velocity, spin):
    """Sum of A s^2 n, and of its moment, over the points that face the flow."""
    u = velocity + np.cross(spin, points.positions)
    s = np.maximum(0.0, np.sum(u * points.normals, axis=1))
    forces = (points.areas * s**2)[:, None] * points.normals
    return np.concatenate([forces.sum(axis=0), np.cross(points.positions, forces).sum(axis=0)])


@pytest.mark.parametrize("name", SHAPES)
def test_points_have_the_area_and_enclose_the_volume_of_the_shape(name):
    shape, area = SHAPES[name]
    points = surface_points(shape, 200)
    assert points.areas.sum() == pytest.approx(area, rel=1e-12)
    np.testing.assert_allclose(np.linalg.norm(points.normals, axis=1), 1.0)
    flux = points.areas @ np.sum(points.positions * points.normals, axis=1)  # Gauss: 3 V
    assert flux / 3.0 == pytest.approx(shape.volume, rel=1e-12)
    np.testing.assert_allclose(points.areas @ points.normals, 0.0, atol=1e-12 * area)


@pytest.mark.parametrize("name", SHAPES)
def test_the_force_converges_with_the_number_of_points(name):
    shape = SHAPES[name][0]
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(30, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    finest, errors = surface_points(shape, 20000), []
    for count in (200, 3200):
        points, worst = surface_points(shape, count), 0.0
        for way in ways:
            exact = pressure(finest, way, 0.0 * way)[:3]
            error = pressure(points, way, 0.0 * way)[:3] - exact
            worst = max(worst, float(np.linalg.norm(error) / np.linalg.norm(exact)))
        errors.append(worst)
    assert errors[0] < 2e-3
    assert errors[1] < max(1e-12, errors[0] / 8.0)


def test_the_points_of_a_compound_and_of_particles_are_those_outside():
    half = Box((0.05, 0.1, 0.1))
    whole = surface_points(Compound([(half, (-0.05, 0, 0)), (half, (0.05, 0, 0))]), 400)
    assert whole.areas.sum() == pytest.approx(24 * 0.01, rel=1e-12)
    r, d = 0.1, 0.12
    pair = surface_points(Particles([(-d / 2, 0, 0), (d / 2, 0, 0)], r), 20000)
    assert pair.areas.sum() == pytest.approx(2 * 2 * math.pi * r * (r + d / 2), rel=5e-3)


def test_the_points_of_a_mesh_are_spread_over_its_triangles():
    box = Box((0.1, 0.07, 0.03))
    vertices, faces = meshes.cuboid(box.half_extents)
    points = surface_points(Mesh(vertices=vertices, faces=faces), 400)
    assert len(points.areas) > 400
    assert points.areas.max() <= 8 * (0.007 + 0.0021 + 0.003) / 400 * (1 + 1e-6)
    assert points.areas.sum() == pytest.approx(8 * (0.007 + 0.0021 + 0.003), rel=1e-12)
    flux = points.areas @ np.sum(points.positions * points.normals, axis=1)
    assert flux / 3.0 == pytest.approx(box.volume, rel=1e-12)
    way = np.array((0.3, -0.5, 0.7))
    exact = pressure(surface_points(box, 50), way, 0.0 * way)[:3]
    found = pressure(points, way, 0.0 * way)[:3]
    np.testing.assert_allclose(np.sort(np.abs(found)), np.sort(np.abs(exact)), rtol=1e-12)


def test_runge_kutta_has_its_order(stress):
    """As long as no point turns towards the flow or away from it: a box that falls flat."""
    if not stress:
        pytest.skip("compiles a kernel of its own")
    errors, fastest = [], math.sqrt(2.0 * 0.05 * G / (RHO * C * 4 * 0.1 * 0.07))
    for h in (0.1, 0.05, 0.025):
        far = Body(Box((0.1, 0.2, 0.3)), position=(0, 0, 99.0), mask=0)
        body = Body(SHAPES["box"][0], mass=0.05, mask=0)
        scene = Scene([body, far], gravity=(0, 0, -G), fields=[SurfaceDrag(RHO, C, body=0)])
        world = World(scene, Fidelity(substep=h, integrator="rk4"))
        world.advance(0.8)
        expected = fastest * math.tanh(G * 0.8 / fastest)
        errors.append(abs(-float(world.linear_velocity[0, 0, 2]) - expected))
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 4.0, atol=0.3)


def test_a_shape_without_points_is_refused():
    with pytest.raises(TypeError, match="SurfaceDrag acts on bodies with one of the shapes Sphere"):
        surface_points(3.0, 10)


@pytest.mark.parametrize(("name", "area"), [("box", 4 * 0.1 * 0.07), ("sphere", 0.005 * math.pi)])
def test_the_terminal_velocity_is_exact(name, area):
    """A ball has half the drag of a disc: the integral of cos^3 is pi r^2/2."""
    world = one(SHAPES[name][0], gravity=(0, 0, -G))
    expected = math.sqrt(2.0 * 0.05 * G / (RHO * C * area))
    world.advance(20.0)
    assert -world.linear_velocity[0, 0, 2] == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(world.angular_velocity[0, 0], 0.0, atol=1e-9)


def test_the_fall_follows_the_hyperbolic_tangent_to_second_order():
    errors, fastest = [], math.sqrt(2.0 * 0.05 * G / (RHO * C * 4 * 0.1 * 0.07))
    for h in (0.04, 0.02, 0.01):
        world = one(SHAPES["box"][0], gravity=(0, 0, -G), substep=h)
        world.advance(0.8)
        expected = fastest * math.tanh(G * 0.8 / fastest)
        errors.append(abs(-float(world.linear_velocity[0, 0, 2]) - expected))
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.2)


def test_a_body_at_rest_in_the_wind_is_carried_along_and_one_that_drifts_with_it_is_not_touched():
    wind = SurfaceDrag(RHO, C, flow=(3.0, 0, 0), body=0)
    drifting = one(Sphere(0.1), drag=wind, linear_velocity=(3.0, 0, 0))
    drifting.advance(1.0)
    np.testing.assert_allclose(drifting.linear_velocity[0, 0], (3.0, 0, 0), rtol=1e-12)
    resting = one(Sphere(0.1), drag=wind)
    resting.advance(1.0)  # v' = k (3 - v)^2 from rest: 3 - v = 3 / (1 + 3 k t)
    k = RHO * C * math.pi * 0.01 / 4.0 / 0.05
    expected = 3.0 - 3.0 / (1.0 + 3.0 * k)
    assert resting.linear_velocity[0, 0, 0] == pytest.approx(expected, rel=1e-4)


def test_a_plate_that_spins_across_itself_slows_down_by_the_closed_form():
    """The torque is -rho c/2 omega^2 times the integral of |x|^3 over half of each face."""
    a, thin = 0.1, 1e-4
    plate = Box((a, a, thin))
    world = one(plate, angular_velocity=(0.0, 20.0, 0.0), drag=SurfaceDrag(RHO, C, points=2000))
    inertia = plate.inertia(0.05)[1]
    k = 0.5 * RHO * C * (2.0 * 2.0 * a * a**4 / 4.0) / inertia
    world.advance(1.0)
    assert world.angular_velocity[0, 0, 1] == pytest.approx(20.0 / (1.0 + 20.0 * k), rel=2e-3)
    np.testing.assert_allclose(world.linear_velocity[0, 0], 0.0, atol=1e-6)


def test_without_friction_a_plate_feels_no_flow_along_it_and_with_it_only_its_front():
    edge = 0.5 * RHO * 4 * 0.1 * 0.03  # of the front face, over c v^2
    state = {"linear_velocity": (0.0, 2.0, 0.0), "orientation": (0, 0, 0, 1)}
    for friction in (0.0, 1.0):
        world = one(SHAPES["box"][0], drag=SurfaceDrag(RHO, C, friction, body=0), **state)
        assert world.force()[0, 0, 1] == pytest.approx(-edge * C * 4.0, rel=1e-12)
    # at 45 degrees of a face's normal: s = u_t = v / sqrt 2, two faces with pressure and friction
    turned = {**state, "orientation": (math.sin(math.pi / 8), 0, 0, math.cos(math.pi / 8))}
    cube = one(Box((0.1, 0.1, 0.1)), drag=SurfaceDrag(RHO, C, 1.0, body=0), **turned)
    expected = 0.5 * RHO * 0.04 * 4.0 * 2.0 * 0.5 * math.sqrt(0.5) * (C + 1.0)
    assert cube.force()[0, 0, 1] == pytest.approx(-expected, rel=1e-12)


def test_energy_only_falls_whatever_the_body_does():
    drag = SurfaceDrag(1000.0, 1.0, 0.5)
    compound = Compound(
        [(Box((0.1, 0.02, 0.02)), (0, 0, 0)), (Box((0.02, 0.06, 0.02)), (0, 0.08, 0))]
    )
    for shape in (compound, SHAPES["torus"][0], SHAPES["cylinder"][0]):
        world = one(shape, drag=drag, linear_velocity=(0.4, -0.3, 0.2), angular_velocity=(3, 1, -2))
        before = world.kinetic_energy()[0]
        for _ in range(20):
            world.advance(0.05)
            now = world.kinetic_energy()[0]
            assert now < before
            before = now


def test_a_larger_body_in_one_of_many_worlds_has_its_own_area(stress):
    if not stress:
        pytest.skip("compiles a kernel of its own")
    scene = one(SHAPES["box"][0], linear_velocity=(0.5, -0.2, 0.1), angular_velocity=(1, 2, 3))
    worlds = World(scene.scene, count=2, per_world_parameters=True)
    worlds.set_parameters(size=[[1.0, 1.0], [1.5, 1.0]])
    body = Body(SHAPES["box"][0].scaled(1.5), mass=0.05, linear_velocity=(0.5, -0.2, 0.1),
                angular_velocity=(1, 2, 3), mask=0)  # fmt: skip
    alone = World(Scene([body, scene.scene.bodies[1]], gravity=(0, 0, 0),
                        fields=scene.scene.fields))  # fmt: skip
    np.testing.assert_allclose(worlds.force()[1, 0], alone.force()[0, 0], rtol=1e-12)
    np.testing.assert_allclose(worlds.torque()[1, 0], alone.torque()[0, 0], rtol=1e-12)
    np.testing.assert_allclose(worlds.force()[0, 0], scene.force()[0, 0], rtol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"density": -1.0, "coefficient": 1.0},
            r"SurfaceDrag\.density must be .*at least 0, got -1",
        ),
        ({"density": 1.0, "coefficient": math.nan}, r"SurfaceDrag\.coefficient must be finite"),
        (
            {"density": 1.0, "coefficient": 1.0, "flow": (1, 2)},
            r"SurfaceDrag\.flow must be 3 numbers",
        ),
        (
            {"density": 1.0, "coefficient": 1.0, "points": 0},
            r"SurfaceDrag\.points must be at least 1",
        ),
    ],
)
def test_bad_input_names_the_field(arguments, message):
    with pytest.raises(ValueError, match=message):
        SurfaceDrag(**arguments)


def test_a_scene_with_surface_drag_comes_back_from_json():
    scene = one(SHAPES["box"][0], drag=SurfaceDrag(RHO, C, 0.1, (1, 0, 0), "body 1", 50)).scene
    assert Scene.from_json(scene.to_json()) == scene
