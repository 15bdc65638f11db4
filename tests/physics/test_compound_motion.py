"""Compounds move as rigid bodies do, and as one box where they are one."""

import math
from dataclasses import replace

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Compound,
    Ground,
    Material,
    Scene,
    Sphere,
    Static,
    World,
)

LAWS = ["balanced", "solid"]
T = Compound([(Box((0.04, 0.01, 0.015)), (0, 0, 0)), (Box((0.01, 0.02, 0.015)), (0, -0.03, 0))])
HALVES = Compound([(Box((0.01, 0.02, 0.02)), (x, 0, 0)) for x in (-0.01, 0.01)])
BLOCK = Box((0.03, 0.02, 0.01))  # with moments of inertia that differ
FAR = (10.0, 10.0, 10.0)
MASS, BALL = 0.1, 0.05


def scene(shape, body=None, ball=None, gravity=(0.0, 0.0, -9.81), friction=0.5, restitution=0.1):
    """A body and a ball on the ground; out of reach a block if no ball is given."""
    rough = Material(friction=friction, restitution=restitution)
    place = {"position": (0, 0, 1.0)} if body is None else body
    other = BLOCK if ball is None else Sphere(0.015)
    given = {"position": FAR, "material": rough} | ({} if ball is None else ball)
    ground = Ground(Material(friction=0.5, restitution=restitution))
    bodies = [Body(shape, mass=MASS, material=rough, **place), Body(other, mass=BALL, **given)]
    return Scene(bodies, [ground], gravity=gravity)


# --- free flight --------------------------------------------------------------------------------


@pytest.mark.parametrize("fidelity", LAWS)
def test_a_free_t_keeps_energy_and_angular_momentum(fidelity):
    thrown = {
        "position": (0, 0, 5.0),
        "linear_velocity": (0.1, 0.2, 0.3),
        "angular_velocity": (9.0, 5.0, -7.0),
    }
    world = World(scene(T, thrown, gravity=(0, 0, 0)), fidelity)
    energy, turning = world.kinetic_energy(), world.angular_momentum()
    world.advance(5.0)
    np.testing.assert_allclose(world.kinetic_energy(), energy, rtol=1e-5)
    np.testing.assert_allclose(world.angular_momentum(), turning, atol=1e-12)
    inertia = T.inertia(MASS)
    spin = np.array(thrown["angular_velocity"])
    speed = np.array(thrown["linear_velocity"])
    expected = 0.5 * spin @ (inertia * spin) + 0.5 * MASS * speed @ speed
    assert energy[0] == pytest.approx(expected, rel=1e-12)


# --- collisions ---------------------------------------------------------------------------------

# where a ball comes from, the way it goes, and where the face is that it meets
HITS = {
    "stem's end": ((0.004, -0.1), (0.0, 1.0), (0.004, -0.04)),
    "stem's flank": ((-0.08, -0.035), (1.0, 0.0), (-0.01, -0.035)),
    "bar's back": ((0.03, 0.1), (0.0, -1.0), (0.03, 0.02)),
    "bar's end": ((-0.1, 0.011), (1.0, 0.0), (-0.04, 0.011)),
    "over the seam": ((0.004, 0.1), (0.0, -1.0), (0.004, 0.02)),
}


