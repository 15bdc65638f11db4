"""The work of servos, and the energy of contacts: where the energy of a world comes from."""

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Drive,
    Fidelity,
    Gripper,
    Ground,
    Material,
    Scene,
    Sphere,
    World,
)

SMOOTH = Material(0.0, 1.0)
# one feature set for most of the tests
LIFT = Scene(
    bodies=[Body(Sphere(0.02), mass=0.1, position=(0, 0, 0.07), material=SMOOTH)],
    statics=[Ground(SMOOTH, -1.0)],
    drives=[
        Drive(Box((0.05, 0.05, 0.05)), mass=0.2, force_limit=20.0, material=SMOOTH, name="table")
    ],
)
GRIPPER = Scene(drives=[Gripper(Box((0.01,) * 3), mass=0.3, force_limit=14.0, grip_limit=4.0)])


def balance(world):
    """[count] J: energy of bodies, drives and contacts less the work of the servos."""
    energy = world.kinetic_energy() + world.potential_energy() + world.elastic_energy()
    return energy + world.drive_energy().sum(axis=1) - world.drive_work().sum(axis=1)


@pytest.mark.parametrize("integrator", ["midpoint", "euler"])
def test_work_on_a_free_drive_is_its_kinetic_energy(integrator):
    alone = Scene(drives=[Drive(Sphere(0.02), mass=0.05, force_limit=2.5)])
    scene = LIFT if integrator == "midpoint" else alone  # whose ball is put away
    world, rng = World(scene, Fidelity(integrator=integrator), measure_work=True), rng_of(0)
    if scene is LIFT:
        world.set_state(position=(5.0, 0.0, 0.0))
    for _ in range(20):
        world.command_drives(rng.normal(size=(1, 1, 3)))
        world.advance(0.01)
        assert world.drive_work() == pytest.approx(world.drive_energy(), rel=1e-12, abs=1e-15)
    assert world.drive_energy()[0, 0] > 1e-4


def test_work_on_a_free_gripper_is_the_kinetic_energy_of_its_fingers():
    world, rng = World(GRIPPER, count=3, measure_work=True), rng_of(1)
    for _ in range(20):
        world.move_drives(world.drive_position + 0.1 * rng.normal(size=(3, 2, 3)), 0.04)
        world.advance(0.04)
        work, energy = world.drive_work().sum(axis=1), world.drive_energy().sum(axis=1)
        assert work == pytest.approx(energy, rel=1e-11)


def test_work_of_a_lift_is_the_potential_and_kinetic_energy_of_the_load():
    world = World(LIFT, measure_work=True)
    world.advance(1.0)
    start, before = balance(world), world.drive_work().sum()
    world.move_drives([0.0, 0.0, 0.3], 0.5)
    world.advance(0.7)
    lifted = 0.1 * 9.81 * (world.position[0, 0, 2] - 0.07)
    assert world.drive_work().sum() - before == pytest.approx(lifted, rel=0.02)
    assert lifted == pytest.approx(0.1 * 9.81 * 0.3, rel=0.02)
    assert balance(world) == pytest.approx(start, abs=1e-3 * lifted)


def test_a_ball_that_bounces_elastically_has_no_more_than_its_energy():
    world, energies = World(LIFT, measure_work=True), []
    world.set_state(position=[0.5, 0.0, -0.7], drive_position=[0.0, 0.0, 0.0])
    for _ in range(500):
        world.advance(0.002)
        energies.append(balance(world)[0] + 0.1 * 9.81 * 0.98)  # above the ground
    start = energies[0]
    assert max(energies) < start * (1.0 + 1e-3)
    assert min(energies) > start * (1.0 - 1.0 / 16.0)
    assert world.elastic_energy()[0] >= 0.0


def test_elastic_energy_of_a_ball_at_rest_is_half_its_weight_times_its_penetration():
    world = World(LIFT, "balanced", measure_work=True)
    world.advance(2.0)
    weight = 0.1 * 9.81
    assert world.elastic_energy() == pytest.approx(0.5 * weight * world.penetration(), rel=0.02)


def test_lifting_with_impulses_gains_no_energy():
    world = World(LIFT, "solid", measure_work=True)
    world.advance(0.2)
    start = balance(world)
    world.move_drives([0.0, 0.0, 0.1], 0.2)
    world.advance(0.4)
    assert 0.0 <= world.elastic_energy()[0] < 1e-4
    assert world.drive_work().sum() > 0.09
    assert balance(world) <= start + 1e-6


def test_measuring_changes_no_bit():
    positions = []
    for measure_work in (False, True):
        world = World(LIFT, count=17, measure_work=measure_work)
        world.move_drives([0.0, 0.0, 0.1], 0.05)
        for _ in range(5):
            world.advance(0.04)
        positions.append(world.read().rows)
    assert np.array_equal(*positions)


def test_work_is_saved_and_begins_again_with_a_reset():
    world = World(LIFT, count=2, measure_work=True)
    world.move_drives([0.0, 0.0, 0.1], 0.1)
    world.advance(0.04)
    saved, work = world.snapshot(), world.drive_work()
    world.advance(0.04)
    further = world.drive_work()
    world.restore(saved)
    assert np.array_equal(world.drive_work(), work)
    world.advance(0.04)
    assert np.array_equal(world.drive_work(), further)
    world.reset(np.array([True, False]))
    assert world.drive_work()[0] == 0.0
    assert world.drive_work()[1] == further[1]


def test_what_cannot_be_measured_is_an_error():
    with pytest.raises(ValueError, match="measure_work=True"):
        World(LIFT).drive_work()
    with pytest.raises(ValueError, match=r"measure_work needs a Drive or Gripper in Scene\.drives"):
        World(Scene([Body(Sphere(0.1), mass=1.0)]), measure_work=True)
    with pytest.raises(ValueError, match="time_control='fixed', got 'adaptive'"):
        World(LIFT, Fidelity(time_control="adaptive"), measure_work=True)
    with pytest.raises(TypeError, match="measure_work must be bool"):
        World(LIFT, measure_work=1)
    many = Scene(
        [Body(Sphere(0.01), mass=0.1, position=(0.1 * i, 0, 1)) for i in range(40)],
        drives=LIFT.drives,
    )
    with pytest.raises(ValueError, match="measure_work needs engine='worlds', got 'bodies' for 40"):
        World(many, measure_work=True)
    saved = World(LIFT).snapshot()
    with pytest.raises(ValueError, match="another measure_work: False"):
        World(LIFT, measure_work=True).restore(saved)


def rng_of(seed):
    return np.random.default_rng(seed)
