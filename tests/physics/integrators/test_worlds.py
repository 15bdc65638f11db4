"""What a World reads, writes and saves is right with each integrator; what it can't do, it says."""

import dataclasses
import json

import numpy as np
import pytest

from physics import Body, Box, Drag, Drive, Fidelity, Ground, PointSpring, Scene, Sphere, World
from tests.physics.integrators.top import TOP, world_of

SLAB = Box((0.05, 0.03, 0.02))
every_integrator = pytest.mark.parametrize("integrator", ["midpoint", "euler", "rk4", "adaptive"])
SPRING = PointSpring(0, 60.0, damping=3.0, point=(0.2, 0.1, 0.0), to=(0, 0, 0))
MOVING = dataclasses.replace(TOP, position=(0.3, 0.1, 0.0), linear_velocity=(0.0, 0.5, 0.2))


@every_integrator
def test_accelerations_are_the_rates_of_the_velocities(integrator):
    world = world_of(MOVING, integrator, 1e-3, SPRING, tolerance=1e-6)
    world.advance(0.5)
    h, state = 1e-5, []
    for _ in range(2):
        state.append((
            world.position[0, 0].copy(), world.linear_velocity[0, 0].copy(),
            world.angular_velocity[0, 0].copy(), world.linear_acceleration[0, 0],
            world.angular_acceleration[0, 0],
        ))  # fmt: skip
        world.advance(h)
    rates = (np.array(state[1]) - np.array(state[0])) / h
    means = 0.5 * (np.array(state[1]) + np.array(state[0]))
    np.testing.assert_allclose(rates[:3], means[[1, 3, 4]], atol=2e-4)
    assert np.abs(state[0][3]).max() > 1.0
    assert np.abs(state[0][4]).max() > 1.0


@every_integrator
def test_a_snapshot_and_a_state_that_is_set_continue_bit_by_bit(integrator):
    world = world_of(MOVING, integrator, 1e-3, SPRING, tolerance=1e-6)
    world.advance(0.1)
    saved = world.snapshot()
    ends = []
    for _ in range(2):
        world.advance(0.1)
        ends.append(world.orientation.copy())
        world.restore(saved)
    np.testing.assert_array_equal(*ends)
    other = world_of(MOVING, integrator, 1e-3, SPRING, tolerance=1e-6)
    other.advance(0.37)
    for w in (world, other):
        w.set_state(position=(1, 0, 0), orientation=(0, 0, 0, 1), linear_velocity=(0, 1, 0),
                    angular_velocity=(1, 0, 2))  # fmt: skip
        w.advance(0.1)
    np.testing.assert_array_equal(world.position, other.position)
    np.testing.assert_array_equal(world.orientation, other.orientation)


@pytest.mark.parametrize("integrator", ["euler", "rk4", "adaptive"])
def test_a_wrench_gives_its_impulse_exactly(integrator):
    body = Body(SLAB, mass=2.0)
    world = world_of(body, integrator, 1e-2, tolerance=1e-6)
    world.apply_wrench((3.0, 0, 0), (0.0, 0.01, 0.0))
    assert world.linear_acceleration[0, 0, 0] == 1.5
    world.advance(0.5)
    world.advance(0.5)  # the wrench has ended
    np.testing.assert_allclose(world.linear_momentum()[0], (1.5, 0, 0), rtol=1e-13)
    spin = (0.0, 0.005, 0.0)
    turned = world.angular_momentum() - np.cross(world.position[:, 0], world.linear_momentum())
    np.testing.assert_allclose(turned[0], spin, rtol=1e-12, atol=1e-18)
    late = 0.5 * 1e-2 * 0.75 if integrator == "euler" else 0.0  # velocities of a step's end
    assert world.position[0, 0, 0] == pytest.approx(0.1875 + 0.375 + late, rel=1e-12)
    assert not world.force().any()


def test_a_ball_without_rotation_flies_along_a_parabola(stress):
    if not stress:
        pytest.skip("a kernel of its own for ten seconds; see make stress")
    ball = Body(Sphere(0.1), mass=1.0, linear_velocity=(1.0, 0.0, 5.0))
    world = World(Scene([ball]), Fidelity(integrator="adaptive", substep=0.3))
    world.advance(1.0)
    np.testing.assert_allclose(world.position[0, 0], (1.0, 0.0, 5.0 - 0.5 * 9.81), rtol=1e-13)
    assert world.steps[0] < 20


