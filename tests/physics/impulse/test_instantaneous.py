"""Instantaneous collisions beside all else that happens in a step: weight, looks, other worlds."""

import math
from dataclasses import replace

import numpy as np
import pytest

from physics import (
    PRESETS,
    Body,
    Box,
    Drive,
    Ground,
    Material,
    Scene,
    SimulationDiverged,
    Sphere,
    World,
)
from physics.reference import scenes
from physics.reference.scenes import CUBE, GRAVITY

STEP = PRESETS["solid"].substep
PHASES = 40


def ball(restitution, speed, height=0.03, friction=0.5, **other):
    """A ball of 2 cm that falls straight on the ground, where friction has nothing to do."""
    return scenes.sphere_on_ground(
        friction=friction, restitution=restitution, position=(0, 0, height),
        linear_velocity=(0, 0, -speed), **other,
    )  # fmt: skip


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_an_elastic_ball_keeps_its_energy_under_gravity(speed):
    world = World(ball(1.0, speed), "solid", count=PHASES)
    position = np.zeros((PHASES, 1, 3))
    position[:, 0, 2] = 0.0201 + speed * STEP * np.arange(PHASES) / PHASES
    world.set_state(position=position)
    before = world.kinetic_energy() + world.potential_energy()
    world.advance(2.0)  # many bounces
    after = world.kinetic_energy() + world.potential_energy()
    np.testing.assert_allclose(after, before, rtol=1e-12)


def test_under_gravity_restitution_is_right_in_the_mean_over_the_phases_of_touch():
    """Each is met up to half a step early or late, and so a little too high or too low."""
    world = World(ball(0.5, 1.0), "solid", count=PHASES)
    position = np.zeros((PHASES, 1, 3))
    # a whole step's worth of phases at the speed that it has on the ground
    speed = math.sqrt(1.0 + 2.0 * GRAVITY * 0.01)
    position[:, 0, 2] = 0.03 + speed * STEP * np.arange(PHASES) / PHASES
    world.set_state(position=position)
    met = np.sqrt(1.0 + 2.0 * GRAVITY * (position[:, 0, 2] - 0.02))
    world.advance(0.03)
    up, height = world.linear_velocity[:, 0, 2], world.position[:, 0, 2] - 0.02
    ratio = np.sqrt(up**2 + 2.0 * GRAVITY * height) / met
    assert ratio.mean() == pytest.approx(0.5, abs=1e-3)
    assert np.abs(ratio - 0.5).max() < 0.75 * GRAVITY * STEP + 1e-3


def test_a_collision_is_whole_whatever_the_next_frame_is_long():
    world = World(ball(1.0, 1.0, height=0.0235, gravity=0.0), "solid")
    world.advance(2 * STEP)  # ends with the collision
    assert world.linear_velocity[0, 0, 2] == pytest.approx(1.0, abs=1e-12)
    world.advance(0.05 * STEP)
    world.advance(0.05 * STEP)
    assert world.linear_velocity[0, 0, 2] == pytest.approx(1.0, abs=1e-12)


def test_a_cube_at_rest_stays_so_through_frames_of_changing_length():
    world = World(scenes.block_on_ground(), "solid")
    world.advance(1.0)
    height = world.position[0, 0, 2]
    for _ in range(200):
        world.advance(STEP)
        world.advance(0.3 * STEP)
        assert np.abs(world.linear_velocity).max() < 1e-5
    assert world.position[0, 0, 2] == pytest.approx(height, abs=1e-7)


def test_a_free_tool_moves_alike_whatever_frames_are_long():
    tool = Drive(Sphere(0.01), mass=0.05, force_limit=5.0, position=(0, 0, 0.1))
    cube = Body(CUBE, mass=0.1, position=(0.5, 0, 0.02))
    world = World(Scene([cube], [Ground()], [tool]), "solid")
    world.command_drives((10.0, 0.0, 0.0))
    world.advance(0.01)
    world.advance(1e-4)
    assert world.drive_velocity[0, 0, 0] == pytest.approx(100.0 * 0.0101, rel=1e-3)


def test_a_reset_neighbour_changes_nothing_when_frames_change_their_length():
    worlds = [World(scenes.block_on_ground(), "solid", count=2) for _ in range(2)]
    for world, resets in zip(worlds, (True, False), strict=True):
        world.advance(0.05)
        world.advance(0.0005)
        if resets:
            world.reset(np.array([False, True]))
        world.advance(0.02)
    np.testing.assert_array_equal(worlds[0].position[0], worlds[1].position[0])


def test_the_force_reported_is_that_which_the_momentum_shows():
    world = World(ball(1.0, 1.0, height=0.0235, gravity=0.0), "solid")
    given = np.zeros(3)
    for _ in range(10):
        world.advance(STEP)
        given += STEP * world.contacts().force.sum(axis=0)
    mass = world.scene.bodies[0].mass
    np.testing.assert_allclose(given, (0, 0, 2.0 * mass), atol=1e-12)


