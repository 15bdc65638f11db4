"""A gripper is one mechanism: it holds by friction, lets go, and neither tears nor drifts."""

import numpy as np
import pytest

from physics import Body, Box, Drive, Fidelity, Gripper, Ground, Material, Scene, Sphere, World

PRESETS = ("fast", "balanced", "accurate", "solid")
PAD = 0.015
CUBE = Box((0.02,) * 3)


def scene(grip: float = 4.0, force: float = 14.0, **body) -> Scene:
    """A cube on the ground between the open fingers of a gripper."""
    material = Material(0.5, 0.1)
    hand = Gripper(
        Box((PAD,) * 3),
        mass=0.3,
        force_limit=force,
        grip_limit=grip,
        position=(0.0, 0.0, 0.02),
        distance=0.1,
        frequency=40.0,
        material=Material(2.0, 0.0),
    )
    cube = Body(**{"shape": CUBE, "mass": 0.1, "position": (0, 0, 0.02), **body}, material=material)
    return Scene([cube], [Ground(material)], [hand])


def move(world: World, middle, gap: float, time: float, frame: float = 0.04) -> None:
    """Leads the hand straight to a place [m] and its pads to a gap [m], within a time [s]."""
    frames = round(time / frame)
    start = world.drive_reference.copy()
    half = np.array([0.0, 0.5 * gap + PAD, 0.0])
    end = np.array([middle - half, middle + half])
    for i in range(frames):
        world.move_drives(start + (end - start) * ((i + 1) / frames), frame)
        world.advance(frame)


def held(fidelity, height: float = 0.15, **options) -> World:
    """A cube that has been gripped and lifted."""
    world = World(scene(**options), fidelity)
    move(world, np.array([0.0, 0.0, 0.02]), 0.0, 0.4)
    move(world, np.array([0.0, 0.0, height]), 0.0, 0.6)
    move(world, np.array([0.0, 0.0, height]), 0.0, 1.0)
    return world


def in_hand(world: World) -> np.ndarray:
    """Where the cube is, from the middle between the fingers, [3] m."""
    return world.position[0, 0] - world.drive_position[0].mean(axis=0)


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_cube_in_the_gripper_does_not_creep(fidelity):
    world = held(fidelity)
    assert world.position[0, 0, 2] > 0.13
    before = in_hand(world)
    move(world, np.array([0.0, 0.0, 0.15]), 0.0, 10.0)
    assert np.abs(in_hand(world) - before).max() < 1e-4
    assert world.kinetic_energy()[0] < 1e-9


@pytest.mark.parametrize("fidelity", PRESETS)
def test_let_go_it_falls(fidelity):
    world = held(fidelity)
    move(world, np.array([0.0, 0.0, 0.15]), 0.08, 0.2)
    move(world, np.array([0.0, 0.0, 0.15]), 0.08, 1.0)
    assert world.position[0, 0, 2] == pytest.approx(0.02, abs=1e-3)
    assert not any(world.normal_force(0, finger)[0] for finger in (1, 2))


@pytest.mark.parametrize("fidelity", PRESETS)
@pytest.mark.parametrize("grip", [20.0, 1000.0])
def test_gripped_too_hard_nothing_explodes(fidelity, grip):
    world = World(scene(grip=grip), fidelity)
    for _ in range(10):
        move(world, np.array([0.0, 0.0, 0.02]), 0.0, 0.2)
        assert world.kinetic_energy()[0] < 1.0
        assert np.abs(world.position).max() < 1.0


@pytest.mark.parametrize("fidelity", PRESETS)
def test_dragged_along_the_ground_at_full_force_nothing_explodes(fidelity):
    world = World(scene(force=100.0), fidelity)
    for i in range(10):
        move(world, np.array([0.3 * (-1) ** i, 0.1, -0.1]), 0.0, 0.2)
        assert world.drive_position[0, :, 2].min() > 0.0
        assert world.position[0, 0, 2] > 0.0
        assert world.kinetic_energy()[0] < 5.0  # the cube at 10 m/s


