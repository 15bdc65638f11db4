"""A world's contract: time, reading, writing, saving, independence, and how it fails."""

import dataclasses
import hashlib
import math
import pickle
import re

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Drive,
    Fidelity,
    Ground,
    Material,
    Scene,
    SimulationDiverged,
    Sphere,
    World,
)
from physics.compiler.jit import LANES
from physics.model.contact_memory import contact_memory
from physics.model.features import GENERAL, ISOTROPIC, NO_ROTATION
from physics.motion.drive_commands import worlds_last
from physics.reference import scenes
from physics.reference.scenes import BALL, CUBE, GRAVITY, settled


def thrown(count, threads=None, order=slice(None)):
    """Cubes that fall, tumble and are pushed, each world from its own start."""
    world = World(scenes.push_like(), count=count, threads=threads)
    rng = np.random.default_rng(0)
    starts = {
        "position": rng.uniform([-0.01, -0.01, 0.03], [0.01, 0.01, 0.06], (300, 1, 3)),
        "orientation": rng.normal(size=(300, 1, 4)),
        "linear_velocity": rng.uniform(-0.5, 0.5, (300, 1, 3)),
        "angular_velocity": rng.uniform(-10, 10, (300, 1, 3)),
    }
    world.set_state(**{name: values[order][:count] for name, values in starts.items()})
    world.command_drives((0.3, 0.0, 0.0))
    return world


def digests(world):
    """A hash of all bytes of each world's state, hidden ones included."""
    state = world._simulation.state

    def parts(w):
        group, lane = divmod(w, LANES)
        yield from (state.dynamic[w], state.half_pair[w], state.touch[..., w], state.world[w])
        yield state.sample_id[group, :, lane]
        for name in state.candidate.dtype.names:
            yield state.candidate[name][group, ..., lane]

    return [
        hashlib.sha256(b"".join(part.tobytes() for part in parts(w))).hexdigest()
        for w in range(world.count)
    ]


# --- time ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("span", [0.04, 0.0123, 1e-5, 2e-3, 1.0])
def test_advance_leaves_no_remainder(span):
    world = World(scenes.sphere_on_ground(position=(0, 0, 200.0)))
    for n in range(1, 6):
        world.advance(span)
        assert world.time[0] == pytest.approx(n * span, rel=1e-14)
    fallen = 0.5 * GRAVITY * (5 * span) ** 2
    assert 200.0 - world.position[0, 0, 2] == pytest.approx(fallen, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("span", [0.0, -1.0, math.nan, math.inf])
def test_time_moves_forward_by_a_finite_span(span):
    with pytest.raises(ValueError, match=r"time must be finite and above 0, got"):
        World(scenes.sphere_on_ground()).advance(span)


def test_time_is_a_number():
    with pytest.raises(TypeError, match="time must be a number, got '1'"):
        World(scenes.sphere_on_ground()).advance("1")


# --- construction -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"count": 0}, ValueError, "count must be at least 1, got 0"),
        ({"count": 1.0}, TypeError, "count must be an integer, got 1.0"),
        ({"count": True}, TypeError, "count must be an integer"),
        ({"threads": 0}, ValueError, "threads must be at least 1, got 0"),
        ({"threads": "2"}, TypeError, "threads must be an integer"),
        ({"fidelity": "fine"}, ValueError, "fidelity must be one of"),
        ({"fidelity": 3}, TypeError, "fidelity must be one of"),
        ({"scene": "push"}, TypeError, "scene must be Scene, got 'push'"),
        ({"worlds": 3}, TypeError, "worlds"),
    ],
)
def test_bad_arguments_are_named(arguments, error, message):
    with pytest.raises(error, match=message):
        World(**{"scene": scenes.sphere_on_ground(), **arguments})