def test_an_edge_that_an_impact_of_the_other_edge_lifts_has_pressed_up_to_it():
    """In one world of many bodies as in others: with half of its force in that step."""
    rough = Material(1.0)
    block = Body(
        Box((0.015, 0.015, 0.06)), mass=0.1, position=(-0.00738, 0, 0.06132), material=rough,
        orientation=(0, math.sin(0.06), 0, math.cos(0.06)),
    )  # fmt: skip
    balls = [Body(Sphere(0.02), mass=0.1, position=(1 + n, 0, 100)) for n in range(40)]
    paths = []
    for others in ([], balls):
        world = World(Scene([block, *others], [Ground(material=rough)]), "solid")
        spins, pressed = [0.0], [0.0]
        while spins[-1] <= min(spins) or len(spins) < 9:
            world.advance(STEP)
            contacts = world.contacts()
            first = contacts.point[:, 0] > world.position[0, 0, 0]  # of the edge on which it turns
            spins.append(world.angular_velocity[0, 0, 1])
            pressed.append(contacts.force[first, 2].sum())
        assert pressed[-1] == pytest.approx(0.5 * pressed[-2], rel=0.05)
        for _ in range(100):
            world.advance(STEP)
            spins.append(world.angular_velocity[0, 0, 1])
        paths.append(spins)
    np.testing.assert_allclose(paths[1], paths[0], atol=1e-9)


def test_what_an_impact_elsewhere_finds_lifted_has_no_friction():
    """In a world in which a ball lands, a cube that slid has just been lifted off the ground."""
    cube = Body(CUBE, mass=0.1, position=(0, 0, 0.02), material=Material(0.5))
    ball = Body(Sphere(0.02), mass=0.1, position=(1, 0, 0.054), linear_velocity=(0, 0, -1.0))
    world = World(Scene([cube, ball], [Ground(material=Material(0.5))]), "solid", 24)
    position, velocity = world.position.copy(), world.linear_velocity.copy()
    position[:, 1, 2] += 0.1 * STEP * np.arange(24)  # the ball lands in some of the worlds
    velocity[:, 0, 0] = 1.0
    world.set_state(position=position, linear_velocity=velocity)
    world.advance(15 * STEP)
    state = world._simulation.state.dynamic
    state["position"][:, 0, 2] += 1e-4
    state["momentum"][:, 0, 2] += 0.03
    falls = world.linear_velocity[:, 1, 2] < 0.0
    world.advance(STEP)
    lands = falls & (world.linear_velocity[:, 1, 2] > 0.0)
    assert lands.any()
    assert not lands.all()
    assert np.ptp(world.linear_velocity[:, 0, 0]) < 1e-3 * 0.5 * GRAVITY * STEP


@pytest.mark.parametrize("speed", [1.0, 5.0, 20.0])
def test_a_body_is_met_at_most_half_a_step_late(speed):
    """Whatever the skin: what is met so soon is looked for."""
    world = World(ball(1.0, speed, gravity=0.0), "solid", count=PHASES)
    position = np.zeros((PHASES, 1, 3))
    position[:, 0, 2] = 0.1 + speed * STEP * np.arange(PHASES) / PHASES
    world.set_state(position=position)
    deepest = 0.0
    for _ in range(math.ceil(0.2 / speed / STEP)):
        world.advance(STEP)
        deepest = max(deepest, (0.02 - world.position[:, 0, 2]).max())
    assert 0.0 < deepest <= 0.5 * speed * STEP * (1.0 + 1e-9)


def test_what_touches_nothing_changes_no_collision():
    """Neither its restitution nor its energy, however large."""
    cube = Body(
        CUBE, mass=0.1, position=(0, 0, 0.06), orientation=(0.1, 0.2, 0.3, 0.9),
        linear_velocity=(2.0, 0.0, -1.0), material=Material(2.0, 0.5),
    )  # fmt: skip
    found = []
    for restitution, speed in ((0.5, 0.0), (1.0, 100.0)):
        other = Body(
            Sphere(1.0), mass=1e6, position=(50.0, 0, 5.0),
            linear_velocity=(speed, 0, 0), material=Material(2.0, restitution),
        )  # fmt: skip
        scene = Scene([cube, other], [Ground(Material(2.0, 0.5))], gravity=(0, 0, 0))
        world = World(scene, "solid")
        world.advance(0.1)
        found.append(world.linear_velocity[0, 0].copy())
    assert found[0][2] > 0.0
    np.testing.assert_array_equal(found[0], found[1])


