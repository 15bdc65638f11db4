"""Semi-implicit Euler with contacts: first-order errors of a slide, and boxes that rest."""

from dataclasses import replace

import numpy as np
import pytest

from physics import Drive, Fidelity, Sphere, World
from physics.reference import closed_forms, scenes

GRAVITY = scenes.GRAVITY
SOLID = {"law": "impulse", "contact_resolution": 1.8, "integrator": "euler"}


def block(**changes):
    """A block on the ground, and a drive that touches nothing."""
    drive = Drive(Sphere(0.02), 0.05, 5.0, (-0.5, 0.0, 0.5), mask=0)
    return replace(scenes.block_on_ground(**changes), drives=(drive,))


def slide_error(step, speed=1.0, friction=0.5, angle=0.1):
    """What is missing in m of the closed form's distance down a slope that stops the block."""
    scene = block(friction=friction, angle=angle, linear_velocity=(speed, 0.0, 0.0))
    world = World(scene, Fidelity(integrator="euler", substep=step))
    drag = friction * np.cos(angle) - np.sin(angle)
    world.advance(2.0 * speed / (drag * GRAVITY))
    assert abs(float(world.linear_velocity[0, 0, 0])) < 1e-4
    return closed_forms.slide_distance(speed, drag, GRAVITY) - float(world.position[0, 0, 0])


def test_a_box_slides_too_short_by_half_a_step():
    """Each step moves by the speed at its end, so v^2 / (2 mu g) lacks h v / 2."""
    errors = [slide_error(step) for step in (2e-3, 1e-3, 0.5e-3)]
    np.testing.assert_allclose(errors, [1e-3, 0.5e-3, 0.25e-3], rtol=0.1)


def test_a_box_rests_on_a_slope():
    fidelity, angle = Fidelity(integrator="euler"), 0.3
    world = World(block(friction=0.5, angle=angle), fidelity, count=2)
    world.advance(1.0)
    start = world.position.copy()
    world.advance(5.0)
    np.testing.assert_allclose(world.position, start, atol=1e-6)
    weight = 0.1 * GRAVITY * np.cos(angle)
    assert world.normal_force("body 0", "static 0")[0] == pytest.approx(weight, rel=1e-5)
    np.testing.assert_allclose(world.linear_acceleration, 0.0, atol=1e-4)


def test_a_box_that_tumbles_onto_the_ground_comes_to_rest():
    scene = block(
        angle=1e-3,
        position=(0, 0, 0.1),
        angular_velocity=(3.0, 5.0, 1.0),
        linear_velocity=(0.3, 0, 0),
    )
    world = World(scene, Fidelity(integrator="euler", contact_resolution=0.3))
    world.advance(3.0)
    assert world.position[0, 0, 2] == pytest.approx(0.02, abs=1e-3)
    assert world.kinetic_energy()[0] < 1e-8


def test_a_drive_follows_its_set_point():
    world = World(block(angle=1e-3), Fidelity(integrator="euler"))
    target = world.drive_position[0, 0] + np.array([0.1, 0.0, 0.02])
    world.move_drives(target, 0.2)
    world.advance(1.0)
    np.testing.assert_allclose(world.drive_position[0, 0], target, atol=1e-4)
    world.command_drives((0.3, 0.0, 0.0))
    world.advance(1.0)
    np.testing.assert_allclose(world.drive_velocity[0, 0], (0.3, 0.0, 0.0), atol=1e-6)


def test_impulses_are_those_of_the_whole_step(stress):
    """A sequential-impulse solver asks for the velocity after a whole kick, as Euler's step is."""
    if not stress:
        pytest.skip("a kernel of its own for half a minute; see make stress")
    fidelity = Fidelity(**SOLID)
    scene = block(restitution=0.75, linear_velocity=(0, 0, -1.0))
    world = World(replace(scene, gravity=(0.0, 0.0, 0.0)), fidelity, count=20)
    position = np.zeros((20, 1, 3))
    position[:, 0, 2] = 0.02 + fidelity.substep * (2.0 + np.arange(20) / 20)
    world.set_state(position=position)
    world.advance(0.5)
    np.testing.assert_allclose(world.linear_velocity[:, 0, 2], 0.75, rtol=1e-3)
    errors = []
    for step in (2e-3, 1e-3):
        scene = block(friction=0.4, linear_velocity=(1.0, 0, 0))
        world = World(scene, Fidelity(substep=step, **SOLID))
        world.advance(1.0)
        expected = closed_forms.slide_distance(1.0, 0.4, GRAVITY)
        errors.append(expected - float(world.position[0, 0, 0]))
        assert world.position[0, 0, 2] == pytest.approx(0.02, abs=2e-5)
        assert world.kinetic_energy()[0] < 1e-10
    np.testing.assert_allclose(errors, [1e-3, 0.5e-3], rtol=0.1)