def test_a_spinning_ball_turns_by_its_spin(stress):
    if not stress:
        pytest.skip("a kernel of its own for ten seconds; see make stress")
    ball = Body(Sphere(0.1), mass=1.0, angular_velocity=(0.0, 0.0, 2.0))
    world = World(Scene([ball]), Fidelity(integrator="rk4", substep=0.01))
    world.advance(1.0)
    np.testing.assert_array_equal(world.angular_velocity[0, 0], (0.0, 0.0, 2.0))
    np.testing.assert_allclose(
        world.orientation[0, 0], (0, 0, np.sin(1.0), np.cos(1.0)), atol=1e-10
    )


def test_worlds_with_their_own_masses_are_those_of_scenes_with_these_masses():
    masses = np.linspace(0.5, 3.0, 20)

    def world(mass, count=1):
        body = Body(SLAB, mass=mass, position=(0.3, 0, 0))
        return world_of(body, "adaptive", 0.1, PointSpring(0, 60.0), count)

    many, alone = world(1.0, 20), world(float(masses[7]))
    many.set_parameters(mass=masses[:, None])
    many.advance(1.0)
    alone.advance(1.0)
    expected = 0.3 * np.cos(np.sqrt(60.0 / masses))
    np.testing.assert_allclose(many.position[:, 0, 0], expected, atol=1e-4)
    np.testing.assert_array_equal(alone.position[0], many.position[7])


@pytest.mark.parametrize(
    ("integrator", "step", "message"),
    [("euler", 0.22, "0.2 s"), ("rk4", 0.3, "0.282 s"), ("midpoint", 0.22, "0.2 s")],
)
def test_a_spring_limits_the_step_as_the_integrator_s_stability_says(integrator, step, message):
    """Omega h is below 2, and 2 sqrt(2) with Runge-Kutta's method."""
    body = Body(SLAB, mass=2.0, position=(0.1, 0.0, 0.0))
    with pytest.raises(ValueError, match=rf"the largest safe step is {message[:-3]}"):
        world_of(body, integrator, step, PointSpring(0, 200.0))
    world = world_of(body, integrator, 0.9 * float(message[:-2]), PointSpring(0, 200.0))
    world.advance(1000 * 0.9 * float(message[:-2]))
    assert np.abs(world.position).max() < 1.0
    assert world.largest_stable_step() == pytest.approx(float(message[:-2]), rel=5e-3)


SLIDER = Scene([Body(SLAB, name="slider", position=(0, 0, 1.0))], [Ground(name="floor")])


@pytest.mark.parametrize("integrator", ["rk4", "adaptive"])
def test_contacts_and_drives_with_trial_states_are_refused_with_the_reason(integrator):
    with pytest.raises(
        ValueError,
        match=rf"Fidelity.integrator '{integrator}' evaluates forces at trial states, where those "
        r"of a contact.*slider and floor can touch: give solids a group and a mask.*"
        r'or use integrator="midpoint" or "euler"',
    ):
        World(SLIDER, Fidelity(integrator=integrator), allow_unstable=True)
    drive = Drive(Sphere(0.1), 0.5, 3.0, (0, 2, 0), mask=0)
    with pytest.raises(ValueError, match="those of a drive, whose set point moves once a step"):
        World(Scene([Body(SLAB)], drives=[drive]), Fidelity(integrator=integrator))
    apart = [dataclasses.replace(body, mask=0) for body in SLIDER.bodies]
    World(dataclasses.replace(SLIDER, bodies=apart), Fidelity(integrator=integrator))


def test_a_fidelity_checks_integrator_and_tolerance():
    with pytest.raises(ValueError, match=r"Fidelity\.integrator must be one of .*got 'rk5'"):
        Fidelity(integrator="rk5")
    with pytest.raises(ValueError, match=r"Fidelity\.tolerance 1e-06 requires integrator='adap"):
        Fidelity(integrator="rk4", tolerance=1e-6)
    for value in (0.0, 2.0, np.nan):
        with pytest.raises(ValueError, match=r"Fidelity\.tolerance must be finite and at least"):
            Fidelity(integrator="adaptive", tolerance=value)
    assert Fidelity(integrator="adaptive").tolerance == 1e-6
    assert Fidelity().tolerance is None


def test_a_fidelity_s_text_has_the_integrator_and_older_texts_are_midpoint():
    for fidelity in (Fidelity(integrator="adaptive", tolerance=1 / 3e5), Fidelity()):
        assert Fidelity.from_json(fidelity.to_json()) == fidelity
    document = json.loads(Fidelity(substep=1e-3).to_json())
    del document["value"]["integrator"], document["value"]["tolerance"]
    assert Fidelity.from_json(json.dumps(document)) == Fidelity(substep=1e-3)


def test_steps_are_counted_where_they_differ():
    with pytest.raises(ValueError, match="steps are counted with Fidelity"):
        _ = world_of(TOP, "rk4", 1e-2, Drag()).steps