@pytest.mark.parametrize("speed", [1e200, 1e305])
@pytest.mark.parametrize("scene", [scenes.block_on_ground(), scenes.push_like()])
def test_a_world_that_diverges_takes_no_other_with_it(scene, speed):
    world = World(scene, "solid", count=24, threads=1)
    velocity = np.zeros((24, 1, 3))
    velocity[3] = speed
    world.set_state(linear_velocity=velocity)
    with pytest.raises(SimulationDiverged) as error:
        world.advance(0.1)
    assert error.value.worlds == [3]
    assert np.isfinite(np.delete(world.position, 3, axis=0)).all()


def test_a_look_moves_no_tool():
    """Neither that of a world beside one that is reset, nor one's own."""
    tool = Drive(Sphere(0.01), mass=0.1, force_limit=10.0, position=(0, 0, 0.1))
    scene = Scene([Body(CUBE, mass=0.1, position=(0.5, 0, 0.02))], [Ground()], [tool])
    untouched, beside, seen, unseen = worlds = [World(scene, "solid", count=2) for _ in range(4)]
    for world in worlds:
        world.command_drives((0.3, 0.0, 0.0))
        world.advance(0.04)
    beside.reset(np.array([True, False]))
    for world in (seen, unseen):
        world.set_state(time=0.04)
    for _ in range(10):
        seen.penetration()
    for world in worlds:
        world.advance(0.04)
    np.testing.assert_array_equal(beside.drive_position[1], untouched.drive_position[1])
    np.testing.assert_array_equal(seen.drive_position, unseen.drive_position)


def test_friction_of_a_pair_does_not_pull_against_itself():
    """Both sides of two cubes hold the same place, and must not wind each other up."""
    shift = Body(CUBE, mass=0.1, position=(3e-4, 1e-4, 0.06), material=Material(0.5))
    world = World(Scene([Body(CUBE, mass=0.1, position=(0, 0, 0.02)), shift], [Ground()]), "solid")
    world.advance(300.0)
    contacts = world.contacts()
    between = (contacts.pair < 2).all(axis=1)
    assert np.abs(contacts.force[between, :2]).max() < 0.01 * 0.1 * GRAVITY


def test_a_pair_has_one_first_touch():
    tilted = Body(
        Box((0.02, 0.03, 0.02)), mass=0.1, position=(0, 0, 0.09), orientation=(1, 2, 3, 9)
    )
    scene = Scene([Body(CUBE, mass=0.1, position=(0, 0, 0.02)), tilted], [Ground()])
    for fidelity in ("solid", "balanced"):
        world = World(scene, fidelity)
        world.advance(0.2)
        contacts = world.contacts()
        for pair, time in zip(contacts.pair, contacts.first_touch, strict=True):
            assert world.first_touch(*map(int, pair))[0] == time


def test_first_touch_is_known_without_another_look():
    world = World(scenes.block_on_ground(), "balanced")
    world.set_state(position=(0, 0, 0.019))
    assert world.first_touch(0, 1)[0] == 0.0


def test_restore_takes_only_what_was_saved_from_such_worlds():
    scene = scenes.block_on_ground()
    saved = World(scene, "balanced").snapshot()
    other = replace(scene, bodies=(replace(scene.bodies[0], mass=5.0),))
    for wrong, name in (
        (World(scene, "fast"), "fidelity"),
        (World(other, "balanced"), "scene"),
        (World(scene, "balanced", count=2), "count"),
    ):
        with pytest.raises(ValueError, match=f"saved must be .* another {name}"):
            wrong.restore(saved)


def test_a_light_box_that_a_ball_jams_against_the_ground_gains_no_energy():
    """Friction gave back more than it took: 17 of them gained up to 88 % of the ball's energy."""
    count, half, radius, material = 2000, 0.047, 0.015, Material(1.8, 0.6)
    bodies = [
        Body(Box((half,) * 3), mass=1.4e-4, material=material),
        Body(Sphere(radius), mass=0.05, material=material),
    ]
    world = World(Scene(bodies, [Ground(material)]), "solid", count=count)
    rng = np.random.default_rng(0)
    position, velocity = np.zeros((2, count, 2, 3))
    position[:, 0, 2] = half - 1e-5
    position[:, 1, 1] = -half - radius - 1e-3
    position[:, 1, 0] = rng.uniform(-0.04, 0.04, count)
    position[:, 1, 2] = rng.uniform(0.03, 0.1, count)
    velocity[:, 1, 1] = rng.uniform(0.3, 1.5, count)
    velocity[:, 1, 2] = rng.uniform(-2.0, -0.5, count)
    world.set_state(position=position, linear_velocity=velocity)
    start = world.kinetic_energy() + world.potential_energy()
    for _ in range(20):
        world.advance(0.004)
        assert np.all(world.kinetic_energy() + world.potential_energy() < start * (1.0 + 1e-3))