def test_a_stiffness_that_the_step_cannot_carry_is_refused_with_the_largest_safe_step():
    scene = scenes.sphere_on_ground(stiffness=1e7)
    with pytest.raises(
        ValueError, match=r"1e\+07.*body 0 limits it.*largest safe step is (\S+) s"
    ) as e:
        World(scene)
    safe = float(str(e.value).split("largest safe step is ")[1].split()[0])
    World(scene, Fidelity(substep=0.99 * safe))
    with pytest.raises(ValueError, match="largest safe step"):
        World(scene, Fidelity(substep=1.01 * safe))
    World(scene, allow_unstable=True)


def test_without_a_stiffness_no_step_is_too_long():
    for step in (1e-5, 1e-3, 4e-3):
        fidelity = Fidelity(substep=step, contact_resolution=0.7)
        world = settled(scenes.block_on_ground(), fidelity, time=1000 * step)
        assert world.largest_stable_step() > step
        height = world.position[0, 0, 2]
        world.advance(step)
        assert world.position[0, 0, 2] == pytest.approx(height, abs=1e-12)


def test_a_servo_that_the_step_cannot_carry_is_refused():
    # body and ground, far away, for a kernel that other scenes have, too
    body, ground = Body(CUBE, position=(0, 0, 9.0)), Ground(height=-9.0)
    scene = Scene([body], [ground], [Drive(BALL, 0.1, 5.0, frequency=900.0)])
    with pytest.raises(
        ValueError, match=r"Drive\.frequency 900 .* drive 0 .*safe step is (\S+) s"
    ) as e:
        World(scene)
    safe = float(str(e.value).split("largest safe step is ")[1].split()[0].rstrip(";"))
    World(scene, Fidelity(substep=0.99 * safe))
    for ratio, lasts in ((0.95, True), (1.05, False)):
        fidelity = Fidelity(substep=ratio * safe)
        world = World(scene, fidelity, allow_unstable=True)
        world.set_state(drive_velocity=(1e-9, 0.0, 0.0))
        for _ in range(200):
            world.advance(fidelity.substep)
        assert (np.abs(world.drive_velocity).max() < 1e-9) == lasts


def test_a_tower_that_chatters_is_beyond_its_largest_stable_step():
    """Corners alone make a box's face stiffer against rocking: too stiff for two at this step."""
    edges = Fidelity(substep=4e-3, contact_resolution=0.6)
    corners = Fidelity(substep=4e-3, contact_resolution=0.6, spacing=1.0)
    still = settled(scenes.tower(2), edges, time=5.0)
    assert still.largest_stable_step() > 4e-3
    assert still.kinetic_energy()[0] < 1e-15
    chattering = settled(scenes.tower(2), corners, time=0.5)  # within a second it walks apart
    assert chattering.kinetic_energy()[0] > 1e-9
    assert chattering.largest_stable_step() < 4e-3


# --- reading ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("time", (3,)),
        ("position", (3, 1, 3)),
        ("orientation", (3, 1, 4)),
        ("linear_velocity", (3, 1, 3)),
        ("angular_velocity", (3, 1, 3)),
        ("drive_position", (3, 1, 3)),
        ("drive_velocity", (3, 1, 3)),
    ],
)
def test_what_is_read_has_a_world_axis_and_cannot_be_written(name, shape):
    world = World(scenes.push_like(), count=3)
    value = getattr(world, name)
    assert value.shape == shape
    with pytest.raises(ValueError, match="read-only"):
        value[...] = 0.0
    with pytest.raises(AttributeError):
        setattr(world, name, value)


def test_positions_are_views_that_follow_the_state():
    world = World(scenes.sphere_on_ground(position=(0, 0, 1.0)))
    view = world.position
    world.advance(0.1)
    assert view[0, 0, 2] < 1.0


