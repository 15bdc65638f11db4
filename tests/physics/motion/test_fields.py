"""Springs to points, attractors and drag agree with closed forms; energies, limits count them."""

import math

import numpy as np
import pytest

from physics import (
    Attractor,
    Body,
    Box,
    Drag,
    Fidelity,
    Ground,
    PointSpring,
    Scene,
    SimulationDiverged,
    Sphere,
    World,
)

SLAB = Box((0.05, 0.03, 0.02))
MASS = 2.0


def one(field, gravity=(0.0, 0.0, 0.0), substep=1e-3, **state):
    """A world with one body and one field; a box, so that all these scenes share a kernel."""
    body = Body(SLAB, mass=MASS, **state)
    return World(Scene([body], gravity=gravity, fields=[field]), Fidelity(substep=substep))


def energy(world):
    return float(world.kinetic_energy()[0] + world.potential_energy()[0])


def oscillation(substep, damping):
    """Error in m of a damped oscillator of 5 rad/s after about ten periods."""
    world = one(PointSpring(0, MASS * 25.0, damping), substep=substep, position=(0.3, 0, 0))
    time = 4.13 * math.pi  # not at a turning point, where errors of the phase hide
    world.advance(time)
    decay = damping / (2.0 * MASS)
    fast = math.sqrt(25.0 - decay**2)
    swing = math.cos(fast * time) + decay / fast * math.sin(fast * time)
    return abs(float(world.position[0, 0, 0]) - 0.3 * math.exp(-decay * time) * swing)


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_an_oscillator_has_its_period_and_decay_to_second_order(damping):
    errors = [oscillation(h, damping) for h in (4e-3, 2e-3, 1e-3)]
    assert errors[2] < 1e-4
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


def test_a_spring_between_bodies_keeps_momentum_energy_and_centre():
    spring = PointSpring(0, 40.0, rest_length=0.1, point=(0.05, 0.03, 0.0), to="b",
                         to_point=(-0.05, 0.0, 0.02))  # fmt: skip
    bodies = [
        Body(SLAB, mass=1.0, angular_velocity=(1.0, 2.0, 3.0)),
        Body(SLAB, mass=3.0, position=(0.4, 0.1, 0.0), linear_velocity=(0, 0.3, 0), name="b"),
    ]
    scene = Scene(bodies, gravity=(0, 0, 0), fields=[spring])
    world = World(scene, Fidelity(substep=2.5e-4, skin=0.01))
    linear, angular, before = world.linear_momentum(), world.angular_momentum(), energy(world)
    assert before > world.kinetic_energy()[0] + 0.5
    world.advance(0.3)
    np.testing.assert_allclose(world.linear_momentum(), linear, atol=1e-13)
    np.testing.assert_allclose(world.angular_momentum(), angular, atol=1e-12)
    assert energy(world) == pytest.approx(before, rel=2e-5)


def orbit(steps):
    """A body on Kepler's ellipse of eccentricity 0.6 and period 2 pi s, from its periapsis."""
    e = 0.6
    speed = math.sqrt((1.0 + e) / (1.0 - e))
    return one(Attractor((0, 0, 0), 1.0), substep=2.0 * math.pi / steps,
               position=(1.0 - e, 0, 0), linear_velocity=(0, speed, 0))  # fmt: skip


def test_keplers_ellipse_closes_to_second_order():
    errors = []
    for steps in (2000, 4000, 8000):
        world = orbit(steps)
        start = world.position.copy()
        world.advance(2.0 * math.pi)
        errors.append(float(np.abs(world.position - start).max()))
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.1)


def test_a_hundred_orbits_of_kepler_drift_by_nothing():
    """The bar: energy error 2e-5, means of orbits drift by 1e-9, angular momentum 1e-12."""
    world = orbit(4000)
    before, angular = energy(world), world.angular_momentum()
    assert before == pytest.approx(-0.5 * MASS, rel=1e-12)
    means, worst = [], 0.0
    for _ in range(100):
        errors = []
        for _ in range(40):
            world.advance(2.0 * math.pi / 40)
            errors.append(energy(world) / before - 1.0)
        means.append(np.mean(errors))
        worst = max(worst, np.abs(errors).max())
    assert worst < 2e-5
    assert abs(means[-1] - means[0]) < 1e-9
    np.testing.assert_allclose(world.angular_momentum(), angular, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("exponent", [-1.0, 0.0, 1.0, 3.0])
def test_an_attractor_of_any_exponent_keeps_the_energy(exponent):
    world = one(Attractor((0.1, 0, 0), 1.5, exponent), position=(0, 1, 0),
                linear_velocity=(0.5, 0, 0.2))  # fmt: skip
    before = energy(world)
    world.advance(0.7)
    assert abs(world.kinetic_energy()[0] - 0.5 * MASS * 0.29) > 0.1
    assert energy(world) == pytest.approx(before, abs=2e-5)


def test_a_repulser_pushes_away():
    world = one(Attractor((0, 0, 0), -1.0), position=(1, 0, 0))
    assert world.linear_acceleration[0, 0, 0] == pytest.approx(1.0)


def test_tides_turn_a_body_as_the_gravity_gradient_does():
    """The torque is 3 G M / r^3 n x J n, to second order in size over distance."""
    distance, strength = 3.0, 2.0
    q = np.array([0.3, -0.2, 0.5, 0.7])
    world = one(Attractor((distance, 0, 0), strength, per_particle=True),
                orientation=tuple(q / np.linalg.norm(q)))  # fmt: skip
    n = np.array([1.0, 0.0, 0.0])
    expected = 3.0 * strength / distance**3 * np.cross(n, world.inertia()[0, 0] @ n)
    np.testing.assert_allclose(world.torque()[0, 0], expected, rtol=2e-3, atol=1e-8)
    before = energy(world)
    world.set_state(angular_velocity=(0.0, 0.0, 0.0))
    world.advance(1.5)
    assert world.kinetic_energy()[0] > 1e-3
    assert energy(world) == pytest.approx(before, abs=1e-6)


def test_drag_stops_a_body_to_second_order():
    """v = v0 exp(-t c / m), and v0 / (1 + q v0 t / m)."""
    for drag, expected in (
        (Drag(linear=3.0), 4.0 * math.exp(-3.0 / MASS)),
        (Drag(quadratic=0.7), 4.0 / (1.0 + 0.7 * 4.0 / MASS)),
    ):
        errors = []
        for h in (4e-3, 2e-3, 1e-3):
            world = one(drag, substep=h, linear_velocity=(0, 4, 0))
            world.advance(1.0)
            errors.append(abs(float(world.linear_velocity[0, 0, 1]) / expected - 1.0))
        assert errors[-1] < 2e-6
        np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.1)


