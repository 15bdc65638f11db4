"""Fast bodies among many: they collide where they touch, however far they go in a step.

All scenes hold the same kinds of solids, some of them far away, so that they share kernels.
"""

from dataclasses import replace

import numpy as np
import pytest

from physics import (
    BallJoint,
    Body,
    Box,
    Fidelity,
    Gripper,
    Ground,
    Material,
    Scene,
    Sphere,
    Static,
    Torus,
    World,
)
from physics.manybody import simulation as many
from physics.step.simulation import Simulation
from tests.physics.manybody.scenes import wall

STEP, SPEED, RADIUS = 2e-3, 300.0, 0.0025
PLATE = 0.001  # m, half the thickness of a plate: a bullet passes through 300 of them in a step
TOLERANCE = Fidelity().impact_tolerance
FIXED = Fidelity(law="impulse", contact_resolution=1.8, spacing=1.0)
SWEPT = replace(FIXED, time_control="swept")
BULLETS, FAR = 40, 50.0
GRIPPER = Gripper(
    Box((0.005, 0.005, 0.015)), 0.2, 200.0, 50.0, (2.0, 0.0, FAR), 0.07, frequency=60.0
)


@pytest.fixture(autouse=True)
def _threads_for_few_pairs(monkeypatch):
    monkeypatch.setattr(many, "_FEWEST_BATCHES", 2)


def made(scene, fidelity=SWEPT, threads=1):
    """A world with the scene, and with solids that touch none of its own."""
    material, ground = Material(friction=0.5, restitution=0.0), []
    if not any(isinstance(static, Ground) for static in scene.statics):
        ground = [Ground(material, -FAR)]
    height = -FAR if ground else 0.0
    others = [
        Body(shape, mass=0.1, position=(FAR, n, height + 0.02), material=material)
        for n, shape in enumerate((Box((0.02, 0.02, 0.02)), Sphere(0.02), Sphere(0.02)))
    ]
    # flush, as the walls of a box are
    slabs = [
        Static(Box((0.02, 0.02, 0.02)), (FAR + x, FAR, 0.0), material=material) for x in (0.0, 0.04)
    ]
    whole = replace(
        scene,
        bodies=(*scene.bodies, *others),
        statics=(*scene.statics, *slabs, *ground),
        drives=[GRIPPER],
    )
    # no other test has times of impact among many bodies, so a small kernel will do
    return World(whole, fidelity, threads=threads, kernel="special" if fidelity is SWEPT else None)


def bullets(restitution):
    """Bullets without weight in rows between two plates at x = 0 and x = 1 m."""
    material = Material(friction=0.0, restitution=restitution)
    start = np.random.default_rng(0).uniform(0.1, 0.9, BULLETS)
    bodies = [
        Body(Sphere(RADIUS), mass=0.004, position=(x, 0.02 * n, 0.0), material=material,
             linear_velocity=(SPEED, 0.0, 0.0))
        for n, x in enumerate(start)
    ]  # fmt: skip
    plate = Box((PLATE, 1.0, 0.1))
    plates = [
        Static(plate, position=(x, 0.4, 0.0), material=material, name=f"plate {n}")
        for n, x in enumerate((0.0, 1.0))
    ]
    return Scene(bodies, plates, gravity=(0.0, 0.0, 0.0)), start


def flight(start, restitution, time):
    """x in m and velocity in m/s of a bullet between the plates, by the closed form."""
    x, v, left = start, SPEED, time
    low, high = PLATE + RADIUS, 1.0 - PLATE - RADIUS
    while True:
        hits = ((high if v > 0.0 else low) - x) / v
        if hits > left:
            return x + v * left, v
        x, v, left = high if v > 0.0 else low, -restitution * v, left - hits


@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_bullets_are_where_the_closed_form_says_and_bitwise_the_same_for_1_2_and_4_threads(
    restitution,
):
    scene, start = bullets(restitution)
    worlds = [made(scene, threads=n) for n in (1, 2, 4)]
    assert all(isinstance(world._simulation, many.CrowdSimulation) for world in worlds)
    for k in range(1, 8):
        for world in worlds:
            world.advance(STEP)
        for n in range(BULLETS):
            x, v = flight(start[n], restitution, k * STEP)
            # each impact comes up to a tolerance early or late
            assert worlds[0].position[0, n, 0] == pytest.approx(x, abs=10 * TOLERANCE)
            assert worlds[0].linear_velocity[0, n, 0] == pytest.approx(v, rel=1e-6)
        for world in worlds[1:]:
            assert np.array_equal(worlds[0].position, world.position)