def test_energy_and_momentum_follow_their_formulas():
    fields = {"linear_velocity": (1.0, 2.0, 3.0), "angular_velocity": (4.0, 5.0, 6.0)}
    scene = scenes.two_cubes({**fields, "mass": 0.3}, {"position": (1.0, 2.0, 3.0)}, gravity=10.0)
    world = World(scene)
    inertia = 0.3 * 2.0 / 3.0 * 0.02**2
    v, w, x = (np.array(a) for a in ((1, 2, 3), (4, 5, 6), (-0.03, 0, 0.02)))
    kinetic = 0.5 * 0.3 * (v @ v) + 0.5 * inertia * (w @ w)
    assert world.kinetic_energy()[0] == pytest.approx(kinetic)
    assert world.potential_energy()[0] == pytest.approx(0.3 * 10 * 0.02 + 0.1 * 10 * 3.0)
    np.testing.assert_allclose(world.linear_momentum()[0], 0.3 * v)
    np.testing.assert_allclose(world.angular_momentum()[0], 0.3 * np.cross(x, v) + inertia * w)
    np.testing.assert_allclose(world.linear_velocity[0, 0], v)
    np.testing.assert_allclose(world.angular_velocity[0, 0], w)


def test_contacts_of_a_resting_cube_carry_its_weight():
    world = settled(scenes.push_like())
    pair, names, point, normal, depth, force, first_touch = world.contacts()
    assert len(pair) == 8  # four corners and the middles of four edges
    assert {tuple(p) for p in pair.tolist()} == {(0, 2)}  # body 0, drive 1, ground 2
    assert set(names) == {("body 0", "static 0")}
    np.testing.assert_allclose(force.sum(axis=0), (0, 0, 0.1 * GRAVITY), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(normal, np.broadcast_to((0.0, 0.0, 1.0), normal.shape))
    np.testing.assert_allclose(depth, world.penetration()[0])
    np.testing.assert_allclose(point[:, 2], -depth)
    assert np.abs(point[:, :2]).max() == pytest.approx(0.02, rel=0.05)
    assert np.all(first_touch <= 0.1)
    assert world.first_touch(0, 2)[0] == world.first_touch(2, 0)[0] == first_touch[0]
    assert np.isnan(world.first_touch(0, 1)[0])


def test_first_touch_is_when_a_falling_ball_lands():
    drop = 0.5
    world = World(scenes.sphere_on_ground(position=(0, 0, BALL.radius + drop)))
    world.advance(0.2)
    assert np.isnan(world.first_touch(0, 1)[0])
    assert world.penetration()[0] == 0.0
    world.advance(0.5)
    assert world.first_touch(0, 1)[0] == pytest.approx(math.sqrt(2 * drop / GRAVITY), abs=2e-3)


def test_solids_that_never_meet_and_worlds_that_are_not_there_are_named():
    world = World(scenes.push_like(), count=2)
    with pytest.raises(
        ValueError, match=r"second must be the name or index of a solid, 0 to 2 .*, got 7"
    ):
        world.first_touch(0, 7)
    with pytest.raises(ValueError, match="solids that can touch, got 'drive 0' and 'drive 0'"):
        world.first_touch(1, 1)
    with pytest.raises(ValueError, match="world must be below 2, got 2"):
        world.contacts(2)
    with pytest.raises(ValueError, match="world must be at least 0, got -1"):
        world.largest_stable_step(-1)


def test_looking_changes_nothing():
    world, other = thrown(3), thrown(3)
    for _ in range(5):
        world.advance(0.02)
        other.advance(0.02)
        world.contacts(1), world.penetration(), world.largest_stable_step(), world.kinetic_energy()
    assert digests(world) == digests(other)


# --- writing ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("position", (0.0, 0.1, 0.5)),
        ("orientation", (0.0, 0.0, 0.6, 0.8)),
        ("linear_velocity", (1.0, 2.0, 3.0)),
        ("angular_velocity", (1.0, 2.0, 3.0)),
        ("drive_position", (0.3, 0.2, 0.1)),
        ("drive_velocity", (0.1, 0.2, 0.3)),
        ("time", 3.5),
    ],
)
def test_any_part_can_be_set_alone_in_the_masked_worlds(field, value):
    fields = [
        "position",
        "orientation",
        "linear_velocity",
        "angular_velocity",
        "drive_position",
        "drive_velocity",
        "time",
    ]
    world = thrown(4)
    world.advance(0.05)
    before = {f: getattr(world, f).copy() for f in fields}
    mask = np.array([True, False, True, False])
    world.set_state(**{field: value}, worlds=mask)
    for f in fields:
        expected = before[f].copy()
        if f == field:
            expected[mask] = value
        np.testing.assert_allclose(getattr(world, f), expected, atol=1e-12, err_msg=f)