@pytest.mark.parametrize("fidelity", LAWS)
@pytest.mark.parametrize("e", [0.1, 0.5])
@pytest.mark.parametrize("name", HITS)
def test_a_ball_that_hits_a_part_moves_the_whole_as_a_rigid_body(fidelity, name, e):
    place, way, point = (np.array([*x, 0.0]) for x in HITS[name])
    height, speed = np.array([0.0, 0.0, 5.0]), 0.2
    smooth = Material(friction=0.0, restitution=e)
    ball = {
        "position": tuple(place + height),
        "linear_velocity": tuple(speed * way),
        "material": smooth,
    }
    world = World(
        scene(T, {"position": tuple(height)}, ball, gravity=(0, 0, 0), restitution=e), fidelity
    )
    momentum, turning = world.linear_momentum(), world.angular_momentum()
    world.advance(float(np.sqrt(np.sum((point - place) ** 2))) / speed + 0.02)
    np.testing.assert_allclose(world.linear_momentum(), momentum, atol=1e-15)
    np.testing.assert_allclose(world.angular_momentum(), turning, atol=1e-13)
    lever = np.cross(point, way)
    inverse = 1.0 / T.inertia(MASS)
    impulse = (1.0 + e) / (1.0 / MASS + 1.0 / BALL + lever @ (inverse * lever))
    close = {"rtol": 0.02, "atol": 0.02} if fidelity == "balanced" else {"rtol": 3e-3, "atol": 3e-3}
    velocity = world.linear_velocity[0] / speed
    np.testing.assert_allclose(velocity[0], impulse / MASS * way, **close)
    np.testing.assert_allclose(velocity[1], (1.0 - impulse / BALL) * way, **close)
    spin = impulse * inverse * lever
    np.testing.assert_allclose(world.angular_velocity[0, 0] / speed / 30, spin / 30, **close)


@pytest.mark.parametrize("fidelity", LAWS)
def test_rough_hits_conserve_momenta_and_gain_no_energy(fidelity):
    count = 100
    rough = Material(friction=0.5, restitution=0.9)
    world = World(
        scene(T, ball={"material": rough}, gravity=(0, 0, 0), restitution=0.9), fidelity, count
    )
    random = np.random.default_rng(0)
    way = random.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    aim = random.uniform(-1.0, 1.0, (count, 3)) * (0.03, 0.02, 0.01) + (0.0, 0.0, 5.0)
    position = np.stack([np.tile((0.0, 0.0, 5.0), (count, 1)), aim - 0.1 * way], axis=1)
    velocity = np.stack([np.zeros((count, 3)), way], axis=1)
    world.set_state(position=position, linear_velocity=velocity)
    energy, momentum, turning = (
        world.kinetic_energy(), world.linear_momentum(), world.angular_momentum(),
    )  # fmt: skip
    for _ in range(10):
        world.advance(0.03)
    assert np.isfinite(world.first_touch(0, 1)).mean() > 0.9
    np.testing.assert_allclose(world.linear_momentum(), momentum, atol=1e-14)
    np.testing.assert_allclose(world.angular_momentum(), turning, atol=1e-12)
    assert (world.kinetic_energy() / energy).max() < 1.001
    assert (world.kinetic_energy() / energy).mean() < 0.95


# --- at rest ------------------------------------------------------------------------------------


@pytest.mark.parametrize("fidelity", LAWS)
def test_a_t_rests_flat_without_creep(fidelity):
    world = World(scene(T, {"position": (0, 0, 0.015)}), fidelity)
    world.advance(1.0)
    place, turn = world.position[0, 0].copy(), world.orientation[0, 0].copy()
    np.testing.assert_allclose(place, (0, 0, 0.015), atol=5e-4)
    np.testing.assert_allclose(turn, (0, 0, 0, 1), atol=1e-3)
    world.advance(10.0)
    np.testing.assert_allclose(world.position[0, 0], place, atol=2e-6)
    np.testing.assert_allclose(world.orientation[0, 0], turn, atol=2e-5)


@pytest.mark.parametrize("fidelity", LAWS)
def test_contacts_tell_where_parts_touch_and_how_hard(fidelity):
    """A ball lies on the stem: its weight goes through the T into the ground."""
    ball = {"position": (0.0, -0.004, 0.0449)}
    world = World(scene(T, {"position": (0, 0, 0.015)}, ball), fidelity)
    world.advance(0.4)
    told = world.contacts()
    on_ball = np.any(told.pair == 1, axis=1)
    assert set(map(tuple, told.pair[on_ball])) == {(1, 0)}
    np.testing.assert_allclose(told.force[on_ball].sum(axis=0), (0, 0, BALL * 9.81), atol=1e-3)
    np.testing.assert_allclose(told.normal[on_ball], [(0, 0, 1)] * on_ball.sum(), atol=1e-2)
    np.testing.assert_allclose(told.point[on_ball], [(0, -0.004, 0.03)] * on_ball.sum(), atol=1e-3)
    np.testing.assert_allclose(
        told.force[~on_ball].sum(axis=0), (0, 0, (MASS + BALL) * 9.81), atol=1e-3
    )
    assert world.normal_force(0, 1)[0] == pytest.approx(BALL * 9.81, rel=2e-3)
    assert world.penetration()[0] < 6e-4
    if fidelity == "balanced":
        assert 4e-3 < world.largest_stable_step() < 4.5e-3
    else:
        assert world.largest_stable_step() == math.inf