@pytest.mark.parametrize("fidelity", PRESETS)
def test_the_fingers_are_one_solid_across_the_grip(fidelity):
    """A block in the way of one finger stops both, and takes half as much speed as of one alone."""
    world = World(scene(shape=Sphere(0.02), position=(0.04, 0.05, 0.02)), fidelity)
    for _ in range(50):
        world.command_drives([[[0.5, 0.0, 0.0]] * 2])
        world.advance(0.01)
        np.testing.assert_array_equal(
            world.drive_position[0, 0, ::2], world.drive_position[0, 1, ::2]
        )
        np.testing.assert_array_equal(
            world.drive_velocity[0, 0, ::2], world.drive_velocity[0, 1, ::2]
        )
    assert world.position[0, 0, 0] > 0.1


@pytest.mark.parametrize("fidelity", PRESETS)
def test_a_hit_on_one_finger_moves_both_as_one_mass(fidelity):
    """m v = (m + 2 M) u in the free flight of a servo that hardly pulls."""
    smooth = Material(0.5, 0.0)  # it hits a face straight on, where friction has nothing to do
    fingers = Gripper(CUBE, 0.1, 1e-6, 1e-6, distance=0.2, frequency=0.1, material=smooth)
    ball = Body(
        Sphere(0.02),
        mass=0.1,
        position=(-0.05, -0.1, 0.0),
        linear_velocity=(1.0, 0.0, 0.0),
        material=smooth,
    )
    # ground out of reach, for the kernels of the scenes above
    world = World(Scene([ball], [Ground(height=-1.0)], [fingers], (0.0, 0.0, 0.0)), fidelity)
    world.advance(0.5)
    fingers, speed = world.drive_velocity[0, :, 0], world.linear_velocity[0, 0, 0]
    assert 0.1 * (speed + fingers.sum()) == pytest.approx(0.1, abs=1e-5)
    np.testing.assert_allclose(fingers, 1.0 / 3.0, rtol=0.12)  # springs are damped for one


def test_a_full_grip_leaves_the_carriage_its_force():
    """Both servos at their limits: the fingers close at one rate and move at the other."""
    hand = Gripper(CUBE, 0.5, 4.0, 1.0, distance=1.0, frequency=100.0)
    # a cube and ground out of reach, for the kernels of the scenes above
    bystander = Body(CUBE, mass=0.1, position=(5.0, 0.0, -0.98))
    world = World(Scene([bystander], [Ground(height=-1.0)], [hand]), Fidelity())
    world.move_drives([[[0.0, 10.0, 5.0], [0.0, 10.0, 5.0]]], 0.1)
    world.advance(0.1)
    middle = world.drive_velocity[0].mean(axis=0)
    np.testing.assert_allclose(middle, [0.0, 0.4, 0.4], atol=0.01)  # 4 N on 1 kg for 0.1 s
    closing = world.drive_velocity[0, 0, 1] - world.drive_velocity[0, 1, 1]
    assert closing == pytest.approx(2.0 * 0.1 * 1.0 / 0.5, abs=0.01)


def test_a_gripper_counts_as_two_tools_between_others():
    drive = Drive(Sphere(0.01), 0.1, 1.0)
    made = Scene([], drives=[drive, Gripper(CUBE, 0.1, 2.0, 1.0, position=(1, 2, 3)), drive])
    assert len(made.driven_bodies) == 4
    assert made.grippers[0][0] == 1
    np.testing.assert_allclose(made.driven_bodies[1].position, (1, 1.95, 3))
    np.testing.assert_allclose(made.driven_bodies[2].position, (1, 2.05, 3))
    assert made.driven_bodies[1].force_limit == 1.0
    with pytest.raises(ValueError, match="a gripper's fingers, bodies that a joint"):
        World(made).normal_force(1, 2)


def test_fingers_are_not_set_apart_along_x_or_z():
    world = World(scene())
    before = world.drive_position.copy()
    with pytest.raises(
        ValueError, match=r"drive_position must have the same x and z .*drives 0 and 1"
    ):
        world.set_state(drive_position=[[[0.0, -0.05, 0.02], [0.01, 0.05, 0.02]]])
    np.testing.assert_array_equal(world.drive_position, before)


@pytest.mark.parametrize(
    "name", ["mass", "force_limit", "grip_limit", "distance", "frequency", "damping_ratio"]
)
def test_bad_numbers_of_a_gripper_are_named(name):
    good = {"shape": CUBE, "mass": 0.1, "force_limit": 1.0, "grip_limit": 1.0}
    with pytest.raises(ValueError, match=rf"Gripper\.{name} must be .*got -1"):
        Gripper(**{**good, name: -1.0})
