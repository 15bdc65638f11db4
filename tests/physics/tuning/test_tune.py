"""tune finds the cheapest fidelity within a tolerance, against closed forms where there are any."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from physics import (
    Attractor,
    Body,
    Box,
    Drive,
    Fidelity,
    Ground,
    Hinge,
    Material,
    Scene,
    Sphere,
    Static,
    World,
    tune,
)
from physics.reference.closed_forms import slide_distance
from physics.reference.scenes import GRAVITY, block_on_ground, sphere_on_ground
from physics.tuning import tune as module
from physics.tuning.candidates import can_touch, families, with_substep
from physics.tuning.description import code
from physics.tuning.metrics import METRICS
from physics.tuning.motion import Course, Motion, simulate
from physics.tuning.reference import Reference
from physics.tuning.tune import Evidence, Tuned, _rounded_up

SPEED = 1.0
SLIDE = block_on_ground(linear_velocity=(SPEED, 0, 0))
ORBIT = Scene(
    [Body(Sphere(0.05), mass=1.0, position=(1, 0, 0), linear_velocity=(0, 1, 0))],
    gravity=(0, 0, 0), fields=[Attractor((0, 0, 0), 1.0)],
)  # fmt: skip


@pytest.fixture
def few(monkeypatch):
    """Two families, so that two kernels are compiled."""
    chosen = ("springs", "impulses")
    monkeypatch.setattr(
        module, "families", lambda scene: [f for f in families(scene) if f.name in chosen]
    )


@pytest.mark.usefixtures("few")
def test_a_slide_ends_within_the_tolerance_of_its_closed_form():
    for tolerance in (1e-2, 1e-4):
        tuned = tune(SLIDE, tolerance)
        assert tuned.error <= tolerance
        world = World(SLIDE, tuned.fidelity)
        for _ in range(25):
            world.advance(0.04)
        distance = slide_distance(SPEED, 0.5, GRAVITY)
        assert abs(world.position[0, 0, 0] - distance) < 1.5 * tolerance
        assert str(tuned).startswith(code(tuned.fidelity))


@pytest.mark.usefixtures("few")
def test_nothing_that_was_tried_and_accurate_enough_is_cheaper():
    tuned = tune(SLIDE, 1e-3, time=0.4, exhaustive=True)
    good = [e for e in tuned.evidence if e.error <= 1e-3]
    assert tuned.cost == min(e.cost for e in good)
    assert len(tuned.evidence) == 2 * 19


@pytest.mark.usefixtures("few")
def test_members_that_cannot_be_the_cheapest_are_left_out():
    assert len(tune(SLIDE, 1e-3, time=0.4).evidence) < 2 * 19


@pytest.mark.usefixtures("few")
def test_penetration_needs_no_reference():
    tuned = tune(SLIDE, 1e-5, "penetration", time=0.08)
    assert tuned.error <= 1e-5
    world = World(SLIDE, tuned.fidelity)
    world.advance(0.08)
    assert world.penetration()[0] <= 1e-5


@pytest.mark.usefixtures("few")
def test_a_chaotic_motion_is_answered_with_none_and_why():
    tumbling = block_on_ground(
        restitution=0.9, position=(0, 0, 0.7), orientation=(0.3, 0.5, 0.1, 1.0),
        angular_velocity=(7, 3, 5),
    )  # fmt: skip
    tuned = tune(tumbling, 1e-6, time=1.5)
    assert tuned.fidelity is None
    assert "chaotic" in tuned.reason
    assert str(tuned).startswith("no fidelity has a position error of at most 1e-06 m")
    # the time that it advises is one for which a fidelity is found
    tuned = tune(tumbling, 1e-3, time=1.5)
    advised = float(re.search(r"tune for ([\d.]+) s", tuned.reason)[1])
    assert 0.1 < advised < 1.5
    reason = tune(tumbling, 1e-3, time=advised).reason
    assert not reason or reason.startswith("the smallest error")


def test_a_tolerance_that_it_advises_is_rounded_up():
    assert [_rounded_up(x) for x in (0.00123, 0.0012, 1.0, 0.0991)] == pytest.approx(
        [0.0013, 0.0012, 1.0, 0.1]
    )


def test_an_orbit_needs_a_runge_kutta_method_for_small_errors():
    tuned = tune(ORBIT, 1e-9, time=0.8)
    assert tuned.fidelity.integrator in ("rk4", "adaptive")
    world = World(ORBIT, tuned.fidelity)
    for _ in range(20):
        world.advance(0.04)
    exact = math.cos(0.8), math.sin(0.8), 0.0
    np.testing.assert_allclose(world.position[0, 0], exact, atol=2e-9)


@pytest.mark.usefixtures("few")
def test_a_tolerance_that_no_fidelity_reaches_is_answered_with_the_smallest_error():
    tuned = tune(SLIDE, 1e-9, "penetration", time=0.04)
    assert tuned.fidelity is None
    assert "the smallest error of" in tuned.reason


@pytest.mark.usefixtures("few")
def test_a_stiffness_makes_springs_the_reference():
    stiff = Material(0.5, 0.0, stiffness=2e4)
    body = replace(SLIDE.bodies[0], material=stiff)
    tuned = tune(Scene([body], [Ground(stiff)]), 1e-3, time=0.4)
    assert tuned.reference.description.startswith("spring law")


@pytest.mark.usefixtures("few")
def test_drives_move_by_the_control():
    drive = Drive(Sphere(0.015), 0.3, 20.0, (-0.05, 0, 0.02))
    scene = Scene(block_on_ground().bodies, [Ground()], [drive])

    def control(world, frame):
        if frame == 0:
            world.move_drives((0.05, 0.0, 0.02), 0.4)

    course = Course(scene, 10, 0.04, 2, None, control)
    motion = simulate(course, Fidelity()).motion
    assert motion.position[-1, 0, 0, 0] > 0.05
    assert motion.position.shape == (11, 2, 1, 3)


@pytest.mark.parametrize("holder", ["joint", "drive"])
def test_where_nothing_touches_joints_and_drives_have_a_reference(holder):
    if holder == "joint":
        rod = Body(Box((0.01, 0.01, 0.25)), mass=1.0, position=(0.25, 0, 0))
        scene = Scene([rod], joints=[Hinge(0, None, (0, 0, 0), (0, -1, 0))])
    else:
        ball, hand = (Sphere(0.02), 0.1), (Sphere(0.02), 0.3, 20.0, (1.0, 0, 0))
        scene = Scene([Body(*ball, mask=0)], drives=[Drive(*hand, mask=0)])
    tuned = tune(scene, 1e-3, time=0.4)
    assert tuned.reference.description.startswith("midpoint, substep")
    assert tuned.fidelity.integrator in ("midpoint", "euler")
    assert tuned.error <= 1e-3


@pytest.mark.usefixtures("few")
def test_a_penetration_between_frames_counts():
    scene = sphere_on_ground(position=(0, 0, 0.3), linear_velocity=(0, 0, -5.0))
    tuned = tune(scene, 1e-3, "penetration", time=0.4, law="impulse")
    world, deepest = World(scene, tuned.fidelity), 0.0
    substeps = math.ceil(0.04 / tuned.fidelity.substep * (1.0 - 1e-9))
    for _ in range(10 * substeps):
        world.advance(0.04 / substeps)
        deepest = max(deepest, world.penetration()[0])
    assert tuned.error == pytest.approx(deepest, rel=1e-6, abs=1e-12)
    assert deepest <= 1e-3
    assert any(e.error > 1e-3 for e in tuned.evidence)


@pytest.mark.usefixtures("few")
def test_what_passes_through_a_wall_has_no_small_penetration():
    ball = Body(Sphere(0.02), mass=0.1, linear_velocity=(20.0, 0, 0))
    wall = Static(Box((0.001, 0.5, 0.5)), position=(0.4, 0, 0))
    scene = Scene([ball], [wall], gravity=(0, 0, 0))
    tuned = tune(scene, 0.01, "penetration", time=0.04, law="impulse")
    passed = [e for e in tuned.evidence if "may pass through the thinnest solid, 2 mm" in e.note]
    assert passed
    assert all(e.error == math.inf for e in passed)
    assert all(20.0 * e.fidelity.substep <= 1e-3 for e in tuned.evidence if e not in passed)


def test_errors_of_start_and_control_are_those_of_the_caller_before_anything_is_compiled(
    monkeypatch,
):
    def start(world):
        world.set_state(linear_velocity=(1.0, 2.0))

    def control(world, frame):
        world.move_drives((1.0, 2.0), 0.1)

    monkeypatch.setattr(module, "compile_for", lambda *_: pytest.fail("compiles"))
    with pytest.raises(ValueError, match="linear_velocity"):
        tune(SLIDE, 1e-3, "penetration", start=start)
    with pytest.raises(ValueError, match="move_drives needs a Drive"):
        tune(SLIDE, 1e-3, "penetration", control=control)


def test_the_angle_between_orientations_is_exact():
    angle = 0.7
    turned = np.array([0, 0, math.sin(angle / 2), math.cos(angle / 2)])
    rows = np.broadcast_to(turned, (2, 1, 1, 4))
    base = np.broadcast_to(np.array([0.0, 0, 0, -1.0]), (2, 1, 1, 4))
    zero = np.zeros((2, 1, 1, 3))
    flat = np.zeros((2, 1))
    motions = [motion_of(zero, q, flat) for q in (rows, base)]
    np.testing.assert_allclose(METRICS["orientation"].distance(*motions), angle)


def motion_of(vectors, orientation, numbers):
    return Motion(vectors, orientation, vectors, numbers, numbers, numbers, numbers)


def test_bad_arguments_are_named():
    with pytest.raises(TypeError, match="scene"):
        tune("scene")
    with pytest.raises(ValueError, match="tolerance"):
        tune(SLIDE, -1.0)
    with pytest.raises(ValueError, match="metric"):
        tune(SLIDE, metric="speed")
    with pytest.raises(ValueError, match="law"):
        tune(SLIDE, law="magic")
    with pytest.raises(ValueError, match="worlds"):
        tune(SLIDE, worlds=0)


def test_scenes_in_which_nothing_touches_get_integrators():
    assert not can_touch(ORBIT)
    assert {f.name for f in families(ORBIT)} == {"midpoint", "Euler", "RK4", "adaptive"}
    filtered = replace(SLIDE, bodies=[replace(SLIDE.bodies[0], mask=0)])
    assert not can_touch(filtered)
    assert can_touch(SLIDE)
    steps = [f.substep for family in families(SLIDE) for f in family.members]
    assert len(steps) == 11 * 19
    assert all(abs(0.04 / h - round(0.04 / h)) < 1e-9 for h in steps)


def test_a_shorter_step_with_a_larger_error_is_reported():
    def tried(substep, error, cost):
        return Evidence("springs", with_substep(Fidelity(), substep), error, cost)

    best = tried(1e-3, 5e-4, 0.1)
    reference = Reference(None, 0.0, "none is needed", 1.0)
    for error, cautious in ((2e-3, True), (2e-4, False)):
        evidence = (tried(2e-3, 3e-3, 0.05), best, tried(0.5e-3, error, 0.2))
        found = best.fidelity, best.error, best.cost
        text = str(Tuned(*found, evidence, reference, "position", 1e-3))
        assert ("caution: at 0.5 ms, a shorter step, the error is 0.002" in text) == cautious
        assert text.count(" yes ") == (1 if cautious else 2)
