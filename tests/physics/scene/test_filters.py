"""Solids touch if each has a group in the other's mask."""

import itertools

import numpy as np
import pytest

from physics import Body, Box, Drive, Gripper, Ground, Scene, Sphere, Static, World
from physics.scene.solids import EVERY_GROUP

CUBE = Box((0.02, 0.02, 0.02))


def test_a_body_falls_through_what_its_mask_leaves_out():
    bodies = [
        Body(CUBE, mass=0.1, position=(0.2 * i, 0, 0.02), group=group, mask=mask)
        for i, (group, mask) in enumerate([(1, 1), (2, 1), (1, 2), (3, 3)])
    ]
    world = World(Scene(bodies, [Ground(group=1, mask=1)]))
    world.advance(0.5)
    fell = world.position[0, :, 2] < -0.5
    np.testing.assert_array_equal(fell, [False, True, True, False])


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_bodies_pass_through_each_other(law):
    def meeting(mask):
        bodies = [
            Body(Sphere(0.02), mass=0.1, position=(x, 0, 0), linear_velocity=(-10 * x, 0, 0),
                 mask=mask)
            for x in (-0.1, 0.1)
        ]  # fmt: skip
        world = World(Scene(bodies, gravity=(0, 0, 0)), law)
        world.advance(0.2)
        return world

    assert meeting(EVERY_GROUP).position[0, 0, 0] < 0.0
    through = meeting(EVERY_GROUP - 1)
    assert through.position[0, 0, 0] == pytest.approx(0.1, rel=1e-12)
    with pytest.raises(ValueError, match="group and mask exclude each other"):
        through.normal_force(0, 1)


def test_a_filter_holds_for_drives_and_grippers_and_statics():
    body = Body(CUBE, mass=0.1, group=2)
    others = {"mask": EVERY_GROUP - 2}
    scene = Scene(
        [body],
        [Static(CUBE, (0, 0, 1), **others), Ground(**others)],
        [Drive(CUBE, 0.1, 5.0, **others), Gripper(CUBE, 0.1, 5.0, 5.0, (0, 0, 2), **others)],
    )
    world = World(scene)
    for one, other in itertools.combinations(range(6), 2):
        if one == 0:
            with pytest.raises(ValueError, match="exclude each other"):
                world.first_touch(one, other)
    assert not np.isnan(world.position).any()
    assert len(world._simulation.base.half_pair) > 0  # drives and statics still touch


@pytest.mark.parametrize(
    ("bits", "error", "message"),
    [
        ({"group": -1}, ValueError, "Body.group must be at least 0, got -1"),
        ({"mask": 2**32}, ValueError, "Body.mask must be at most 4294967295, 32 bits"),
        ({"group": 1.5}, TypeError, "Body.group must be an integer, got 1.5"),
    ],
)
def test_bad_bits_are_refused(bits, error, message):
    with pytest.raises(error, match=message):
        Body(CUBE, mass=0.1, **bits)
