"""A body that is too light for what presses it is refused."""

from dataclasses import replace

import numpy as np
import pytest

from physics import (
    PRESETS,
    Body,
    Box,
    Drive,
    Gripper,
    Ground,
    Material,
    Scene,
    Sphere,
    World,
)
from physics.analysis.load_limits import LoadLimits
from physics.analysis.parameter_limits import ParameterLimits
from physics.reference import scenes
from physics.scene.parameters import Parameters

FORCE, MASS, FREQUENCY, DEPTH = 20.0, 0.3, 60.0, 0.03  # of scenes.push_like
OMEGA = 0.5 / 2e-3  # 1/s, at balanced


def limits(scene, fidelity="balanced"):
    return LoadLimits(scene, PRESETS[fidelity])


def least(scene, fidelity="balanced", **values):
    p = Parameters.of(scene)
    shaped = {name: np.array([value], dtype=float) for name, value in values.items()}
    return limits(scene, fidelity).least_masses(p._replace(**shaped))[0]


def pressed(mass, fidelity="balanced"):
    """m, the lowest centre of a cube of a mass on which a drive comes down with all its force."""
    scene = scenes.push_like()
    world = World(scene, fidelity, per_world_parameters=True, allow_unstable=True)
    world.set_parameters(mass=mass)
    world.set_state(drive_position=[[[0.0, 0.0, 0.08]]])
    world.command_drives((0.0, 0.0, -1.0))
    lowest = np.inf
    for _ in range(200):
        world.advance(2e-3)
        lowest = min(lowest, float(world.position[0, 0, 2]))
    return lowest


@pytest.mark.parametrize("fidelity", ["fast", "balanced"])
def test_least_mass_is_that_of_the_spring_that_stops_a_drive(fidelity):
    settings = PRESETS[fidelity]
    omega = settings.contact_resolution / settings.substep
    energy = 0.5 * MASS * (FORCE / (MASS * FREQUENCY)) ** 2
    expected = 2.0 * (FORCE * DEPTH + energy) / (DEPTH * omega) ** 2
    np.testing.assert_allclose(least(scenes.push_like(1.0), fidelity), expected, rtol=1e-12)


def test_the_spring_of_the_least_mass_stops_a_load_at_its_depth():
    """m x'' = F - k x from rest at F / k, and from the speed of the energy that the load has."""
    k = 1000.0
    force, energy = 3.0, 0.1
    depth = force / k + np.sqrt((force / k) ** 2 + 2.0 * energy / k)
    np.testing.assert_allclose(2.0 * (force * depth + energy) / depth**2, k)


@pytest.mark.parametrize("fidelity", ["fast", "balanced"])
def test_a_drive_presses_the_centre_of_a_cube_to_the_ground_at_about_the_least_mass(fidelity):
    (lightest,) = least(scenes.push_like(1.0), fidelity)
    assert pressed(3.0 * lightest, fidelity) > 0.002
    assert pressed(0.3 * lightest, fidelity) < 0.0


def test_a_heavier_body_on_top_counts():
    scene = scenes.two_cubes(ground=0.0, gravity=9.81)
    masses = least(scene, mass=[0.1, 200.0])
    np.testing.assert_allclose(masses[0], 2.0 * 200.0 * 9.81 / (DEPTH * OMEGA**2), rtol=1e-12)
    assert masses[1] < 0.2
    world = World(scene, count=2, per_world_parameters=True)
    with pytest.raises(ValueError, match=r"mass 0\.1 kg of body 0 in world 1 is too small.*body 1"):
        world.set_parameters(mass=[[0.1, 0.1], [0.1, 200.0]])
    with pytest.raises(ValueError, match=r"mass 0\.1 kg of body 0 is too small.*body 1 could"):
        world.check_parameters({"mass": ([0.1, 0.1], [0.1, 200.0])})
    np.testing.assert_array_equal(world.parameters.mass, 0.1)


def test_loads_add_up():
    """All bodies may lie on one, and a drive press on the topmost."""
    cubes = [Body(Box((0.02,) * 3), mass=0.1, position=(0, 0, 0.02 + 0.04 * i)) for i in range(5)]
    drive = Drive(Sphere(0.015), MASS, FORCE, (0.0, 0.0, 0.3))
    alone, loaded = Scene(cubes, [Ground()]), Scene(cubes, [Ground()], [drive])
    masses = [1.0, 5.0, 5.0, 5.0, 5.0]
    weight = 2.0 * 20.0 * 9.81 / DEPTH / OMEGA**2
    np.testing.assert_allclose(least(alone, mass=masses)[0], weight, rtol=1e-12)
    one = least(scenes.push_like(1.0))[0]
    np.testing.assert_allclose(least(loaded, mass=masses)[0], weight + one, rtol=1e-12)


