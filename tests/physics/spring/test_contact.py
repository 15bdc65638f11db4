"""Contacts obey the closed forms of rigid bodies: bounce, slide, stick, roll, and never pull."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Capsule,
    ContactOverflow,
    Drive,
    Fidelity,
    Ground,
    Material,
    Scene,
    SimulationDiverged,
    Sphere,
    Static,
    World,
)
from physics.reference import closed_forms, scenes
from physics.reference.measures import energy_gain, grazing
from physics.reference.scenes import CUBE, GRAVITY, settled

BALL = Sphere(0.025)

PHASES = 100
SPEED = 1.0


def rebound(restitution, fidelity, friction=0.0, frame=0.5):
    """Rebound speeds [100] of a ball at 1 m/s whose touches fall on all phases of a step.

    `frame` is the time of each call of `advance`, in s.
    """
    scene = scenes.sphere_on_ground(
        friction=friction, restitution=restitution, gravity=0.0, linear_velocity=(0, 0, -SPEED)
    )
    world = World(scene, fidelity, count=PHASES)
    position = np.zeros((PHASES, 1, 3))
    step = world.fidelity.substep * SPEED
    position[:, 0, 2] = scenes.BALL.radius + step * (2.0 + np.arange(PHASES) / PHASES)
    world.set_state(position=position)
    for _ in range(round(0.5 / frame)):
        world.advance(frame)
    return world.linear_velocity[:, 0, 2]


# --- along the normal ---------------------------------------------------------------------------


@pytest.mark.parametrize("frame", [0.5, 1.0 / 60.0])
@pytest.mark.parametrize(
    ("fidelity", "tolerance"), [("fast", 7e-4), ("balanced", 7e-4), ("accurate", 3e-5)]
)
@pytest.mark.parametrize("restitution", [0.25, 0.5, 0.75])
def test_restitution_is_what_was_asked_for_at_every_phase_of_touch(
    restitution, fidelity, tolerance, frame
):
    """Frames of 1/60 s shorten the substep, and with it omega h: 0.486 and 0.463 instead of 0.5."""
    errors = rebound(restitution, fidelity, frame=frame) - restitution
    assert np.abs(errors).max() <= tolerance


@pytest.mark.parametrize("below", [1e-16, 1e-12, 1e-7])
def test_next_to_elastic_is_nearly_elastic(below):
    np.testing.assert_allclose(
        rebound(1.0 - below, "balanced"), rebound(1.0, "balanced"), atol=1e-6
    )


def test_without_restitution_a_ball_stays_down():
    assert np.abs(rebound(0.0, "accurate")).max() <= 1e-3 * SPEED


@pytest.mark.parametrize("fidelity", ["fast", "balanced", "accurate"])
def test_an_elastic_bounce_gains_no_energy(fidelity):
    speeds = rebound(1.0, fidelity)
    assert (speeds**2 / SPEED**2 - 1.0).max() <= 1e-3
    assert speeds.min() >= (0.999 if fidelity == "accurate" else 0.98)


def test_friction_changes_nothing_in_a_straight_bounce():
    np.testing.assert_array_equal(rebound(0.5, "balanced"), rebound(0.5, "balanced", 0.5))


@pytest.mark.parametrize("restitution", [0.25, 0.5, 0.75])
def test_the_dashpot_restitution_is_that_of_the_clamped_spring(restitution):
    fidelity = Fidelity(substep=0.25e-3, contact_resolution=0.02, damping="dashpot")
    assert np.abs(rebound(restitution, fidelity, 0.5) - restitution).max() <= 0.02


def test_a_bouncing_ball_rises_to_e_squared_of_its_height():
    drop = 0.5
    scene = scenes.sphere_on_ground(restitution=0.8, friction=0.0, position=(0, 0, 0.02 + drop))
    world = World(scene, "accurate")
    falling = math.sqrt(2.0 * drop / GRAVITY)
    world.advance(falling + 0.8 * falling)
    np.testing.assert_allclose(world.position[0, 0, 2] - 0.02, 0.8**2 * drop, rtol=1e-2)
    assert abs(world.linear_velocity[0, 0, 2]) < 0.05


def test_a_contact_lasts_half_a_period_and_sinks_v_over_omega():
    stiffness, mass, speed = 1e3, 0.1, 0.5  # of two materials in series
    scene = scenes.sphere_on_ground(
        restitution=1.0, friction=0.0, gravity=0.0, stiffness=2.0 * stiffness,
        linear_velocity=(0, 0, -speed),
    )  # fmt: skip
    world = World(scene, Fidelity(substep=1e-5))
    times, depths = [], []
    for _ in range(4000):
        world.advance(1e-5)
        depths.append(scenes.BALL.radius - world.position[0, 0, 2])
        times.append(world.time[0])
    touching = np.array(depths) > 0.0
    lasted = touching.sum() * 1e-5
    assert lasted == pytest.approx(closed_forms.contact_period(mass, stiffness), abs=3e-5)
    assert max(depths) == pytest.approx(speed * math.sqrt(mass / stiffness), rel=1e-4)


@pytest.mark.parametrize(("spacing", "samples"), [(1.0, 8), (0.5, 20), (0.25, 44)])
def test_a_cube_sinks_as_deep_however_many_samples_it_has(spacing, samples):
    fidelity = Fidelity(spacing=spacing)
    world = settled(scenes.block_on_ground(), fidelity)
    assert world._simulation.model.half_pair["sample_count"].tolist() == [samples]
    stiffness = 0.1 * (fidelity.contact_resolution / fidelity.substep) ** 2
    sink = closed_forms.resting_penetration(0.1 * GRAVITY, stiffness)
    assert 0.02 - world.position[0, 0, 2] == pytest.approx(sink, rel=1e-6)
    assert world.penetration()[0] == pytest.approx(sink, rel=1e-6)


def test_contacts_never_pull():
    """Cubes thrown about: every force points out of the ground, within the cone of friction."""
    rng = np.random.default_rng(0)
    scene = scenes.block_on_ground(restitution=0.5)
    world = World(scene, count=40)
    world.set_state(
        position=rng.uniform([-1, -1, 0.05], [1, 1, 0.1], (40, 1, 3)),
        orientation=rng.normal(size=(40, 1, 4)),
        linear_velocity=rng.uniform(-1, 1, (40, 1, 3)),
        angular_velocity=rng.uniform(-10, 10, (40, 1, 3)),
    )
    seen = 0
    for _ in range(20):
        world.advance(0.02)
        for w in range(40):
            force = world.contacts(w).force
            assert np.all(force[:, 2] >= 0.0)
            sideways = np.hypot(force[:, 0], force[:, 1])
            assert np.all(sideways <= 0.5 * force[:, 2] * (1 + 1e-9) + 1e-15)
            seen += len(force)
    assert seen > 500


# --- friction -----------------------------------------------------------------------------------


@pytest.mark.parametrize("half_extents", [(0.02, 0.02, 0.02), (0.04, 0.03, 0.02)])
@pytest.mark.parametrize(
    ("speed", "fidelity", "tolerance"),
    [
        (2.0, "balanced", 0.05e-2),
        (2.0, "accurate", 0.005e-2),
        (0.5, "balanced", 0.05e-2),
        (0.5, "accurate", 0.005e-2),
    ],
)
def test_block_stops_after_v_squared_over_two_mu_g(half_extents, speed, fidelity, tolerance):
    friction = 0.5
    world = settled(scenes.block_on_ground(half_extents, friction), fidelity)
    start = world.position[0, 0, 0]
    world.set_state(linear_velocity=(speed, 0.0, 0.0))
    world.advance(speed / (friction * GRAVITY) + 0.5)
    way = world.position[0, 0, 0] - start
    expected = closed_forms.slide_distance(speed, friction, GRAVITY)
    # sides of unequal length rock differently, and the damping of friction is for their mean
    unequal = half_extents[0] != half_extents[1]
    assert way == pytest.approx(expected, rel=tolerance * (2.0 if unequal else 1.0))
    assert np.abs(world.linear_velocity).max() < 1e-9


def test_a_block_slides_straight_in_every_direction():
    """Friction acts against the velocity, not axis by axis."""
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    world = settled(scenes.block_on_ground(), count=24)
    along = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)[:, None]
    world.set_state(linear_velocity=along)
    world.advance(0.5)
    way = world.position[:, 0] - np.array([0.0, 0.0, world.position[0, 0, 2]])
    distance = np.linalg.norm(way, axis=-1)
    np.testing.assert_allclose(distance, closed_forms.slide_distance(1.0, 0.5, GRAVITY), rtol=5e-4)
    np.testing.assert_allclose(way, distance[:, None] * along[:, 0], atol=1e-4)


@pytest.mark.parametrize(("fidelity", "time"), [("balanced", 60.0), ("accurate", 5.0)])
@pytest.mark.parametrize("half_extents", [(0.02, 0.02, 0.02), (0.04, 0.03, 0.02)])
def test_a_block_on_an_incline_below_the_angle_of_friction_stays(half_extents, fidelity, time):
    scene = scenes.block_on_ground(half_extents, friction=0.5, angle=math.radians(20.0))
    world = settled(scene, fidelity)
    start = world.position.copy()
    world.advance(time)
    assert np.linalg.norm(world.position - start) / time < 1e-9
    assert np.abs(world.linear_velocity).max() < 1e-9


@pytest.mark.parametrize("degrees", [30.0, 40.0])
def test_a_block_on_a_steep_incline_slides_at_g_sin_minus_mu_cos(degrees):
    friction, angle = 0.3, math.radians(degrees)
    world = settled(scenes.block_on_ground((0.04, 0.03, 0.02), friction, angle=angle))
    before = world.linear_velocity[0, 0, 0]
    world.advance(1.0)
    gained = world.linear_velocity[0, 0, 0] - before
    assert gained == pytest.approx(
        closed_forms.incline_acceleration(angle, friction, GRAVITY), rel=1e-3
    )


def test_without_friction_a_block_slides_on_for_ever():
    tool = Drive(Sphere(0.02), 0.05, 5.0, (0, 0, 9.0))  # for a kernel that other scenes have, too
    world = settled(replace(scenes.block_on_ground(friction=0.0), drives=[tool]))
    world.set_state(linear_velocity=(1.0, 0.5, 0.0))
    world.advance(5.0)
    np.testing.assert_allclose(world.linear_velocity[0, 0, :2], (1.0, 0.5), rtol=1e-12)


@pytest.mark.parametrize("radius", [0.05, 0.1])
def test_a_sliding_ball_ends_up_rolling_at_five_sevenths(radius):
    speed, friction = 2.0, 0.3
    world = settled(scenes.sphere_on_ground(radius, friction))
    world.set_state(linear_velocity=(speed, 0.0, 0.0))
    time = closed_forms.rolling_time(speed, friction, GRAVITY)
    world.advance(0.9 * time)
    velocity, spin = world.linear_velocity[0, 0, 0], world.angular_velocity[0, 0, 1]
    assert velocity > 1.05 * spin * radius
    world.advance(0.2 * time + 0.3)
    velocity, spin = world.linear_velocity[0, 0, 0], world.angular_velocity[0, 0, 1]
    assert velocity == pytest.approx(closed_forms.rolling_speed(speed), rel=1e-4)
    assert spin * radius == pytest.approx(velocity, rel=1e-4)


@pytest.mark.parametrize("degrees", [10.0, 30.0, 60.0])
def test_a_ball_rolls_down_an_incline_at_five_sevenths_or_slides(degrees):
    angle, friction = math.radians(degrees), 0.3
    world = settled(scenes.sphere_on_ground(0.1, friction, angle=angle))
    before = world.linear_velocity[0, 0, 0]
    world.advance(1.0)
    expected = closed_forms.incline_rolling_acceleration(angle, friction, GRAVITY)
    assert world.linear_velocity[0, 0, 0] - before == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("fidelity", "impulse"), [("fast", 1e-3), ("balanced", 1e-3), ("accurate", 5e-4)]
)
@pytest.mark.parametrize("along", [2.0, 0.5])
@pytest.mark.parametrize("friction", [0.05, 0.1, 0.2, 0.3, 1.0])
@pytest.mark.parametrize("static", [False, True])
def test_an_oblique_impact_gives_the_spin_of_the_impulse(
    static, friction, along, fidelity, impulse
):
    """On the ground and on a static box. Sliding through, where the impulse errs as restitution
    does, and sticking before the end."""
    down, restitution, radius = 1.0, 0.5, 0.1
    scene = scenes.sphere_on_ground(
        radius, friction, restitution, gravity=0.0, position=(0, 0, 0.11),
        linear_velocity=(along, 0, -down),
    )  # fmt: skip
    if static:
        box = Static(Box((2, 2, 1)), (0, 0, -1), material=Material(friction, restitution))
        scene = replace(scene, statics=[box])
    world = World(scene, fidelity)
    world.advance(0.5)
    x, z, spin = closed_forms.oblique_impact(along, down, friction, restitution, radius)
    sticks = 3.5 * friction * (1.0 + restitution) * down > 2.0 * along  # well before the end
    assert world.linear_velocity[0, 0, 0] == pytest.approx(x, rel=2e-5 if sticks else 1e-3)
    assert world.linear_velocity[0, 0, 2] == pytest.approx(z, abs=2.0 * impulse)
    assert world.angular_velocity[0, 0, 1] == pytest.approx(spin, rel=5e-5 if sticks else impulse)


SPRINGS = ["fast", "balanced", "accurate"]


@pytest.mark.parametrize("fidelity", SPRINGS)
@pytest.mark.parametrize("shapes", [(CUBE,), (BALL,), (CUBE, CUBE), (CUBE, BALL)])
def test_no_grazing_collision_gains_energy(shapes, fidelity):
    """What friction remembers is paid for, and what has never been met pushes nothing away."""
    for restitution, friction in ((0.95, 0.01), (0.95, 0.5), (0.95, 2.0), (0.5, 2.0)):
        assert energy_gain(grazing(shapes, restitution, friction, fidelity)) <= 1e-14


@pytest.mark.parametrize("fidelity", SPRINGS)
@pytest.mark.parametrize("shapes", [(CUBE,), (CUBE, CUBE), (CUBE, BALL)])
def test_damping_however_strong_takes_no_more_than_there_is(shapes, fidelity):
    for restitution, friction in ((0.0, 0.01), (0.0, 1.0), (0.05, 1.0), (0.1, 0.01), (0.2, 0.5)):
        assert energy_gain(grazing(shapes, restitution, friction, fidelity)) <= 1e-14


@pytest.mark.parametrize("fidelity", SPRINGS)
@pytest.mark.parametrize(
    "shape", [Box((0.0025, 0.0025, 0.02)), Box((0.02, 0.02, 0.002)), Box((0.005, 0.005, 0.02))]
)
def test_what_is_thin_gains_no_energy_where_it_lands(shape, fidelity):
    """But for the 5e-5 by which a free rod's sways."""
    for restitution, friction in ((0.0, 0.01), (0.0, 0.5), (0.0, 2.0), (0.03, 0.5), (0.1, 0.01)):
        count = 500 if fidelity == "accurate" else 2000
        assert energy_gain(grazing((shape,), restitution, friction, fidelity, count)) < 1e-4


