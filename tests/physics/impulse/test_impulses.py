"""The impulse law obeys the closed forms of rigid bodies, where it can to round-off."""

import math
from dataclasses import replace

import numpy as np
import pytest

from physics import PRESETS, Body, Box, Capsule, Fidelity, Ground, Material, Scene, Sphere, World
from physics.reference import closed_forms, scenes
from physics.reference.measures import energy_gain, grazing
from physics.reference.scenes import GRAVITY, settled

SOLID = PRESETS["solid"]
# with fewer particles a cube would stand on so small a base that it topples
PARTICLES = Fidelity(law="impulse", geometry="particle", contact_resolution=1.8, spacing=0.25)
PHASES = 100


# --- instantaneous collisions -------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.0, 0.25, 0.5, 0.75, 1.0])
def test_restitution_is_exact_at_every_phase_of_touch(restitution):
    scene = scenes.sphere_on_ground(
        friction=0.5, restitution=restitution, gravity=0.0, linear_velocity=(0, 0, -1.0)
    )
    world = World(scene, "solid", count=PHASES)
    position = np.zeros((PHASES, 1, 3))
    position[:, 0, 2] = 0.02 + SOLID.substep * (2.0 + np.arange(PHASES) / PHASES)
    world.set_state(position=position)
    world.advance(0.5)
    np.testing.assert_allclose(world.linear_velocity[:, 0, 2], restitution, atol=1e-14)


@pytest.mark.parametrize("friction", [0.05, 0.1, 0.2, 0.5, 2.0])
@pytest.mark.parametrize("along", [0.5, 2.0])
def test_an_oblique_impact_slides_or_sticks_as_coulomb_says(friction, along):
    down, restitution, radius = 1.0, 0.5, 0.1
    scene = scenes.sphere_on_ground(
        radius, friction, restitution, gravity=0.0, position=(0, 0, 0.11),
        linear_velocity=(along, 0, -down),
    )  # fmt: skip
    world = World(scene, "solid")
    world.advance(0.5)
    x, z, spin = closed_forms.oblique_impact(along, down, friction, restitution, radius)
    np.testing.assert_allclose(world.linear_velocity[0, 0], (x, 0.0, z), rtol=1e-12)
    np.testing.assert_allclose(world.angular_velocity[0, 0], (0.0, spin, 0.0), rtol=1e-12)


def test_without_restitution_a_cube_stays_where_it_lands():
    scene = scenes.block_on_ground(position=(0, 0, 0.05), linear_velocity=(0, 0, -1.0))
    world = World(replace(scene, gravity=(0, 0, 0)), SOLID)
    world.advance(0.5)
    assert np.abs(world.linear_velocity).max() < 1e-5
    assert world.position[0, 0, 2] == pytest.approx(0.02, abs=1e-5)


@pytest.mark.parametrize("spacing", [1.0, 0.5, 0.25])
@pytest.mark.parametrize("speed", [0.1, 1.0, 5.0])
def test_a_cube_that_lands_flat_leaves_flat(spacing, speed):
    """Four corners at once, in whatever order they are solved."""
    scene = scenes.block_on_ground(
        restitution=0.5, position=(0, 0, 0.05), linear_velocity=(0, 0, -speed)
    )
    world = World(replace(scene, gravity=(0, 0, 0)), replace(SOLID, spacing=spacing))
    world.advance(0.1 / speed)
    assert world.linear_velocity[0, 0, 2] == pytest.approx(0.5 * speed, rel=1e-3)
    assert np.abs(world.angular_velocity).max() < 1e-3 * speed / 0.02


CUBE, BALL = Box((0.02, 0.02, 0.02)), Sphere(0.025)


@pytest.mark.parametrize("shapes", [(CUBE,), (BALL,), (CUBE, CUBE)])
@pytest.mark.parametrize(("restitution", "friction"), [(0.95, 0.1), (0.95, 0.5), (0.5, 2.0)])
def test_no_collision_gains_energy(shapes, restitution, friction):
    """Shapes whose flight keeps it to the last bit: 10,000 in all."""
    world = grazing(shapes, restitution, friction, "solid", 1200)
    momentum, velocity = world.linear_momentum(), world.linear_velocity
    assert energy_gain(world) <= 1e-14
    met = np.abs(world.linear_velocity - velocity).max(axis=(1, 2)) > 1e-9
    assert met.sum() > 0.5 * world.count
    if len(shapes) == 2:
        assert np.abs(world.linear_momentum() - momentum).max() < 1e-15


def test_no_collision_of_thin_rods_gains_energy(stress):
    """They leave it spinning fast about their length."""
    if not stress:
        pytest.skip("a kernel of its own for half a minute; see make stress")
    rod = Box((0.0025, 0.0025, 0.02))
    for friction in (0.01, 0.5, 2.0):
        assert energy_gain(grazing((rod, rod), 0.95, friction, "solid")) <= 1e-4


# --- sliding and resting ------------------------------------------------------------------------