def test_orientations_are_normalised():
    world = World(scenes.push_like())
    world.set_state(orientation=(0.0, 0.0, 3.0, 4.0))
    np.testing.assert_allclose(world.orientation[0, 0], (0, 0, 0.6, 0.8))


def test_setting_a_state_forgets_what_is_hidden():
    """Set to the same state, a world with a past continues like one without."""
    used, fresh = settled(scenes.push_like()), World(scenes.push_like())
    state = {
        "position": (0.0, 0.0, 0.0198),
        "orientation": (0.0, 0.0, 0.1, 1.0),
        "linear_velocity": (0.3, 0.0, 0.0),
        "angular_velocity": (0.0, 0.0, 2.0),
        "drive_position": (-0.034, 0.0, 0.02),
        "drive_velocity": (0.0, 0.0, 0.0),
        "time": 0.0,
    }
    for world in (used, fresh):
        world.set_state(**state)
        world.command_drives((0.1, 0.0, 0.0))
        world.advance(0.1)
    np.testing.assert_array_equal(used.snapshot().state.dynamic, fresh.snapshot().state.dynamic)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("position", (1.0, 2.0), r"position must be numbers of shape \(2, 1, 3\)"),
        ("position", np.zeros((3, 1, 3)), r"shape \(2, 1, 3\), got shape \(3, 1, 3\)"),
        ("position", (0.0, math.nan, 0.0), "position must be finite, got nan"),
        ("linear_velocity", (0.0, math.inf, 0.0), "linear_velocity must be finite, got inf"),
        ("angular_velocity", "fast", "angular_velocity must be numbers"),
        ("orientation", (0.0, 0.0, 0.0, 0.0), "quaternion of length zero"),
        ("drive_position", np.zeros((2, 2, 3)), r"drive_position must be numbers of shape"),
        ("time", math.nan, "time must be finite"),
        ("worlds", [0, 1], "worlds must be a mask of bools"),
        ("worlds", np.ones(3, bool), r"worlds must be a mask of bools of shape \(2,\)"),
    ],
)
def test_a_bad_state_is_refused_whole(field, value, message):
    world = thrown(2)
    world.advance(0.02)
    before = digests(world)
    with pytest.raises(ValueError, match=message):
        world.set_state(**{"position": 0.5, "time": 9.0, field: value})
    assert digests(world) == before


def test_an_unknown_part_of_the_state_is_refused():
    with pytest.raises(TypeError, match="speed"):
        World(scenes.push_like()).set_state(speed=1.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, (1.0, 2.0), "fast", None])
def test_a_bad_command_is_refused(value):
    world = thrown(2)
    before = digests(world)
    with pytest.raises(ValueError, match="velocity must be"):
        world.command_drives(value)
    assert digests(world) == before


def test_reset_brings_the_masked_worlds_back_to_the_start():
    world = thrown(3)
    world.advance(0.1)
    start = World(scenes.push_like())
    kept = world.position[1].copy()
    world.reset(np.array([True, False, True]))
    np.testing.assert_array_equal(world.position[[0, 2]], start.position[[0, 0]])
    np.testing.assert_array_equal(world.time, (0.0, 0.1, 0.0))
    np.testing.assert_array_equal(world.position[1], kept)
    world.reset()
    world.advance(0.1)
    start.advance(0.1)
    for w in range(3):
        np.testing.assert_array_equal(
            world.snapshot().state.dynamic[w], start.snapshot().state.dynamic[0]
        )