def test_mean_force_and_first_touch_of_impacts_within_a_step():
    scene, start = bullets(0.5)
    world, hits = made(scene), (1.0 - PLATE - RADIUS - start) / SPEED
    world.advance(STEP)
    for n in range(BULLETS):
        force = world.normal_force(n, "plate 1")[0]
        touched = world.first_touch(n, "plate 1")[0]
        if hits[n] < STEP:
            assert force == pytest.approx(0.004 * 1.5 * SPEED / STEP, rel=1e-6)
            assert touched == pytest.approx(hits[n], abs=3 * TOLERANCE / SPEED)
        else:
            assert force == 0.0
            assert np.isnan(touched)


def test_fixed_steps_let_the_same_bullets_through():
    scene, _ = bullets(1.0)
    world = made(scene, FIXED)
    world.advance(10 * STEP)
    assert world.position[0, :BULLETS, 0].max() > 2.0


def test_balls_that_meet_exchange_what_restitution_says():
    """20 pairs at 300 m/s each, head on; centre of mass and energy by the closed form."""
    e, material = 0.5, Material(friction=0.0, restitution=0.5)
    bodies = [
        Body(Sphere(0.008), mass=0.004, material=material,
             position=(side * (0.2 + 0.01 * n), 0.05 * n, 0.0),
             linear_velocity=(-side * SPEED, 0.0, 0.0))
        for n in range(20) for side in (-1, 1)
    ]  # fmt: skip
    world = made(Scene(bodies, gravity=(0, 0, 0)))
    world.advance(STEP)
    v = world.linear_velocity[0, :40, 0].reshape(20, 2)
    assert v == pytest.approx(np.tile((-e * SPEED, e * SPEED), (20, 1)), rel=1e-6)
    for n in range(20):
        meets = (0.2 + 0.01 * n - 0.008) / SPEED
        x = 0.008 + e * SPEED * (STEP - meets)
        assert world.position[0, 2 * n + 1, 0] == pytest.approx(x, abs=3 * TOLERANCE)


def test_no_energy_is_gained_and_nothing_escapes_while_everything_collides(stress):
    """Boxes and balls at up to 100 m/s, some with a spin, in a box of thin walls."""
    # rad/s; half of the boxes and half of the balls begin without
    for spins in ((0.0,) * 4, (2000.0,) * 4) if stress else ((0.0, 0.0, 2000.0, 2000.0),):
        collide(spins, steps=20 if stress else 10)


def collide(spins, steps):
    """Bodies collide; their spins are up to these, one after the other."""
    random, material = np.random.default_rng(1), Material(friction=0.3, restitution=1.0)
    places = 0.06 * (np.stack(np.meshgrid(*[range(4)] * 3), -1).reshape(-1, 3) - 1.5)[:36]
    shapes = Sphere(0.015), Box((0.012, 0.012, 0.012))
    bodies = [
        Body(shapes[n % 2], density=1000.0, position=tuple(place), material=material,
             linear_velocity=tuple(random.uniform(-100, 100, 3)),
             angular_velocity=tuple(random.uniform(-1, 1, 3) * spins[n % len(spins)]))
        for n, place in enumerate(places)
    ]  # fmt: skip
    walls = []
    for axis in range(3):
        half = np.full(3, 0.16)
        half[axis] = PLATE
        for side in (-1, 1):
            place = np.zeros(3)
            place[axis] = 0.15 * side
            walls.append(Static(Box(tuple(half)), position=tuple(place), material=material))
    world = made(Scene(bodies, walls, gravity=(0, 0, 0)), threads=2)
    energy = world.kinetic_energy()[0]
    for _ in range(steps):
        world.advance(STEP)
        now = world.kinetic_energy()[0]
        assert now <= energy * (1.0 + 1e-9), spins
        energy = now
        assert np.abs(world.position[0, :36]).max() < 0.15, spins


def test_a_bullet_hits_a_wall_of_cubes_and_a_snapshot_continues_bitwise():
    cubes = wall(7, 6)
    bullet = Body(
        Sphere(0.01), density=2000.0, position=(0.1, -3.0, 0.101), name="bullet",
        linear_velocity=(0.0, SPEED, 0.0), material=Material(friction=0.3, restitution=0.3),
    )  # fmt: skip
    slippery = Ground(Material(friction=0.0))  # so that momentum along it is conserved
    scene = Scene([*cubes.bodies, bullet], [slippery])
    world, again = made(scene), made(scene)
    world.advance(4 * STEP)
    momentum = world.linear_momentum()[0, 1]
    again.restore(world.snapshot())
    world.advance(STEP)
    bullet_speed = world.linear_velocity[0, world.index("bullet"), 1]
    assert abs(bullet_speed) < 0.5 * SPEED  # it has hit
    assert world.linear_momentum()[0, 1] == pytest.approx(momentum, rel=1e-9)
    world.advance(10 * STEP)
    again.advance(STEP)
    again.advance(10 * STEP)
    assert np.array_equal(world.position, again.position)