@pytest.mark.parametrize("half_extents", [(0.02, 0.02, 0.02), (0.04, 0.03, 0.02)])
@pytest.mark.parametrize("speed", [2.0, 0.5])
def test_block_stops_after_v_squared_over_two_mu_g(half_extents, speed):
    world = settled(scenes.block_on_ground(half_extents), SOLID)
    start = world.position[0, 0, 0]
    world.set_state(linear_velocity=(speed, 0.0, 0.0))
    world.advance(speed / (0.5 * GRAVITY) + 0.5)
    way = world.position[0, 0, 0] - start
    # the step in which it comes to rest counts whole
    step = 0.5 * speed * SOLID.substep / 2
    assert way == pytest.approx(closed_forms.slide_distance(speed, 0.5, GRAVITY), abs=step)
    assert np.abs(world.linear_velocity).max() < 1e-5


@pytest.mark.parametrize("degrees", [28.0, 40.0])
@pytest.mark.parametrize("fidelity", ["solid", PARTICLES])
def test_a_block_slides_down_an_incline_as_coulomb_says(degrees, fidelity):
    angle = math.radians(degrees)
    world = settled(scenes.block_on_ground(angle=angle), fidelity)
    before = world.linear_velocity[0, 0, 0]
    world.advance(1.0)
    expected = closed_forms.incline_acceleration(angle, 0.5, GRAVITY)
    assert world.linear_velocity[0, 0, 0] - before == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("half_extents", [(0.02, 0.02, 0.02), (0.04, 0.03, 0.02)])
@pytest.mark.parametrize("degrees", [0.0, 10.0, 20.0, 26.0])
def test_a_block_below_the_angle_of_friction_stays(half_extents, degrees):
    world = World(scenes.block_on_ground(half_extents, angle=math.radians(degrees)), SOLID)
    world.advance(10.0)
    start = world.position.copy()
    world.advance(50.0)
    assert np.abs(world.position - start).max() / 50.0 < 1e-9


@pytest.mark.parametrize("spacing", [1.0, 0.5, 0.25])
def test_a_cube_sinks_as_the_spring_would_however_many_samples_it_has(spacing):
    fidelity = replace(SOLID, spacing=spacing)
    world = World(scenes.block_on_ground(), fidelity)
    world.advance(3.0)
    sink = GRAVITY * (fidelity.substep / fidelity.contact_resolution) ** 2
    assert 0.02 - world.position[0, 0, 2] == pytest.approx(sink, rel=1e-6)
    told = world.contacts()
    assert len(told.penetration) == 4
    np.testing.assert_allclose(told.penetration, sink, rtol=1e-4)
    np.testing.assert_allclose(told.force.sum(axis=0), (0, 0, 0.1 * GRAVITY), atol=1e-7)


def test_a_ball_that_slides_ends_up_rolling_at_five_sevenths():
    world = settled(scenes.sphere_on_ground(0.05, 0.3), SOLID)
    world.set_state(linear_velocity=(2.0, 0.0, 0.0))
    world.advance(closed_forms.rolling_time(2.0, 0.3, GRAVITY) + 0.3)
    velocity, spin = world.linear_velocity[0, 0, 0], world.angular_velocity[0, 0, 1]
    assert velocity == pytest.approx(closed_forms.rolling_speed(2.0), rel=1e-3)
    assert spin * 0.05 == pytest.approx(velocity, rel=2e-3)


# --- piles --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("cubes", "step"), [(5, 2e-3), (10, 2e-3), (30, 0.5e-3)])
def test_a_tower_stands_for_a_minute(cubes, step, stress):
    time = 60.0 if cubes < 30 or stress else 10.0
    world = World(scenes.tower(cubes), replace(SOLID, substep=step))
    world.advance(1.0)
    start = world.position.copy()
    assert np.abs(start[0, :, :2]).max() < 1e-3
    world.advance(time)
    assert np.abs(world.position - start).max() < 1e-3


@pytest.mark.parametrize("yaw", [0.0, 20.0, 45.0])
def test_two_faces_meet_in_at_most_four_points(yaw):
    half = math.radians(yaw) / 2
    scene = scenes.two_cubes(
        {"position": (0, 0, 0.02)},
        {"position": (0.003, 0, 0.06), "orientation": (0, 0, math.sin(half), math.cos(half))},
        Material(0.5, 0.0),
        ground=0.0,
        gravity=GRAVITY,
    )
    world = settled(scene, SOLID)
    start = world.position.copy()
    world.advance(10.0)
    assert np.abs(world.position - start).max() < 1e-5
    pair = np.sort(world.contacts().pair, axis=-1).tolist()
    assert pair.count([0, 1]) <= 4
    assert pair.count([0, 2]) <= 4


def test_a_heap_of_all_shapes_comes_to_rest():
    material = Material(0.6, 0.2)
    shapes = [Sphere(0.02), Box((0.02, 0.03, 0.02)), Capsule(0.02, 0.03)]
    bodies = [
        Body(shapes[i % 3], mass=0.1, position=(0.01 * i, 0.0, 0.05 + 0.07 * i), material=material)
        for i in range(9)
    ]
    world = World(Scene(bodies, [Ground(material)]), SOLID)
    world.advance(6.0)
    still = [i for i in range(9) if i % 3 == 1]  # the others may roll on
    assert np.abs(world.linear_velocity[0, still]).max() < 0.05
    assert world.penetration()[0] < 1e-3
    assert np.all(world.position[0, :, 2] > 0.015)
