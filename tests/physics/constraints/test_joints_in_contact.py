"""Joints and contacts act together, with both contact laws."""

import math

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Drive,
    Gripper,
    Ground,
    Hinge,
    Material,
    Motor,
    Scene,
    Slider,
    Sphere,
    SurfaceDrag,
    World,
)
from tests.physics.constraints.jointed import about_y, energy

CUBE = Box((0.05, 0.05, 0.05))
LAWS = pytest.mark.parametrize("fidelity", ["balanced", "solid"])


def world_of(bodies, joints, fidelity, count=1, gravity=(0.0, 0.0, -9.81)):
    """A world with ground, and out of reach what else a workshop with joints has.

    Joints and contacts have no general kernel. So all scenes here, and `workshop` of
    `manybody.test_mechanisms`, hold the same kinds of things and share a kernel per law.
    """
    ground, far = Ground(Material(0.5, restitution=0.0)), 50.0  # m
    slab = Body(Box((0.05, 0.05, 0.02)), mass=1.0, position=(far, 0, 0.02))
    drives = [
        *(Drive(Sphere(0.02), 0.2, 20.0, (far, y, 1)) for y in (1, 2)),
        Gripper(Box((0.02, 0.02, 0.02)), 0.2, 20.0, 5.0, (far, 3, 1), 0.07),
    ]
    drag = SurfaceDrag(1.2, 1.0, body=len(bodies))
    scene = Scene(
        [*bodies, slab], [ground], gravity=gravity, drives=drives, joints=joints, fields=[drag]
    )
    return World(scene, fidelity, count)


@LAWS
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_cube_on_a_hinge_rebounds_with_the_restitution_of_its_edge(fidelity, restitution):
    """The hinge is in the ground's plane, so the edge moves along the normal: w' = -e w."""
    cube = Body(
        CUBE,
        mass=1.0,
        position=(0.3, 0, 0.12),
        orientation=about_y(0.25),
        linear_velocity=(0.48, 0, -1.2),
        angular_velocity=(0, 4.0, 0),
        material=Material(0.5, restitution),
    )
    world = world_of([cube], [Hinge(0, None, (0, 0, 0), (0, 1, 0))], fidelity, gravity=(0, 0, 0))
    before = float(energy(world)[0])
    world.advance(0.12)
    assert world.joint_velocity()[0, 0] == pytest.approx(-4.0 * restitution, abs=0.02)
    assert float(energy(world)[0]) < before * (1.0 + 1e-6)
    assert world.joint_error().max() < 1e-12


@LAWS
def test_hinged_cubes_lie_on_the_ground_and_stay(fidelity):
    bodies = [Body(CUBE, mass=1.0, position=(0.12 * i, 0, 0.0502)) for i in range(3)]
    joints = [Hinge(i, i + 1, (0.06 + 0.12 * i, 0, 0.05), (0, 1, 0)) for i in range(2)]
    world = world_of(bodies, joints, fidelity)
    world.advance(1.0)
    start = world.position.copy()
    world.advance(2.0)
    np.testing.assert_allclose(world.position, start, atol=2e-5)
    normal = sum(world.normal_force(f"body {i}", "static 0") for i in range(3))
    assert normal == pytest.approx(3.0 * 9.81, rel=1e-4)
    assert world.joint_error().max() < 1e-11


@LAWS
def test_a_press_loads_the_ground_with_weights_and_motor(fidelity):
    plate = Body(CUBE, mass=2.0, position=(0, 0, 0.17))
    joint = Slider(1, None, (0, 0, 1), limits=(-0.15, 0.1), motor=Motor(60.0, -0.2))
    world = world_of([Body(CUBE, mass=1.0, position=(0, 0, 0.05)), plate], [joint], fidelity)
    world.advance(1.5)
    assert world.normal_force("body 0", "static 0") == pytest.approx(3 * 9.81 + 60.0, rel=2e-3)
    np.testing.assert_allclose(world.position[0, :2, :2], 0.0, atol=1e-4)


@LAWS
def test_a_motor_presses_an_arm_onto_the_ground(fidelity):
    """The motor accelerates it faster than gravity does: that is no impact, substep by substep."""
    arm = Body(Box((0.2, 0.03, 0.02)), mass=1.0, position=(0.2, 0, 0.0225))
    joint = Hinge(0, None, (0, 0, 0.0225), (0, 1, 0), motor=Motor(20.0, 3.0))
    world = world_of([arm], [joint], fidelity)
    world.advance(1.0)
    loads = []
    for _ in range(20):
        world.advance(0.004)
        loads.append(float(world.normal_force("body 0", "static 0")[0]))
    assert np.mean(loads) == pytest.approx(20.0 / 0.4 + 9.81 / 2, rel=0.06)  # the sink tilts it


@LAWS
def test_a_limit_supports_what_lies_on_the_limb(fidelity):
    """A flap on a hinge rests on its limit; the cube on it stays, as on a shelf."""
    flap = Body(Box((0.1, 0.1, 0.02)), mass=0.5, position=(0.12, 0, 0.5))
    cube = Body(CUBE, mass=2.0, position=(0.12, 0, 0.5701), material=Material(0.5, 0.0))
    joint = Hinge(0, None, (0, 0, 0.5), (0, 1, 0), limits=(-1.0, 0.0 + 1e-3))
    world = world_of([flap, cube], [joint], fidelity)
    world.advance(1.5)
    assert world.joint_position()[0, 0] == pytest.approx(1e-3, abs=1e-6)
    assert world.normal_force("body 0", "body 1") == pytest.approx(2 * 9.81, rel=1e-2)
    assert world.position[0, 1, 2] == pytest.approx(0.5699, abs=4e-3)  # a slim flap is soft


def test_jointed_bodies_touch_each_other_only_if_asked():
    bodies = [Body(CUBE, position=(0, 0, 1)), Body(CUBE, position=(0.09, 0, 1))]
    joint = Hinge(0, 1, (0.045, 0, 1), (0, 1, 0))
    assert not Scene(bodies, joints=[joint]).jointed_pairs - {(0, 1)}
    world = world_of(bodies, [joint], "balanced")
    with pytest.raises(ValueError, match="solids that can touch"):
        world.normal_force("body 0", "body 1")
    asked = Hinge(0, 1, (0.045, 0, 1), (0, 1, 0), collide=True)
    assert world_of(bodies, [asked], "balanced").normal_force("body 0", "body 1") > 0.0


@LAWS
def test_worlds_beside_a_world_with_joints_and_contacts_change_no_bit(fidelity):
    def scene(count):
        bodies = [Body(CUBE, mass=1.0, position=(0.12 * i, 0, 0.2)) for i in range(2)]
        joint = Hinge(0, 1, (0.06, 0, 0.2), (0, 1, 0), limits=(-1, 1), motor=Motor(0.5, 1.0))
        return world_of(bodies, [joint], fidelity, count)

    many, alone = scene(18), scene(1)
    spin = np.linspace(-3.0, 3.0, 18)[:, None, None] * np.array([0.0, 1.0, 0.0])
    many.set_state(angular_velocity=spin)
    alone.set_state(angular_velocity=spin[5])
    for _ in range(25):
        many.advance(0.04)
        alone.advance(0.04)
    np.testing.assert_array_equal(many.position[5], alone.position[0])
    np.testing.assert_array_equal(many.orientation[5], alone.orientation[0])
    assert math.isfinite(energy(many).sum())