# --- saving -------------------------------------------------------------------------------------


def test_a_restored_world_continues_to_the_last_bit():
    world = thrown(7)
    world.advance(0.1)
    saved = world.snapshot()
    world.advance(0.1)
    first = digests(world)
    world.advance(0.3)
    world.restore(saved)
    world.advance(0.1)
    assert digests(world) == first
    other = thrown(7)
    other.restore(pickle.loads(pickle.dumps(saved)))
    other.advance(0.1)
    assert digests(other) == first


def test_a_pickled_world_continues_to_the_last_bit():
    world = thrown(3)
    world.advance(0.1)
    copy = pickle.loads(pickle.dumps(world))
    world.advance(0.1)
    copy.advance(0.1)
    assert digests(copy) == digests(world)


def test_a_snapshot_of_another_world_is_refused():
    world = thrown(2)
    with pytest.raises(ValueError, match="same scene, fidelity and count; it has another count: 3"):
        world.restore(thrown(3).snapshot())
    with pytest.raises(ValueError, match="same scene, fidelity and count; it has another scene"):
        world.restore(World(scenes.two_cubes(), count=2).snapshot())
    with pytest.raises(TypeError, match="saved must be Snapshot, got 3"):
        world.restore(3)


# --- independence -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def three_hundred():
    world = thrown(300, threads=1)
    world.advance(0.2)
    return digests(world)


def test_the_worlds_of_a_batch_differ(three_hundred):
    assert len(set(three_hundred)) == 300


@pytest.mark.parametrize("count", [1, 7])
def test_a_world_is_the_same_to_the_last_bit_whatever_runs_beside_it(count, three_hundred):
    world = thrown(count, threads=1)
    world.advance(0.2)
    assert digests(world) == three_hundred[:count]


@pytest.mark.parametrize("threads", [2, 4])
def test_threads_change_no_bit(threads, three_hundred):
    world = thrown(300, threads=threads)
    world.advance(0.2)
    assert digests(world) == three_hundred


def test_the_place_in_a_batch_changes_no_bit(three_hundred):
    world = thrown(300, order=slice(None, None, -1))
    world.advance(0.2)
    assert digests(world) == three_hundred[::-1]


# --- features -----------------------------------------------------------------------------------


def features_of(scene, fidelity="balanced"):
    return World(scene, fidelity).features


def test_a_scene_pays_only_for_what_it_needs():
    smooth = features_of(scenes.sphere_on_ground(friction=0.0))
    assert smooth.rotation == NO_ROTATION
    assert not smooth.friction
    rough = features_of(scenes.sphere_on_ground())
    assert rough.rotation == ISOTROPIC
    assert rough.friction
    assert contact_memory(smooth).size < contact_memory(rough).size
    for features in (smooth, rough):
        assert features.plane
        assert not any(
            (
                features.sphere,
                features.box,
                features.capsule,
                features.particles,
                features.drives,
                features.dashpot,
            )
        )
    assert features_of(scenes.capsule_on_ground()).rotation == GENERAL
    assert features_of(scenes.block_on_ground((0.01, 0.02, 0.03))).rotation == GENERAL
    assert not any(features_of(Scene([Body(BALL)])))
    push = features_of(scenes.push_like())
    assert (push.drives, push.box, push.sphere) == (True, True, False)
    assert features_of(scenes.two_cubes(), Fidelity(geometry="particle")).particles
    assert features_of(scenes.block_on_ground(), Fidelity(damping="dashpot")).dashpot
    for name in ("rolling_resistance", "spinning_resistance"):
        resisted = Body(BALL, material=Material(**{name: 1e-3}))
        assert features_of(Scene([resisted], [Ground()])).resistance
    assert not rough.resistance