def test_the_terminal_velocity_is_exact():
    weight = 9.81 * MASS
    world = one(Drag(linear=2.0, quadratic=1.0), gravity=(0, 0, -9.81))
    world.advance(30.0)
    speed = -float(world.linear_velocity[0, 0, 2])
    assert 2.0 * speed + speed**2 == pytest.approx(weight, rel=1e-12)
    np.testing.assert_allclose(world.force(), 0.0, atol=1e-10)


def test_drag_leaves_a_body_at_rest_on_the_ground_as_it_is():
    positions = []
    for fields in ((), (Drag(linear=0.5),)):
        scene = Scene([Body(SLAB, mass=MASS, position=(0, 0, 0.02))], [Ground()], fields=fields)
        world = World(scene)
        world.advance(1.0)
        positions.append(world.position.copy())
    np.testing.assert_allclose(positions[0], positions[1], atol=1e-12)


def test_a_spring_at_an_offset_turns_a_ball():
    spring = PointSpring(0, 10.0, point=(0.0, 0.1, 0.0), to=(1.0, 0.1, 0.0))
    world = World(Scene([Body(Sphere(0.1), mass=1.0)], gravity=(0, 0, 0), fields=[spring]))
    world.advance(0.02)
    assert world.angular_velocity[0, 0, 2] < -1e-3


@pytest.mark.parametrize(
    ("fields", "frequency", "rate"),
    [
        ([PointSpring(0, 200.0)], math.sqrt(200.0 / MASS), 0.0),
        ([PointSpring(0, 100.0), PointSpring(0, 100.0)], math.sqrt(200.0 / MASS), 0.0),
        ([Drag(linear=300.0)], 0.0, 300.0 / MASS),
        ([PointSpring(0, 400.0, damping=8.0)], math.sqrt(400.0 / MASS), 8.0 / MASS),
    ],
)
def test_the_largest_stable_step_is_where_the_motion_starts_to_grow(fields, frequency, rate):
    scene = Scene([Body(SLAB, mass=MASS, position=(0.1, 0, 0), linear_velocity=(1, 0, 0))],
                  gravity=(0, 0, 0), fields=fields)  # fmt: skip
    step = World(scene, Fidelity(substep=1e-4)).largest_stable_step()
    if rate == 0.0:
        assert step == pytest.approx(2.0 / frequency, rel=1e-3)
    far = []
    for factor in (0.99, 1.02):
        world = World(scene, Fidelity(substep=factor * step), allow_unstable=True)
        try:
            world.advance(3000 * factor * step)
            far.append(float(np.abs(world.linear_velocity).max()))
        except SimulationDiverged:
            far.append(math.inf)
    assert far[0] < 100.0 < far[1]
    with pytest.raises(ValueError, match=r"Scene.fields\[0\], .* largest safe step is"):
        World(scene, Fidelity(substep=1.02 * step))


BODY = Body(SLAB, name="slab")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PointSpring(0, -1.0), "PointSpring.stiffness must be .*at least 0"),
        (lambda: PointSpring(0, 1.0, to_point=(1, 0, 0)), "to_point .* needs another body"),
        (lambda: PointSpring(None, 1.0), "PointSpring.body must be the index or the name"),
        (lambda: Attractor((0, 0), 1.0), "Attractor.position must be 3 numbers"),
        (lambda: Attractor((0, 0, 0), 1.0, 9.0), "Attractor.exponent must be"),
        (lambda: Drag(linear=math.nan), "Drag.linear must be finite"),
        (lambda: Scene([BODY], fields=[Drag(1.0, body="cube")]),
         r"Scene.fields\[0\]: Drag.body must be .*'cube'; there are: 'slab'"),
        (lambda: Scene([BODY], fields=[PointSpring(0, 1.0, to=3)]),
         r"PointSpring.to must be the name or index of a body, got 3"),
        (lambda: Scene([BODY], fields=[PointSpring(0, 1.0, to="slab")]), "is the body itself"),
        (lambda: Scene([BODY], fields=[BODY]), r"Scene.fields\[0\] must be PointSpring or"),
    ],
)  # fmt: skip
def test_a_bad_field_is_refused_by_name(make, message):
    with pytest.raises((TypeError, ValueError), match=message):
        make()