def test_what_a_range_accepts_is_accepted_anywhere_in_it(stress):
    """Also where the scene's own body is lighter than it should be."""
    light = Body(Box((0.02,) * 3), mass=0.002, position=(0.0, 0.0, 0.02))
    heavy = Body(Box((0.02,) * 3), mass=0.1, position=(0.1, 0.0, 0.02))
    drive = Drive(Sphere(0.015), MASS, FORCE, (0.0, 0.0, 0.1))
    bounds = ParameterLimits(Scene([light, heavy], [Ground()], [drive]), PRESETS["balanced"])
    own = Parameters.of(Scene([light, heavy]))
    draw, accepted, ranges = np.random.default_rng(0), 0, 2000 if stress else 400
    for _ in range(ranges):
        ends = np.sort(10.0 ** draw.uniform(-0.8, 1.0, (2, 1, 2)), axis=0) * own.mass
        sizes = np.sort(draw.uniform(0.8, 1.6, (2, 1, 1)), axis=0) * np.ones((1, 2))
        low, high = (own._replace(mass=m, size=z) for m, z in zip(ends, sizes, strict=True))
        try:
            bounds.check_range(low, high)
        except ValueError:
            continue
        accepted += 1
        share = draw.random((2, 50, 2))
        inside = Parameters.of(Scene([light, heavy]), 50)._replace(
            mass=low.mass + share[0] * (high.mass - low.mass),
            size=low.size + share[1] * (high.size - low.size),
        )
        bounds.loads.check(inside)
    assert ranges / 40 < accepted < ranges / 2


def test_message_says_what_would_be_right():
    world = World(scenes.push_like(), per_world_parameters=True)
    with pytest.raises(ValueError, match=r"mass 0\.001 kg of body 0 in world 0 ") as error:
        world.set_parameters(mass=1e-3)
    message = str(error.value)
    assert (
        "is too small for Fidelity.substep 0.002 s: drive 0 could press it into what it lies on "
        "by 0.75 of its width of 0.04 m; use at least 0.0" in message
    )
    world.set_parameters(mass=float(message.split("at least ")[1].split(" kg")[0]))


def test_masses_of_the_scene_are_accepted_and_as_light_ones_at_other_sizes():
    scene = scenes.push_like(1e-3)
    needed = least(scenes.push_like(1.0), size=[0.6]) / least(scenes.push_like(1.0))
    assert 1.0 / 0.6 < needed < 1.0 / 0.6**2
    np.testing.assert_allclose(least(scene, size=[0.6]), 1e-3 * needed, rtol=1e-12)
    world = World(scene, count=2, per_world_parameters=True)
    world.set_parameters(mass=[[1e-3], [3e-3]], size=[[1.0], [0.6]])
    with pytest.raises(ValueError, match=r"0\.0009 kg.*at least 0\.001 kg"):
        world.set_parameters(mass=9e-4)
    with pytest.raises(ValueError, match=r"mass 0\.001 kg of body 0 in world 1 is too small"):
        world.set_parameters(mass=1e-3, size=[[1.0], [0.6]])


def test_a_body_with_the_mass_of_its_scene_is_refused_where_its_size_makes_it_too_light():
    """A ball of Throw with 0.58 times its size went through the ground at `fast`."""
    scene = scenes.push_like(1.05 * least(scenes.push_like(1.0))[0])
    world = World(scene, per_world_parameters=True)
    world.set_parameters(size=0.98)
    with pytest.raises(ValueError, match=r"body 0 in world 0 is too small.*0\.0232 m"):
        world.set_parameters(size=0.58)


def test_what_can_not_press_does_not_count():
    cube = Body(Box((0.02,) * 3), mass=0.1, position=(0.0, 0.0, 0.02))
    drive = Drive(Sphere(0.015), MASS, FORCE, (0.0, 0.0, 0.1))
    for scene in (
        Scene([cube], [], [drive]),  # nothing to be pressed into
        Scene([cube], [Ground()], [replace(drive, group=2, mask=2)]),
        Scene([replace(cube, material=Material(stiffness=1e4))], [Ground()], [drive]),
    ):
        assert least(scene) == 0.0


def test_the_fingers_of_a_gripper_press_together():
    cube = Body(Box((0.02,) * 3), mass=1.0, position=(0.0, 0.0, 0.02))
    gripper = Gripper(Sphere(0.015), 0.5 * MASS, FORCE, 4.0, (0.0, 0.0, 0.1))
    np.testing.assert_allclose(
        least(Scene([cube], [Ground()], [gripper])), least(scenes.push_like(1.0)), rtol=1e-12
    )