def test_materials_and_sizes_compile_nothing_new():
    first = features_of(scenes.block_on_ground())
    for scene in (
        scenes.block_on_ground((0.1, 0.1, 0.1), friction=0.9, restitution=0.7),
        scenes.sphere_on_ground(radius=0.3),
        dataclasses.replace(scenes.block_on_ground(), gravity=(0.0, 0.0, 3.0)),
    ):
        assert features_of(scene) == first


def test_a_feature_that_is_not_needed_changes_no_bit():
    plain = scenes.block_on_ground(position=(0, 0, 0.05), angular_velocity=(5.0, 3.0, 1.0))
    far = dataclasses.replace(
        plain,
        drives=[Drive(Sphere(0.015), 0.3, 20.0, (50.0, 0.0, 1.0))],
    )
    worlds = [World(plain), World(far)]
    assert worlds[0].features != worlds[1].features
    for world in worlds:
        world.advance(1.0)
    for name in ("position", "orientation", "momentum", "angular_momentum", "force", "torque"):
        first, second = (w.snapshot().state.dynamic[name][0, 0] for w in worlds)
        np.testing.assert_array_equal(first, second, err_msg=name)


def test_a_distant_body_of_another_kind_changes_no_bit():
    cube = {"position": (0, 0, 0.05), "angular_velocity": (5.0, 3.0, 1.0)}
    plain = scenes.two_cubes(cube, {"position": (9.0, 0, 0.02)}, ground=0.0, gravity=GRAVITY)
    bodies = [plain.bodies[0], Body(Box((0.1, 0.2, 0.3)), position=(90.0, 0, 0.3))]
    worlds = [World(plain), World(dataclasses.replace(plain, bodies=bodies[:1]))]
    for world in worlds:
        world.advance(1.0)
    first, second = (w.snapshot().state.dynamic[0, 0] for w in worlds)
    for name in ("position", "orientation", "momentum", "angular_momentum"):
        np.testing.assert_array_equal(first[name], second[name], err_msg=name)


# --- limits -------------------------------------------------------------------------------------


def test_the_largest_stable_step_is_where_a_ball_on_the_ground_runs_away():
    stiffness, mass = 1e4, 0.1
    scene = scenes.sphere_on_ground(friction=0.0, restitution=1.0, stiffness=stiffness)
    pair = stiffness / 2.0  # two materials in series
    sunk = BALL.radius - mass * GRAVITY / pair
    world = World(scene, Fidelity(substep=1e-4))
    world.set_state(position=(0.0, 0.0, sunk))
    predicted = world.largest_stable_step()
    assert predicted == pytest.approx(2.0 / math.sqrt(pair / mass), rel=1e-6)

    def growth(step):
        world = World(scene, Fidelity(substep=step), allow_unstable=True)
        world.set_state(position=(0.0, 0.0, sunk + 1e-9))
        heights = []
        for _ in range(12):
            world.advance(step)
            heights.append(world.position[0, 0, 2] - sunk)
        return np.abs(heights).max() / 1e-9

    assert growth(0.9 * predicted) < 3.0
    assert growth(1.1 * predicted) > 1e3


def test_without_a_contact_no_step_is_too_long():
    world = World(scenes.sphere_on_ground(position=(0, 0, 1.0)))
    assert world.largest_stable_step() == math.inf


# --- advancing some ------------------------------------------------------------------------------


def test_worlds_outside_the_mask_stay_as_they_are():
    world = thrown(11)
    world.advance(0.3)
    before = digests(world)
    time = world.time.copy()
    rows = world.read().rows
    mask = np.zeros(11, dtype=bool)
    mask[[0, 3, 9]] = True
    world.advance(0.1, mask)
    after = digests(world)
    assert [a == b for a, b in zip(before, after, strict=True)] == (~mask).tolist()
    np.testing.assert_array_equal(world.time, np.where(mask, time + 0.1, time))
    np.testing.assert_array_equal(world.read().rows[~mask], rows[~mask])
    # and go on as if nothing had been
    twin = thrown(11)
    twin.advance(0.3)
    world.advance(0.1, ~mask)
    twin.advance(0.1)
    assert digests(world) == digests(twin)