@pytest.mark.parametrize("fidelity", SPRINGS)
@pytest.mark.parametrize("rod", [Box((0.0025, 0.0025, 0.02)), Box((0.005, 0.005, 0.02))])
def test_a_small_ball_gains_no_energy_from_a_rod(rod, fidelity):
    """At 1 m/s its centre passes through the rod's core, and its normal leaps from face to face."""
    most = 1e-3 if fidelity == "fast" else 1e-4  # a step at fast is 2.9 mm of its way
    for friction in (0.01, 0.5):
        count = 500 if fidelity == "accurate" else 2000
        world = grazing((Sphere(0.005), rod), 0.95, friction, fidelity, count)
        assert energy_gain(world) < most


@pytest.mark.parametrize("fidelity", SPRINGS)
@pytest.mark.parametrize("restitution", [0.3, 0.95])
def test_a_small_fast_ball_rebounds_from_a_face_as_a_large_slow_one(restitution, fidelity):
    """On a flat face no normal leaps, however deep the ball sinks."""
    rebounds = []
    for radius, speed in ((0.005, 1.0), (0.05, 0.1)):
        material = Material(restitution=restitution)
        ball = Body(Sphere(radius), mass=0.1, position=(0, 0, radius + 0.052), material=material)
        block = Static(Box((0.2, 0.2, 0.05)), material=material)
        ground = Ground(height=-9.0)  # for a kernel that other scenes have, too
        scene = Scene([ball], [block, ground], gravity=(0, 0, 0))
        world = World(scene, fidelity)
        world.set_state(linear_velocity=(0, 0, -speed))
        world.advance(0.2)
        rebounds.append(world.linear_velocity[0, 0, 2] / speed)
    assert rebounds[0] == pytest.approx(rebounds[1], abs=0.01)
    assert rebounds[0] == pytest.approx(restitution, abs=0.01)