def test_a_stiffness_that_a_compound_cannot_have_is_refused_by_name():
    stiff = Material(stiffness=1e9)
    with pytest.raises(ValueError, match=r"Material.stiffness 1e\+09 .* body 0 limits it"):
        World(Scene([Body(T, mass=MASS, material=stiff)], [Ground()]))


# --- as one box ---------------------------------------------------------------------------------


@pytest.mark.parametrize("fidelity", LAWS)
def test_a_compound_of_one_box_is_that_box_to_the_bit(fidelity):
    box = Box((0.02, 0.03, 0.01))
    ends = []
    for shape in (box, Compound([(box, (1.0, 2.0, 3.0))])):
        body = {"position": (0, 0, 0.06), "angular_velocity": (3.0, 1.0, 2.0)}
        world = World(scene(shape, body, {"position": (0.01, 0, 0.11)}), fidelity)
        world.advance(0.5)
        ends.append(np.concatenate([world.position.ravel(), world.orientation.ravel()]))
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize("fidelity", LAWS)
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_box_in_another_frame_is_that_box(fidelity, friction):
    quarter = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))
    ends = []
    for shape in (
        Box((0.02, 0.03, 0.01)),
        Compound([(Box((0.03, 0.02, 0.01)), (0, 0, 0), quarter)]),
    ):
        body = {"position": (0, 0, 5.0), "angular_velocity": (0.3, 0.1, 0.2)}
        ball = {
            "position": (0.005, -0.01, 5.05), "linear_velocity": (0.2, 0.1, -1.0),
            "material": Material(friction=friction, restitution=0.1),
        }  # fmt: skip
        world = World(scene(shape, body, ball, gravity=(0, 0, 0)), fidelity)
        world.advance(0.1)
        assert np.isfinite(world.first_touch(0, 1)[0])
        ends.append(np.concatenate([world.position.ravel(), world.orientation.ravel()]))
    # of springs, the damping of friction follows from how a box rocks: by its samples, or in closed
    # form
    close = 3e-5 if friction > 0.0 and fidelity == "balanced" else 1e-12
    np.testing.assert_allclose(*ends, rtol=0.0, atol=close)


@pytest.mark.parametrize("fidelity", LAWS)
def test_two_halves_sink_slide_and_bounce_as_the_whole(fidelity):
    resting = World(scene(HALVES, {"position": (0, 0, 0.02)}), fidelity)
    resting.advance(1.0)
    cube = Body(Box((0.02,) * 3), mass=MASS, position=(0, 0, 0.02), material=Material(0.5, 0.1))
    whole = World(Scene([cube], [Ground(Material(0.5, 0.1))]), fidelity)
    whole.advance(1.0)
    sink = 0.02 - whole.position[0, 0, 2]
    # its samples lie farther out, for which it rocks faster and is made that much softer
    assert sink < 0.02 - resting.position[0, 0, 2] < 1.2 * sink

    speed, gravity, friction = 0.5, 9.81, 0.5
    for way in np.eye(3)[:2]:
        start = {"position": tuple(resting.position[0, 0]), "linear_velocity": speed * way}
        world = World(scene(HALVES, start), fidelity)
        world.advance(0.3)
        stop = speed**2 / (2.0 * friction * gravity)
        assert world.position[0, 0] @ way == pytest.approx(stop, rel=0.01)

    falling = {"position": (0, 0, 0.05), "linear_velocity": (0, 0, -1.0)}
    world = World(scene(HALVES, falling, gravity=(0, 0, 0), restitution=0.5), fidelity)
    world.advance(0.1)
    assert world.linear_velocity[0, 0, 2] == pytest.approx(0.5, abs=0.01)
    assert np.abs(world.angular_velocity[0, 0]).max() < 0.5