def test_a_cube_that_is_paused_on_an_incline_does_not_creep():
    scene = scenes.block_on_ground(angle=0.3)
    world = settled(scene, count=2)
    start = world.position[0, 0].copy()
    for _ in range(20):
        world.advance(0.1, np.array([False, True]))
        world.advance(0.02)
    assert np.abs(world.position[0, 0] - start).max() < 1e-9


@pytest.mark.parametrize("layout", [lambda m: np.repeat(m, 2)[::2], lambda m: m[::-1][::-1]])
def test_a_mask_of_any_layout_chooses_the_same(layout):
    mask = np.arange(20) % 3 == 0
    world, twin = thrown(20), thrown(20)
    world.advance(0.02, layout(mask))
    twin.advance(0.02, mask)
    np.testing.assert_array_equal(world.time > 0.0, mask)
    assert digests(world) == digests(twin)


# --- divergence ---------------------------------------------------------------------------------


def test_a_diverging_world_is_named_and_the_others_go_on():
    world, twin = thrown(5), thrown(5)
    mask = np.arange(5) == 3
    world.advance(0.1)
    twin.advance(0.1)
    world.set_state(position=1e308, linear_velocity=1e308, worlds=mask)
    with pytest.raises(SimulationDiverged) as caught:
        world.advance(0.2)
    error = caught.value
    assert (error.world, error.body, error.worlds) == (3, 0, [3])
    assert 0.1 < error.time < 0.3
    for word in ("world 3", "body 0", f"t = {error.time:.6g} s", "cause", "too large"):
        assert word in str(error)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    twin.advance(0.2)
    others = [0, 1, 2, 4]
    for w in others:
        np.testing.assert_array_equal(
            world.snapshot().state.dynamic[w], twin.snapshot().state.dynamic[w]
        )
    # it stays reported until it is brought back, and the others stay whole
    with pytest.raises(SimulationDiverged):
        world.advance(0.02)
    twin.advance(0.02)
    world.reset(mask)
    world.advance(0.02)
    twin.advance(0.02)
    for w in others:
        np.testing.assert_array_equal(
            world.snapshot().state.dynamic[w], twin.snapshot().state.dynamic[w]
        )
    assert np.all(np.isfinite(world.position))


def test_a_world_that_diverged_starts_anew_beside_one_in_contact():
    """The impulse law works on as many slots as the neighbour fills, with NaN velocities too."""
    scene = scenes.block_on_ground(position=(0.0, 0.0, 1.0))
    world, mask = World(scene, "solid", count=2), np.array([True, False])
    world.set_state(position=(0.0, 0.0, 0.02), worlds=~mask)
    world.advance(0.1)
    world.set_state(angular_velocity=(1e200, 1e200, 0.0), worlds=mask)
    with pytest.raises(SimulationDiverged):
        world.advance(0.1)
    world.reset(mask)
    world.advance(0.1)
    assert world.position[0, 0, 2] == pytest.approx(1.0 - 0.5 * 9.81 * 0.1**2, rel=1e-3)


def test_a_step_that_is_too_long_is_named_as_the_cause():
    scene = scenes.block_on_ground(restitution=1.0, stiffness=1e9)
    world = World(scene, allow_unstable=True)

    def land_again_and_again():
        speed = 1.0
        for _ in range(100):
            world.set_state(position=(0.0, 0.0, 0.02), linear_velocity=(0.0, 0.0, -speed))
            world.advance(0.01)
            speed = world.linear_velocity[0, 0, 2]

    with pytest.raises(SimulationDiverged, match=r"substep of 0\.002 s is longer than the largest"):
        land_again_and_again()