def test_slow_bodies_move_as_with_fixed_steps():
    """A wall at rest, and a wall that falls over."""
    scene = Scene(wall(7, 6).bodies, [Ground(Material(friction=0.6))])
    swept, fixed = made(scene), made(scene, FIXED)
    for world in (swept, fixed):
        world.advance(0.1)
    assert np.abs(swept.position - fixed.position).max() < 1e-9


def test_what_times_of_impact_can_not_do_is_named():
    many_bodies = bullets(1.0)[0].bodies
    ring = Body(Torus(0.1, 0.02), mass=1.0, position=(0.0, 0.0, 5.0), name="ring")
    with pytest.raises(ValueError, match=r"'swept' needs convex surfaces.* ring is a torus"):
        World(Scene([*many_bodies, ring]), SWEPT)
    coarse = replace(SWEPT, impact_tolerance=1e-3)
    with pytest.raises(ValueError, match=r"impact_tolerance 0\.001 m .*at most 0\.000.* half of"):
        World(Scene(many_bodies), coarse)
    joint = BallJoint("one", "two", (0.0, 0.01, 0.0))
    two = [
        replace(many_bodies[n], name=name, density=None) for n, name in enumerate(("one", "two"))
    ]
    with pytest.raises(ValueError, match="can't divide the steps of joints"):
        World(Scene([*two, *many_bodies[2:]], joints=[joint]), SWEPT)


def in_small_world(scene):
    """The same scene in a world with rows for all pairs."""
    return Simulation(scene, SWEPT, 1, 1, False, kernel="general")


def test_bullets_that_start_within_reach_of_a_list_collide_where_they_touch():
    """Each begins nearer to a plate than half a step of its way."""
    material = Material(friction=0.0, restitution=1.0)
    gaps = 1e-4 * np.arange(1, BULLETS + 1)
    bodies = [
        Body(Sphere(0.02), mass=0.004, position=(-0.021 - gap, 0.1 * n, 0.0), material=material,
             linear_velocity=(50.0, 0.0, 0.0))
        for n, gap in enumerate(gaps)
    ]  # fmt: skip
    plate = Static(Box((PLATE, 10.0, 0.5)), material=material, name="plate")
    world = made(Scene(bodies, [plate], gravity=(0, 0, 0)))
    world.advance(STEP)
    x = -0.021 - 50.0 * (STEP - gaps / 50.0)
    assert world.position[0, :BULLETS, 0] == pytest.approx(x, abs=3 * TOLERANCE)
    touched = [world.first_touch(n, "plate")[0] for n in range(BULLETS)]
    assert touched == pytest.approx(gaps / 50.0, abs=3 * TOLERANCE / 50.0)


def test_tilted_cubes_meet_face_to_face_as_in_a_small_world():
    random, material = np.random.default_rng(5), Material(friction=0.3, restitution=0.4)
    bodies = [
        Body(Box((0.01, 0.01, 0.01)), density=1000.0, material=material,
             position=(side * (0.02 + 0.002 * n), 0.1 * n, 0.004 * side * (n % 3)),
             orientation=(*(0.02 * random.normal(size=3)), 1.0),
             linear_velocity=(-side * (60.0 + n), 0.0, 0.0))
        for n in range(20) for side in (-1, 1)
    ]  # fmt: skip
    world = made(Scene(bodies))
    small = in_small_world(world.scene)
    for span in (STEP, STEP, 5e-4, 5e-4, STEP):
        world.advance(span)
        small.advance(span, small.everyone)
    apart = world.position[0, :40] - small.state.dynamic["position"][0, :40]
    assert np.abs(apart).max() < 1e-8


def test_the_fingers_of_a_gripper_stay_one_solid_when_a_bullet_hits_one():
    shot = Body(
        Sphere(0.004), mass=0.05, position=(1.9, -0.035, FAR + 0.002), linear_velocity=(100.0, 0, 0)
    )
    world = made(Scene([shot, *bullets(0.5)[0].bodies[:36]], gravity=(0, 0, 0)))
    small = in_small_world(world.scene)
    for _ in range(3):
        world.advance(STEP)
        small.advance(STEP, small.everyone)
    fingers = world.drive_position[0]
    assert fingers[0, [0, 2]] == pytest.approx(fingers[1, [0, 2]], abs=1e-12)
    assert world.drive_velocity[0, 0, 0] > 5.0  # it was hit
    assert fingers == pytest.approx(small.state.dynamic["position"][0, -2:], abs=1e-8)