@pytest.mark.parametrize("fidelity", SPRINGS)
def test_a_plate_that_lands_flat_rebounds_with_what_its_softness_leaves(fidelity):
    plate, phases = Box((0.02, 0.02, 0.004)), 20
    material = Material(restitution=0.0)
    body = Body(plate, mass=0.05, position=(0, 0, 0.009), material=material)
    world = World(Scene([body], [Ground(material)], gravity=(0, 0, 0)), fidelity, count=phases)
    position = world.position.copy()
    position[:, 0, 2] += world.fidelity.substep * np.arange(phases) / phases
    world.set_state(position=position, linear_velocity=(0, 0, -1.0))
    world.advance(0.3)
    softer = 1.0 - 0.4775  # than a cube of its mass
    least = 0.24 * world.fidelity.contact_resolution * softer
    np.testing.assert_allclose(world.linear_velocity[:, 0, 2], least, atol=1e-3)


@pytest.mark.parametrize(("fidelity", "error"), [("fast", 0.03), ("balanced", 0.02),
                                                 ("accurate", 0.005)])  # fmt: skip
@pytest.mark.parametrize("arm", [(0.0, 0.0), (0.009, 0.009), (0.014, 0.014)])
def test_a_ball_that_meets_a_cube_far_from_its_centre_keeps_the_restitution(arm, fidelity, error):
    """So slowly that the cube hardly turns while they touch. The nearer to the edge, the less mass
    stands against the ball: a third of the cube's at the outermost."""
    speed, half = 0.02, CUBE.half_extents[2]
    for restitution in (0.1, 0.25, 0.5, 0.9):
        world = grazing((CUBE, BALL), restitution, 1e-9, fidelity, 100)
        start = half + BALL.radius + speed * world.fidelity.substep * np.linspace(1, 2, 100)
        cube, ball = np.zeros((2, 100, 3))
        ball[:] = (*arm, 0.0)
        ball[:, 2] = start
        world.set_state(
            position=np.stack([cube, ball], axis=1), linear_velocity=[(0, 0, 0), (0, 0, -speed)],
            angular_velocity=(0, 0, 0), orientation=(0, 0, 0, 1),
        )  # fmt: skip
        world.advance(0.07)
        m, M = 0.2, 0.1  # kg, of ball and cube in `grazing`
        turning = (arm[0] ** 2 + arm[1] ** 2) / CUBE.inertia(M)[0]
        impulse = (1.0 + restitution) * speed / (1.0 / m + 1.0 / M + turning)
        change = world.linear_velocity[:, 1, 2] + speed
        np.testing.assert_allclose(change, impulse / m, rtol=error)


