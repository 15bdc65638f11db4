"""Bad joints raise errors that name the field, the value and what would be right."""

import math

import pytest

from physics import (
    BallJoint,
    Body,
    Box,
    Distance,
    Fidelity,
    Hinge,
    Motor,
    Scene,
    Slider,
    Weld,
    World,
)
from tests.physics.constraints.jointed import ghost

CUBE = Box((0.05, 0.05, 0.05))
ORIGIN = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Motor(0.0), r"Motor.force_limit must be finite and above 0, got 0"),
        (lambda: Motor(1.0, math.nan), r"Motor.velocity must be finite"),
        (lambda: Hinge(0, None, (0, 0)), r"Hinge.anchor must be 3 numbers"),
        (lambda: Hinge(0, None, ORIGIN, ORIGIN), r"Hinge.axis must have a length above zero"),
        (lambda: Hinge(0, None, ORIGIN, limits=(0.1, 1.0)), r"Hinge.limits .* got \(0.1, 1.0\)"),
        (lambda: Hinge(0, None, ORIGIN, limits=(-4.0, 1.0)), r"within -3.14159 to 3.14159"),
        (lambda: Hinge(0, None, ORIGIN, limits=(-3.1, 3.1)), r"must span at most 5.78319 rad"),
        (lambda: Hinge(0, None, ORIGIN, limits=(1.0,)), r"Hinge.limits must be 2 numbers, got"),
        (lambda: Hinge(0, None, ORIGIN, motor=3.0), r"Hinge.motor must be Motor, got 3.0"),
        (lambda: Hinge(1.5, None, ORIGIN), r"Hinge.a must be the index or the name of a body"),
        (lambda: BallJoint(0, None, None), r"BallJoint.anchor must be 3 numbers"),
        (lambda: Weld(0, None, collide=1), r"Weld.collide must be bool"),
        (lambda: Slider(0, None, limits=(0.0, 0.0)), r"Slider.limits must be \(low, high\) with"),
        (lambda: Distance(0, None, 1.0), r"Distance.to_anchor must be a point"),
        (lambda: Distance(0, 1, -1.0), r"Distance.length must be finite and above 0, got -1.0"),
    ],
)
def test_a_bad_joint_is_named(build, message):
    with pytest.raises((TypeError, ValueError), match=message):
        build()


@pytest.mark.parametrize(
    ("joint", "message"),
    [
        (
            Weld(0, 2),
            r"Scene.joints\[0\]: Weld.b must be None for the world, or .* a body or Drive, got 2",
        ),
        (BallJoint("arm", None, ORIGIN), r"BallJoint.a must be .* got 'arm'; there are: 'body 0'"),
        (Weld(0, "body 0"), r"Weld.b is the same body as a, 'body 0'"),
        (Distance(0, 1, 0.5), r"length 0.5 m disagrees with its anchors, 0.3 m apart"),
        (Distance(0, 1, anchor=(0.3, 0, 0)), r"Distance between two anchors at the same point"),
    ],
)
def test_a_joint_that_does_not_fit_the_scene_is_named(joint, message):
    bodies = [Body(CUBE), Body(CUBE, position=(0.3, 0, 0))]
    with pytest.raises(ValueError, match=message):
        Scene(bodies, joints=[joint])


def test_a_scene_with_joints_is_equal_after_json():
    bodies = [Body(CUBE), Body(CUBE, position=(0.3, 0, 0), name="b")]
    joints = [
        Hinge(0, None, (0.1, 0, 0), (0, 1, 1), (-1.0, 2.0), Motor(3.0, 0.5), name="h"),
        Slider("b", 0, (1, 0, 0), collide=True),
        Distance(0, "b"),
    ]
    scene = Scene(bodies, joints=joints)
    assert Scene.from_json(scene.to_json()) == scene


def test_poses_that_violate_a_joint_are_refused_and_change_nothing():
    scene = Scene([Body(CUBE, mask=0)], joints=[Hinge(0, None, (0.1, 0, 0), name="door")])
    world = World(scene, count=3)
    with pytest.raises(ValueError, match=r"in world 1 they violate door, a Hinge between 0 and"):
        world.set_state(position=(0.0, 0.02, 0.0), worlds=[False, True, False])
    assert not world.position.any()
    quarter = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
    world.set_state(position=(0.1, -0.1, 0.0), orientation=quarter)
    assert world.joint_position()[2, 0] == pytest.approx(0.5 * math.pi)
    with pytest.raises(ValueError, match="command_motors needs a Hinge or Slider with a Motor"):
        world.command_motors(1.0)


@pytest.mark.parametrize("integrator", ["euler", "rk4", "adaptive"])
def test_other_integrators_refuse_joints(integrator):
    scene = Scene([Body(CUBE, mask=0)], joints=[BallJoint(0, None, ORIGIN)])
    with pytest.raises(ValueError, match=r"can't hold joints.*use integrator=\"midpoint\""):
        World(scene, Fidelity(integrator=integrator))


def test_divided_steps_refuse_joints():
    bodies = [Body(CUBE), Body(CUBE, position=(0.5, 0, 0))]
    scene = Scene(bodies, joints=[BallJoint(0, None, ORIGIN)])
    with pytest.raises(ValueError, match=r"'adaptive' can't divide the steps of joints"):
        World(scene, Fidelity(time_control="adaptive"))


@pytest.mark.parametrize(
    "joint", [Weld(0, 1), Hinge(0, 1, (0.25, 0, 0), (0, 1, 0)), Slider(0, 1, (1, 0, 0))]
)
def test_a_pose_turned_by_half_a_turn_violates_a_joint(joint):
    """Axes that must be perpendicular are so after it, too."""
    bodies = [ghost(), ghost(position=(0.5, 0, 0))]
    world = World(Scene(bodies, joints=[joint]))
    with pytest.raises(ValueError, match=r"they violate joint 0, .* by 3\.14"):
        world.set_state(orientation=[(1, 0, 0, 0), (0, 0, 0, 1)])


@pytest.mark.parametrize("size", [1e-200, 1e200])
def test_an_axis_may_have_any_length(size):
    joint = Hinge(0, None, (0, 0, 0), (0, size, 0))
    assert World(Scene([ghost()], joints=[joint])).joint_error().max() < 1e-15