def test_looking_at_a_state_just_set_changes_no_bit_of_what_follows():
    worlds = [World(scenes.push_like()) for _ in range(2)]
    for world in worlds:
        world.set_state(position=(0.0, 0.0, 0.0195), linear_velocity=(0.3, 0.0, -0.1))
    worlds[0].contacts(0)
    worlds[0].penetration()
    for world in worlds:
        world.advance(0.1)
    np.testing.assert_array_equal(worlds[0].position, worlds[1].position)
    np.testing.assert_array_equal(worlds[0].angular_velocity, worlds[1].angular_velocity)


# --- steps that are too long --------------------------------------------------------------------


def test_a_step_in_which_a_body_would_sink_by_half_its_width_is_refused_with_one_that_fits():
    scene = scenes.block_on_ground()
    with pytest.raises(ValueError, match=r"substep 2 s .* body 0, .* sink by 157 m") as error:
        World(scene, Fidelity(substep=2.0))
    longest = float(re.search(r"at most (\S+) s", str(error.value))[1])
    World(scene, Fidelity(substep=longest))
    with pytest.raises(ValueError, match="too long"):
        World(scene, Fidelity(substep=1.02 * longest))
    World(scene, Fidelity(substep=2.0), allow_unstable=True)


def test_a_body_that_meets_nothing_or_has_its_own_stiffness_may_have_any_step():
    World(Scene([Body(Sphere(0.02), mass=0.1)]), Fidelity(substep=1.0))
    World(scenes.block_on_ground(stiffness=10.0), Fidelity(substep=0.01))


def test_a_command_that_is_broadcast_has_the_type_of_any_other():
    """Or each kind of array would have a kernel of its own."""
    one = np.broadcast_to(np.zeros(3), (1, 1, 3))
    assert not one.flags.writeable
    assert worlds_last(one).flags.writeable
    assert worlds_last(np.zeros((4, 2, 3))).flags.c_contiguous


def test_memory_belongs_to_the_state():
    world = World(Scene([Body(Sphere(0.1), mass=1.0)]), count=3)
    kept = world.memory("mine", 2)
    assert kept.shape == (3, 2)
    assert not kept.any()
    kept[:] = [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]
    saved = world.snapshot()
    world.memory("later", 1)[:] = 7.0
    world.reset(np.array([False, True, False]))
    assert kept.tolist() == [[1.0, 2.0], [0.0, 0.0], [5.0, 6.0]]
    world.restore(saved)
    assert kept.tolist() == [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]
    assert not world.memory("later", 1).any()
    other = World(Scene([Body(Sphere(0.1), mass=1.0)]), count=3)
    other.restore(saved)
    assert other.memory("mine", 2).tolist() == kept.tolist()
    with pytest.raises(ValueError, match="size of memory 'mine' must be 2, got 3"):
        world.memory("mine", 3)


def test_drives_follow_a_command_from_the_next_instant_on():
    """With forces computed again, a motion follows from start and command, not from the past."""
    drive = Drive(Box((0.01,) * 3), mass=1.0, force_limit=1e6, frequency=50.0, damping_ratio=1.0)

    def start(far, time):
        """A drive that moves after a command, of which its velocity is a multiple."""
        world = World(Scene(bodies=[], drives=[drive]), count=1)
        world.move_drives([far, 0.0, 0.0], time)
        world.advance(0.04)
        return world

    jump, glide = start(0.01, 0.0), start(0.01, 0.05)
    slower = jump.drive_velocity[0, 0, 0] / glide.drive_velocity[0, 0, 0]
    for renew in (False, True):
        moved = []
        for world in (start(0.01, 0.0), start(0.01 * slower, 0.05)):
            position = world.drive_position.copy()
            world.move_drives(position, 0.0, renew_forces=renew)
            world.advance(0.04)
            moved.append((world.drive_position - position)[0, 0, 0])
        assert (abs(moved[1] / moved[0] - 1.0) < 1e-9) == renew
    with pytest.raises(TypeError, match="renew_forces"):
        world.move_drives([0.0, 0.0, 0.0], 0.0, renew_forces=1)