@pytest.mark.parametrize("fidelity", SPRINGS)
@pytest.mark.parametrize("arm", [(0.0, 0.0), (0.012, 0.012), (0.018, 0.018)])
def test_a_ball_that_presses_a_cube_far_from_its_centre_presses_steadily(arm, fidelity):
    """A tool that gains speed evenly; the cube turns away from it, so slowly that it hardly shows.

    The load of a contact is told from the mass that yields there, or it jumps to and fro.
    """
    smooth = Material(friction=0.0, restitution=0.5)
    cube = Body(CUBE, mass=0.1, material=smooth)
    tool = Drive(Sphere(0.02), 5.0, 500.0, (*arm, 0.04), frequency=60.0, material=smooth)
    world = World(
        Scene([cube], [Ground(smooth, -10.0)], drives=[tool], gravity=(0, 0, 0)), fidelity
    )
    step, pressed = world.fidelity.substep, []
    for k in range(int(0.08 / step)):
        height = 0.04 - 1.0 * ((k + 1) * step) ** 2
        world.move_drives((*arm, height), step)
        world.advance(step)
        pressed.append(world.normal_force(0, 1)[0])
    late = np.array(pressed[len(pressed) // 2 :])
    assert np.abs(np.diff(late)).max() < 0.2 * late.mean()


# --- shapes at rest -----------------------------------------------------------------------------


def test_a_capsule_lies_still():
    world = settled(scenes.capsule_on_ground())
    start = world.position.copy()
    world.advance(5.0)
    assert np.abs(world.position - start).max() < 1e-9
    assert np.abs(world.kinetic_energy()).max() < 1e-15
    assert 0.0 < world.penetration()[0] < 1e-3


def test_a_box_comes_down_on_one_of_its_faces():
    rng = np.random.default_rng(1)
    half = np.array([0.02, 0.03, 0.05])
    world = World(scenes.block_on_ground(tuple(half), restitution=0.2), count=50)
    world.set_state(
        position=(0.0, 0.0, 0.2),
        orientation=rng.normal(size=(50, 1, 4)),
        angular_velocity=rng.uniform(-10, 10, (50, 1, 3)),
    )
    world.advance(10.0)
    assert world.kinetic_energy().max() < 1e-10
    off = np.abs(world.position[:, 0, 2, None] - half).min(axis=-1)
    assert off.max() < 5e-4


# --- two bodies ---------------------------------------------------------------------------------


def test_a_collision_in_free_space_conserves_momentum_to_round_off():
    rng = np.random.default_rng(2)
    world = World(scenes.two_cubes(), count=50)
    velocity = rng.uniform(-0.3, 0.3, (50, 2, 3))
    velocity[:, 0, 0], velocity[:, 1, 0] = 1.0, -1.0
    world.set_state(
        orientation=rng.normal(size=(50, 2, 4)),
        linear_velocity=velocity,
        angular_velocity=rng.uniform(-20, 20, (50, 2, 3)),
    )
    linear, angular, energy = (
        world.linear_momentum(),
        world.angular_momentum(),
        world.kinetic_energy(),
    )
    before = world.linear_velocity.copy()
    world.advance(0.2)
    hit = np.abs(world.linear_velocity - before).max(axis=(1, 2)) > 1e-3
    assert hit.sum() > 40
    assert np.abs(world.linear_momentum() - linear).max() < 1e-15
    assert np.abs(world.angular_momentum() - angular).max() < 1e-16
    assert np.all(world.kinetic_energy() <= energy * (1 + 1e-3))


def parting(speed, restitution, fidelity):
    """Restitution of two cubes that meet face to face, each at `speed` m/s."""
    scene = scenes.two_cubes(
        {"linear_velocity": (speed, 0, 0), "mass": 0.3},
        {"linear_velocity": (-speed, 0, 0)},
        Material(0.5, restitution),
    )
    world = World(scene, fidelity)
    world.advance(0.05 / speed)
    assert np.abs(world.angular_velocity).max() < 1e-9
    return (world.linear_velocity[0, 1, 0] - world.linear_velocity[0, 0, 0]) / (2.0 * speed)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(("fidelity", "tolerance"), [("balanced", 0.02), ("accurate", 2e-3)])
def test_two_cubes_that_meet_face_to_face_part_with_e_of_their_speed(
    restitution, fidelity, tolerance
):
    assert parting(0.1, restitution, fidelity) == pytest.approx(restitution, abs=tolerance)


@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
def test_two_cubes_part_after_a_fast_impact_too(speed):
    assert parting(speed, 1.0, "accurate") == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("cubes", "fidelity"),
    [(2, "fast"), (3, "fast"), (5, "balanced"), (10, Fidelity(substep=0.5e-3))],
)
def test_a_tower_stands_for_a_minute(cubes, fidelity, stress):
    """Four towers side by side, with different offsets."""
    towers = [scenes.tower(cubes, seed=seed) for seed in range(4)]
    world = World(towers[0], fidelity, count=4)
    world.set_state(position=[[body.position for body in tower.bodies] for tower in towers])
    world.advance(1.0)
    start = world.position.copy()
    world.advance(60.0 if cubes < 10 or stress else 10.0)
    assert np.abs(world.position - start).max() < 1e-3
    # and stand upright, no deeper in themselves than they are stiff; five nearly buckle and lean
    assert np.abs(start[..., :2]).max() < (3e-3 if cubes == 5 else 1e-3)
    assert start[:, -1, 2].min() > 0.04 * cubes - 0.02 - 0.006


@pytest.mark.parametrize("yaw", [0.0, 45.0])
def test_a_cube_stands_on_another(yaw):
    half = math.radians(yaw) / 2
    scene = scenes.two_cubes(
        {"position": (0, 0, 0.02)},
        {"position": (0, 0, 0.06), "orientation": (0, 0, math.sin(half), math.cos(half))},
        Material(0.5, 0.0),
        ground=0.0,
        gravity=GRAVITY,
    )
    world = settled(scene)
    start = world.position.copy()
    world.advance(10.0)
    assert np.abs(world.position - start).max() < 1e-6
    assert world.position[0, 1, 2] > 0.058


# --- particle geometry --------------------------------------------------------------------------

PARTICLES = Fidelity(geometry="particle")


def test_cubes_of_particles_collide_and_conserve_momentum():
    rng = np.random.default_rng(3)
    world = World(scenes.two_cubes(), PARTICLES, count=20)
    velocity = np.zeros((20, 2, 3))
    velocity[:, 0, 0], velocity[:, 1, 0] = 1.0, -1.0
    world.set_state(orientation=rng.normal(size=(20, 2, 4)), linear_velocity=velocity)
    linear, angular = world.linear_momentum(), world.angular_momentum()
    energy = world.kinetic_energy()
    world.advance(0.2)
    assert np.all(np.abs(world.linear_velocity - velocity).max(axis=(1, 2)) > 0.1)
    assert np.abs(world.linear_momentum() - linear).max() < 1e-15
    assert np.abs(world.angular_momentum() - angular).max() < 1e-16
    assert np.all(world.kinetic_energy() <= energy * (1 + 1e-3))


def test_more_particle_pairs_than_there_is_room_for_are_named_and_harm_no_other_world():
    cubes = [Body(CUBE, mass=0.1, position=(x, 0, 0.1)) for x in (0.0, 0.1)]
    fidelity = Fidelity(geometry="particle", spacing=0.25, skin=1.0)
    world = World(Scene(cubes, [Ground()]), fidelity, count=3)
    alone = World(Scene(cubes, [Ground()]), fidelity)
    world.set_state(position=[(0, 0, 0.1), (0.01, 0, 0.1)], worlds=np.array([False, True, False]))
    with pytest.raises(
        ContactOverflow, match=r"worlds \[1\]: .* eight pairs of particles per particle"
    ):
        world.advance(0.04)
    alone.advance(0.04)
    np.testing.assert_array_equal(world.position[[0, 2]], np.repeat(alone.position, 2, axis=0))
    world.reset(np.array([False, True, False]))
    world.advance(0.04)
    np.testing.assert_array_equal(world.position[1], alone.position[0])


def test_an_overflow_is_reported_although_another_world_diverges():
    cubes = [Body(CUBE, mass=0.1, position=(x, 0, 0.1)) for x in (0.0, 0.1)]
    fidelity = Fidelity(geometry="particle", spacing=0.25, skin=1.0)
    world = World(Scene(cubes, [Ground()]), fidelity, count=3)
    world.set_state(position=[(0, 0, 0.1), (0.01, 0, 0.1)], worlds=np.array([False, True, False]))
    world.set_state(linear_velocity=1e60, worlds=np.array([False, False, True]))
    with pytest.raises(SimulationDiverged, match="world 2") as caught:
        world.advance(0.04)
    (note,) = pickle.loads(pickle.dumps(caught.value)).__notes__
    assert note.startswith("ContactOverflow as well: worlds [1]: two bodies have more than eight")


def test_cubes_of_particles_rest_on_the_ground():
    scene = scenes.two_cubes(material=Material(0.5, 0.0), ground=0.0, gravity=GRAVITY)
    world = settled(scene, PARTICLES)
    start = world.position.copy()
    world.advance(5.0)
    assert np.abs(world.position - start).max() < 1e-9
    stiffness = 0.1 * (PARTICLES.contact_resolution / PARTICLES.substep) ** 2
    np.testing.assert_allclose(0.02 - world.position[0, :, 2], 0.1 * GRAVITY / stiffness, rtol=1e-6)


# --- drives -------------------------------------------------------------------------------------


def test_a_drive_goes_where_it_is_told():
    world = World(scenes.push_like())
    world.command_drives((0.0, 0.2, 0.1))
    world.advance(0.5)
    np.testing.assert_allclose(world.drive_velocity[0, 0], (0.0, 0.2, 0.1), atol=1e-6)
    np.testing.assert_allclose(world.drive_position[0, 0], (-0.05, 0.1, 0.07), atol=1e-5)


def test_a_drive_pushes_a_cube_along():
    world = settled(scenes.push_like())
    world.command_drives((0.1, 0.0, 0.0))
    world.advance(2.0)
    assert world.linear_velocity[0, 0, 0] == pytest.approx(0.1, rel=0.01)
    gap = world.position[0, 0, 0] - world.drive_position[0, 0, 0]
    assert gap == pytest.approx(0.02 + 0.015, abs=1e-3)
    assert world.position[0, 0, 0] > 0.1


def test_a_drive_that_is_too_weak_stops_at_a_heavy_block():
    # friction holds 0.5 * 5 kg * g = 24.5 N, the servo gives 20 N
    world = settled(scenes.push_like(cube_mass=5.0))
    start = world.position.copy()
    world.command_drives((0.3, 0.0, 0.0))
    world.advance(3.0)
    assert np.abs(world.position - start).max() < 2e-3
    assert np.abs(world.drive_velocity).max() < 1e-6
    pair, *_, force, _ = world.contacts()
    pressed = np.abs(force[np.any(pair == 1, axis=-1)].sum(axis=0))
    np.testing.assert_allclose(pressed, (20.0, 0.0, 0.0), atol=0.2)


def pressed_cube(force_limit):
    """A cube on the ground under a drive that has pressed on it for 3 s."""
    world = settled(scenes.push_like(force_limit=force_limit))
    world.set_state(drive_position=(0.0, 0.0, 0.06))
    world.command_drives((0.0, 0.0, -0.5))
    world.advance(3.0)
    return world


@pytest.mark.parametrize("force_limit", [1.0, 20.0])
def test_a_drive_pushes_no_matter_through_the_ground(force_limit):
    world = pressed_cube(force_limit)
    omega = world.fidelity.contact_resolution / world.fidelity.substep
    sink = closed_forms.resting_penetration(force_limit + 0.1 * GRAVITY, 0.1 * omega**2)
    assert 0.02 - world.position[0, 0, 2] == pytest.approx(sink, rel=0.3)
    assert world.drive_position[0, 0, 2] > 0.045


def test_a_pressed_cube_lies_still():
    world = pressed_cube(20.0)
    heights = []
    for _ in range(20):
        world.advance(world.fidelity.substep)
        heights.append(world.position[0, 0, 2])
    assert np.ptp(heights) < 1e-9


ASKEW = (0.0, math.sin(0.15), 0.0, math.cos(0.15))


@pytest.mark.parametrize(
    ("tool", "shape"),
    [
        (Sphere(0.02), Sphere(0.02)),
        (Box((0.01, 0.03, 0.03)), Box((0.02, 0.02, 0.02))),
        (Capsule(0.01, 0.02), Box((0.02, 0.02, 0.02))),
        (Box((0.01, 0.03, 0.03)), Sphere(0.02)),
    ],
)
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0, 1.0), ASKEW])
def test_a_tool_of_any_shape_pushes_a_body_along(tool, shape, turn):
    """In free space, along x: both end with the speed of the tool, and nothing overlaps deeply."""
    body = Body(shape, mass=0.1, position=(0.06, 0.0, 0.0), material=Material(0.5, 0.0))
    drive = Drive(tool, 0.1, 20.0, (0.0, 0.0, 0.0), turn, material=Material(0.5, 0.0))
    world = World(Scene([body], drives=[drive], gravity=(0.0, 0.0, 0.0)))
    world.command_drives((0.2, 0.0, 0.0))
    for _ in range(25):
        world.advance(0.04)
        assert world.penetration()[0] < 2e-3
    assert world.position[0, 0, 0] > world.drive_position[0, 0, 0] + 0.02
    assert world.linear_velocity[0, 0, 0] > 0.1


