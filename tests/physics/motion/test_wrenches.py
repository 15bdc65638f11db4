"""`World.apply_wrench`: exact for a constant force, for one call of advance, only where given."""

import math

import numpy as np
import pytest

from physics import Body, Box, Ground, Scene, Sphere, World

SLAB = Box((0.05, 0.03, 0.02))
MASS = 2.0


def bodies(count=1, gravity=(0.0, 0.0, 0.0)):
    scene = Scene(
        [Body(SLAB, mass=MASS, name="slab"), Body(SLAB, mass=MASS, position=(1, 0, 0))],
        gravity=gravity,
    )
    return World(scene, count=count)


def test_a_force_gives_its_impulse_exactly_and_then_ends():
    world = bodies(count=3)
    force = np.array([[1.0, 0, 0], [0, 2.0, 0], [0, 0, 0]])
    world.apply_wrench(force, body="slab")
    np.testing.assert_array_equal(world.force()[:, 0], force)
    world.advance(0.04)
    np.testing.assert_allclose(world.linear_velocity[:, 0], force * 0.04 / MASS, rtol=1e-13)
    np.testing.assert_allclose(world.position[:, 0], force * 0.04**2 / (2 * MASS), rtol=1e-12)
    np.testing.assert_array_equal(world.force(), 0.0)
    world.advance(0.04)
    np.testing.assert_allclose(world.linear_velocity[:, 0], force * 0.04 / MASS, rtol=1e-13)
    np.testing.assert_array_equal(world.linear_velocity[:, 1], 0.0)


def test_calls_add_up_and_worlds_that_wait_keep_their_force():
    world = bodies(count=2)
    for _ in range(2):
        world.apply_wrench((1.0, 0, 0), body=1)
    world.advance(0.1, worlds=np.array([True, False]))
    world.advance(0.1)
    np.testing.assert_allclose(world.linear_velocity[:, 1, 0], 2.0 * 0.1 / MASS, rtol=1e-13)


def test_a_torque_and_a_force_beside_the_centre_turn_a_body():
    world = bodies()
    world.apply_wrench(torque=(0, 0, 0.3), body=0)
    world.apply_wrench((0, 2.0, 0), body=1, point=(1.15, 0, 0))
    world.advance(0.04)
    np.testing.assert_allclose(world.angular_momentum()[0],
                               np.array([0, 0, 0.3 + 2.0 * 1.15]) * 0.04, atol=1e-12)  # fmt: skip
    spin = 0.3 * 0.04 / float(SLAB.inertia(MASS)[2])
    np.testing.assert_allclose(world.angular_velocity[0, :, 2], spin, rtol=1e-12)


@pytest.mark.parametrize("preset", ["balanced", "solid"])
def test_a_force_up_to_the_weight_unloads_a_contact(preset):
    world = World(Scene([Body(SLAB, mass=MASS, position=(0, 0, 0.02))], [Ground()]), preset)
    weight = MASS * 9.81
    world.advance(1.0)
    for push in (0.0, 0.5, -2.0):
        for _ in range(20):
            world.apply_wrench((0, 0, push * weight))
            world.advance(0.04)
        lasting = world.normal_force("body 0", "static 0")[0]
        assert lasting == pytest.approx((1.0 - push) * weight, rel=1e-3)
    assert abs(world.position[0, 0, 0]) < 1e-5


def test_contacts_keep_their_memory_and_neighbours_every_bit():
    """A pushed cube on a slope stays: static friction remembers. Others change no bit."""
    angle = math.radians(20.0)
    gravity = (9.81 * math.sin(angle), 0.0, -9.81 * math.cos(angle))
    scene = Scene([Body(SLAB, mass=MASS, position=(0, 0, 0.02))], [Ground()], gravity=gravity)
    plain, pushed = World(scene, count=20), World(scene, count=20)
    for step in range(50):
        force = np.zeros((20, 3))
        force[3, 1] = 2.0 if step % 2 else -2.0
        pushed.apply_wrench(force, body=0)
        for world in (plain, pushed):
            world.advance(0.04)
    others = np.arange(20) != 3
    np.testing.assert_array_equal(pushed.position[others], plain.position[others])
    assert np.abs(pushed.position[3] - plain.position[3]).max() < 1e-3
    assert np.any(pushed.position[3] != plain.position[3])


def test_a_reset_ends_a_force_that_waits():
    world = bodies(count=2)
    world.apply_wrench((1.0, 0, 0), body=0)
    world.reset(np.array([True, False]))
    np.testing.assert_array_equal(world.force()[:, 0, 0], [0.0, 1.0])
    world.advance(0.04)
    np.testing.assert_allclose(world.linear_velocity[:, 0, 0], [0.0, 0.04 / MASS], rtol=1e-13)


def test_a_snapshot_keeps_a_force_that_waits():
    world = bodies()
    empty = world.snapshot()
    world.apply_wrench((1.0, 0, 0), body=0)
    saved = world.snapshot()
    world.advance(0.04)
    after = world.position.copy()
    world.restore(saved)
    world.advance(0.04)
    np.testing.assert_array_equal(world.position, after)
    world.restore(empty)
    world.advance(0.04)
    np.testing.assert_array_equal(world.position, empty.state.dynamic["position"])
    other = bodies()
    other.restore(saved)
    other.advance(0.04)
    np.testing.assert_array_equal(other.position, after)


def test_bad_wrenches_change_nothing():
    world = bodies(count=2)
    for arguments, message in (
        ({"force": (1, 2)}, "force must be numbers of shape"),
        ({"force": (math.nan, 0, 0)}, "force must be finite"),
        ({"torque": np.zeros((3, 3)), "body": 0}, r"torque must be .* shape \(2, 3\)"),
        ({"body": "cube"}, "body must be the name or index of a body, got 'cube'"),
        ({"body": 2}, "there are: 'slab', 'body 1'"),
    ):
        with pytest.raises(ValueError, match=message):
            world.apply_wrench(**{"force": (1.0, 0, 0), **arguments})
    world.advance(0.04)
    assert not world.linear_velocity.any()
    assert not world.features.wrench
    ball = World(Scene([Body(Sphere(0.1))], gravity=(0, 0, 0)))
    with pytest.raises(ValueError, match="rotation is not simulated"):
        ball.apply_wrench(torque=(0, 0, 1))
