"""Bodies on slopes: set down, at rest, and launched up or across. Downhill is +x."""

import math
from dataclasses import replace

import numpy as np
import pytest

from physics import PRESETS, Body, Box, Ground, Material, Scene, Static, World
from physics.reference import closed_forms
from physics.reference.scenes import BALL, CUBE, GRAVITY, tilted_gravity

SPRINGS = ["fast", "balanced", "accurate"]
FRICTION = 0.5  # a friction angle of 26.6 degrees
HALF = 0.02  # m, half width of the cube and radius of the ball


def slope(kind, shape, degrees, friction=FRICTION, **body):
    """A body that just touches a tilted ground or static."""
    material, angle = Material(friction), math.radians(degrees)
    if kind == "ground":
        cube = Body(shape, 0.1, material=material, position=(0, 0, HALF), **body)
        return Scene([cube], [Ground(material)], gravity=tilted_gravity(angle))
    normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
    turned = (0.0, math.sin(angle / 2.0), 0.0, math.cos(angle / 2.0))
    wedge = Static(Box((5, 1, 0.2)), -0.2 * normal, turned, material)
    cube = Body(shape, 0.1, material=material, position=HALF * normal, orientation=turned, **body)
    return Scene([cube], [wedge])


@pytest.mark.parametrize("kind", ["ground", "static"])
@pytest.mark.parametrize("degrees", [28.0, 30.0, 45.0])
@pytest.mark.parametrize("start", ["touching", "sunk"])
@pytest.mark.parametrize("preset", SPRINGS)
def test_a_cube_set_down_on_a_steep_slope_slides_from_the_first_moment(
    preset, start, degrees, kind
):
    fidelity, angle = PRESETS[preset], math.radians(degrees)
    world = World(slope(kind, CUBE, degrees), fidelity)
    if start == "sunk":
        sink = GRAVITY * math.cos(angle) * (fidelity.substep / fidelity.contact_resolution) ** 2
        normal = (0, 0, 1) if kind == "ground" else (math.sin(angle), 0, math.cos(angle))
        world.set_state(position=world.position - sink * np.array(normal))
    world.advance(1.0)
    speed = np.linalg.norm(world.linear_velocity[0, 0])
    expected = closed_forms.incline_acceleration(angle, FRICTION, GRAVITY)
    assert speed == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("friction", [0.1, FRICTION])
@pytest.mark.parametrize("degrees", [20.0, 40.0])
@pytest.mark.parametrize("kind", ["ground", "static"])
def test_a_ball_set_down_on_a_slope_rolls_or_slides_from_the_first_moment(kind, degrees, friction):
    world = World(slope(kind, BALL, degrees, friction))
    world.advance(1.0)
    expected = closed_forms.incline_rolling_acceleration(math.radians(degrees), friction, GRAVITY)
    assert np.linalg.norm(world.linear_velocity[0, 0]) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("kind", ["ground", "static"])
@pytest.mark.parametrize("preset", SPRINGS)
def test_a_cube_below_the_friction_angle_comes_to_rest_where_it_is_set_down(preset, kind):
    world = World(slope(kind, CUBE, 20.0), preset)
    start = world.position[0, 0].copy()
    world.advance(2.0)
    assert np.abs(world.linear_velocity).max() < 1e-12
    sink = 9.81 * (world.fidelity.substep / world.fidelity.contact_resolution) ** 2
    assert np.linalg.norm(world.position[0, 0] - start) < 6.0 * sink


@pytest.mark.parametrize("preset", SPRINGS)
def test_a_cube_that_slides_up_a_steep_slope_turns_around(preset):
    """Friction acts against the velocity. Where this turns, the spring has to be charged again."""
    world = World(slope("ground", CUBE, 30.0, linear_velocity=(-1.0, 0.0, 0.0)), preset)
    steepness, cone = GRAVITY * math.sin(math.pi / 6), FRICTION * GRAVITY * math.cos(math.pi / 6)
    up, down = 1.0 / (steepness + cone), 0.5
    world.advance(up)
    top = world.position[0, 0, 0]
    assert -top == pytest.approx(0.5 * up, rel=1e-2)
    world.advance(down)
    expected = (steepness - cone) * down
    assert world.linear_velocity[0, 0, 0] == pytest.approx(expected, rel=2e-2)


@pytest.mark.parametrize(
    ("preset", "error"), [("fast", 0.03), ("balanced", 0.02), ("accurate", 1e-3)]
)
def test_friction_turns_with_the_velocity_of_a_cube_that_slides_across_a_slope(preset, error):
    world = World(slope("ground", CUBE, 30.0, linear_velocity=(0.0, 1.0, 0.0)), preset)
    world.advance(0.5)
    u, h = np.array([0.0, 1.0]), 1e-4
    pull = np.array([GRAVITY * math.sin(math.pi / 6), 0.0])
    cone = FRICTION * GRAVITY * math.cos(math.pi / 6)

    def acceleration(u):
        return pull - cone * u / np.linalg.norm(u)

    for _ in range(5000):
        u = u + h * acceleration(u + 0.5 * h * acceleration(u))
    np.testing.assert_allclose(world.linear_velocity[0, 0, :2], u, atol=error)


@pytest.mark.parametrize("preset", SPRINGS)
@pytest.mark.parametrize("speed", [0.05, 0.1, 0.2])
def test_a_cube_that_lands_on_a_steep_slope_is_not_driven_uphill(speed, preset):
    scene = slope("ground", CUBE, 30.0, linear_velocity=(0.0, 0.0, -speed))
    world = World(scene, preset)
    for _ in range(30):
        world.advance(0.01)
        assert world.linear_velocity[0, 0, 0] > -1e-3


@pytest.mark.parametrize(
    "fidelity", [*map(PRESETS.get, SPRINGS), replace(PRESETS["balanced"], damping="dashpot")]
)
@pytest.mark.parametrize("speed", [0.1, 0.3, 1.0])
def test_a_cube_that_is_launched_up_a_slope_climbs_less_than_without_friction(speed, fidelity):
    world = World(slope("ground", CUBE, 30.0, linear_velocity=(-speed, 0.0, 0.0)), fidelity)
    highest = 0.0
    for _ in range(100):
        world.advance(0.005)
        highest = max(highest, -float(world.position[0, 0, 0]))
    assert highest < speed**2 / (2.0 * GRAVITY * math.sin(math.pi / 6))