@pytest.mark.parametrize("fidelity", LAWS)
@pytest.mark.parametrize("slider", [Box((0.02, 0.025, 0.02)), T], ids=["box", "T"])
def test_nothing_is_felt_of_a_seam_that_is_slid_over(fidelity, slider):
    """Two boxes flush side by side are one surface."""
    smooth, height = Material(friction=0.1, restitution=0.1), 0.05
    low = {"box": 0.02, "T": 0.015}["T" if slider is T else "box"]
    two = Compound([(Box((0.2, 0.2, 0.05)), (x, 0, 0)) for x in (-0.2, 0.2)])
    body = Body(
        slider, mass=MASS, position=(-0.1, 0, height + low), linear_velocity=(1.0, 0, 0),
        material=smooth,
    )  # fmt: skip
    beside = Body(Sphere(0.015), mass=BALL, position=(-0.1, 0.1, height + 0.015),
                  linear_velocity=(1.0, 0, 0), material=smooth)  # fmt: skip
    world = World(Scene([body, beside], [Static(two, material=smooth)]), fidelity)
    path = []
    for _ in range(60):
        world.advance(0.005)
        path.append(world.position[0].copy())
    stretch = np.array(path)
    # what it does beside no seam: slows by mu g, and sinks as far as it does anywhere
    ahead = 0.3 - 0.5 * 0.1 * 9.81 * 0.3**2
    assert stretch[-1, 0, 0] + 0.1 == pytest.approx(ahead, rel=0.01)
    assert np.ptp(stretch[10:, 0, 2]) < 5e-5
    assert np.ptp(stretch[10:, 1, 2]) < 5e-5
    assert np.abs(world.orientation[0, 0, :3]).max() < 5e-3


@pytest.mark.parametrize("fidelity", LAWS)
def test_halves_that_are_stacked_seam_on_seam_stand_still(fidelity):
    """Each sample on a seam is borne once: twice, and springs are so stiff that the stack leans."""
    slabs = Compound([(Box((0.02, 0.03, 0.015)), (x, 0, 0)) for x in (-0.02, 0.02)])
    rough = Material(friction=0.5, restitution=0.1)
    stack = [Body(slabs, mass=MASS, position=(0, 0, 0.015 + 0.03 * k), material=rough)
             for k in range(3)]  # fmt: skip
    world = World(Scene(stack, [Ground(rough)]), fidelity)
    world.advance(1.0)
    place = world.position.copy()
    world.advance(3.0)
    np.testing.assert_allclose(world.position, place, atol=1e-5)
    assert np.abs(world.orientation[..., :2]).max() < 1e-5


# --- worlds -------------------------------------------------------------------------------------


def test_snapshots_go_on_to_the_bit():
    body = {"position": (0, 0, 0.05), "angular_velocity": (3.0, 1.0, 2.0)}
    world = World(scene(T, body, {"position": (0.0, -0.02, 0.1)}), "balanced")
    world.advance(0.1)
    saved = world.snapshot()
    world.advance(0.2)
    end = world.position.copy()
    world.restore(saved)
    world.advance(0.2)
    np.testing.assert_array_equal(world.position, end)
    other = replace(scene(T, body, {"position": (0.0, -0.02, 0.1)}))
    assert other == saved.scene


def test_sizes_of_their_own_are_those_of_the_scaled_shape():
    body = {"position": (0, 0, 0.06), "angular_velocity": (3.0, 1.0, 2.0)}
    ball = {"position": (0.0, -0.02, 0.13)}
    world = World(scene(T, body, ball), "balanced", count=3, per_world_parameters=True)
    world.set_parameters(size=[[1.0, 1.0], [1.2, 1.0], [1.5, 1.0]])
    world.advance(0.3)
    assert np.isfinite(world.first_touch(0, 1)).all()
    for k, size in enumerate((1.0, 1.2, 1.5)):
        alone = World(scene(T.scaled(size), body, ball), "balanced", per_world_parameters=True)
        alone.advance(0.3)
        np.testing.assert_allclose(world.position[k], alone.position[0], atol=1e-6)