def test_a_drive_itself_stops_at_the_ground():
    world = World(scenes.push_like())
    world.command_drives((0.0, 0.0, -0.5))
    world.advance(3.0)
    assert world.drive_position[0, 0, 2] > 0.01
    assert np.abs(world.drive_velocity).max() < 1e-6


# --- many kinds of surface ----------------------------------------------------------------------


def test_everything_comes_to_rest_on_every_kind_of_surface():
    soft = Material(0.8, 0.0)
    lying = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    shapes = [Sphere(0.02), Box((0.02, 0.03, 0.02)), Capsule(0.02, 0.03)]
    floors = [
        (Box((0.2, 0.2, 0.1)), (0, 0, 0, 1), 0.1),
        (Sphere(0.5), (0, 0, 0, 1), 0.5),
        (Capsule(0.3, 0.3), lying, 0.3),
    ]
    bodies, statics = [], []
    for i, (floor, turn, top) in enumerate(floors):
        statics.append(Static(floor, (2.0 * i, 0.0, -top), turn, soft))
        for j, shape in enumerate(shapes):
            height = 0.03 if isinstance(shape, Sphere) else 0.06
            # on a dome a ball would roll down; one on its top is held by symmetry alone
            x = 0.1 * (j - 1) if i == 0 else 2.0 * i
            if i == 0 or j == i:
                bodies.append(Body(shape, mass=0.1, position=(x, 0.0, height), material=soft))
    scene = Scene(bodies, [*statics, Ground(soft, -0.1)])
    world, two = World(scene), World(scene, count=2)
    for w in (world, two):
        w.advance(5.0)
    # statics carry samples too, and their share of a force belongs to no mover
    np.testing.assert_array_equal(two.position, np.repeat(world.position, 2, axis=0))
    assert np.all(np.isfinite(world.position))
    assert np.abs(world.linear_velocity).max() < 1e-3
    assert 0.0 < world.penetration()[0] < 1e-3
