"""Extremes: to survive is to stay finite with bounded energy. `make stress` draws 2,000 examples.

Sizes, masses and materials are arguments of the kernels, so all examples run on a few of them:
those of the shapes and laws that are drawn from, which the last test counts. A failure leaves a
script behind that replays it, see tests/replay.py.
"""

import inspect
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from physics import (
    PRESETS,
    Body,
    Box,
    Capsule,
    Drive,
    Ground,
    Material,
    Scene,
    Sphere,
    Static,
    World,
)
from tests import replay
from tests.replay import replayable

GRAVITY = 9.81
CUBE = Box((0.02, 0.02, 0.02))
# at rest and out of reach, with friction: for a kernel that other scenes have, too
ROUGH = Material(0.5, 0.0)
BYSTANDER = Body(CUBE, mass=0.1, position=(0, 0, 90.0), material=ROUGH)
SHELF = Static(CUBE, (0, 0, 89.0), material=ROUGH)
VARIANTS = 40
compiled = set()


def powers(low, high):
    """Numbers whose logarithm is uniform between those of `low` and `high`."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda x: 10.0**x)


DIRECTIONS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)
TURNS = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1)
MATERIALS = st.builds(
    Material,
    friction=st.sampled_from([0.01, 0.5, 10.0]),  # 0 is in test_after_an_impact
    restitution=st.sampled_from([0.0, 0.5, 1.0]),
)
PRESET = st.sampled_from(["fast", "balanced", "solid"])


def unit(vector):
    """A vector of length one."""
    return tuple(float(x) for x in np.array(vector) / math.hypot(*vector))


def at(preset, substep, geometry="shape"):
    """A preset at another substep, in either geometry."""
    return replace(PRESETS[preset], substep=substep, geometry=geometry)


def mechanical(world):
    """Kinetic energy and that of the field of gravity, J."""
    return float(world.kinetic_energy()[0] + world.potential_energy()[0])


def survives(scene, fidelity, spans, check):
    """Advances by spans in s and checks each time; what fails is left as a script."""
    fidelity = PRESETS[fidelity] if isinstance(fidelity, str) else fidelity
    world = World(scene, fidelity)
    compiled.add(world.features)
    with replayable(inspect.stack()[1].function, scene, fidelity, spans):
        for span in spans:
            world.advance(span)
            assert np.all(np.isfinite(world.position))
            length = np.sqrt(np.sum(world.orientation**2, axis=-1))
            np.testing.assert_allclose(length, 1.0, atol=1e-12)
            check(world)
    return world


def no_gain(scene, fidelity):
    """A check that the energy never exceeds that at the start."""
    world = World(scene, fidelity)
    bound = mechanical(world)
    scale = abs(bound) + float(world.kinetic_energy()[0]) + 1e-12

    def check(world):
        assert mechanical(world) <= bound + 0.02 * scale

    return check


@given(
    shape=st.sampled_from(["ball", "cube", "rod", "plate", "capsule"]),
    size=powers(1e-4, 1e3), mass=powers(1e-6, 1e6), turn=TURNS, material=MATERIALS, preset=PRESET,
    geometry=st.sampled_from(["shape", "particle"]),
)  # fmt: skip
def test_any_size_and_mass_lands(shape, size, mass, turn, material, preset, geometry):
    """A body falls by its own size, at steps in proportion to the time that this takes.

    As particles a ball is a single one, and a capsule a row of them.
    """
    shapes = {
        "ball": Sphere(size),
        "cube": Box((size, size, size)),
        "rod": Box((20.0 * size, size, size)),
        "plate": Box((10.0 * size, 10.0 * size, size)),
        "capsule": Capsule(size, 5.0 * size),
    }
    body = shapes[shape]
    step = PRESETS[preset].substep * math.sqrt(size / 0.02)
    height = body.reach + body.width
    scene = Scene(
        [Body(body, mass=mass, position=(0, 0, height), orientation=turn, material=material)],
        [Ground(material)],
    )
    fidelity = at(preset, step, geometry)
    world = survives(scene, fidelity, [50 * step] * 10, no_gain(scene, fidelity))
    # a rod that falls on its end sinks by some of its own thickness, at steps this long
    assert world.position[0, 0, 2] > -body.width


@given(spin=powers(1.0, 1e4), axis=DIRECTIONS, preset=PRESET)
def test_any_spin_keeps_its_energy(spin, axis, preset):
    """Torque-free: L exactly, energy as well as the step resolves the turn, |q| to round-off."""
    velocity = tuple(spin * x for x in unit(axis))
    body = Body(Box((0.03, 0.02, 0.01)), mass=0.1, angular_velocity=velocity)
    scene = Scene([body], gravity=(0.0, 0.0, 0.0))
    momentum = World(scene, preset).angular_momentum()
    moments = body.shape.inertia(0.1)
    least, most = (0.5 * float(np.sum(momentum**2)) / j for j in (moments.max(), moments.min()))

    def check(world):
        np.testing.assert_array_equal(world.angular_momentum(), momentum)
        assert least * (1 - 1e-9) <= float(world.kinetic_energy()[0]) <= most * (1 + 1e-9)

    survives(scene, preset, [0.04] * 10, check)


@given(
    speed=powers(1e-3, 10.0), turn=TURNS, preset=PRESET,
    material=st.one_of(MATERIALS, st.just(Material(0.0, 0.5)), st.just(Material(0.0, 1.0))),
)  # fmt: skip
def test_after_an_impact_at_any_speed_the_energy_is_bounded(speed, turn, material, preset):
    """Up to bodies that cross themselves in a step, with friction and with a coefficient of 0."""
    cube = Body(
        CUBE, mass=0.1, position=(0, 0, 0.06), orientation=turn,
        linear_velocity=(0.3 * speed, 0.0, -speed), material=material,
    )  # fmt: skip
    scene = Scene([cube, BYSTANDER], [Ground(material), SHELF], gravity=(0.0, 0.0, 0.0))
    before = float(World(scene, preset).kinetic_energy()[0])
    # a spring that is met as deep as the cube is wide, all in one step, gives what it never took
    limit = 1.02 if speed < 1.0 or preset == "solid" else 4.0

    def check(world):
        assert float(world.kinetic_energy()[0]) <= before * limit

    survives(scene, preset, [0.1] * 2, check)


@given(ratio=powers(1.0, 1e6), heavy_below=st.booleans(), material=MATERIALS, preset=PRESET)
def test_any_ratio_of_masses(ratio, heavy_below, material, preset):
    masses = (0.01 * ratio, 0.01) if heavy_below else (0.01, 0.01 * ratio)
    bodies = [
        Body(CUBE, mass=mass, position=(0.0, 0.0, z), material=material)
        for mass, z in zip(masses, (0.021, 0.065), strict=True)
    ]
    scene = Scene(bodies, [Ground(material)])
    world = survives(scene, preset, [0.04] * 25, no_gain(scene, preset))
    assert np.all(world.position[0, :, 2] > -0.05)


@given(share=st.floats(0.0, 1.0), turn=TURNS, material=MATERIALS, preset=PRESET)
@example(0.0, (0.0, 0.0, 0.0, 1.0), Material(), "balanced")
@example(0.0, (0.0, 0.0, 0.0, 1.0), Material(), "solid")
@example(0.0, (0.3, 0.0, 0.0, 1.0), Material(), "solid")
def test_bodies_that_overlap_at_the_start_part_at_a_bounded_speed(share, turn, material, preset):
    """From touching to one in the other's very centre, and half in the ground."""
    bodies = [
        Body(CUBE, mass=0.1, position=(0, 0, 0.01), material=material),
        Body(CUBE, mass=0.1, position=(0.04 * share, 0, 0.01), orientation=turn, material=material),
    ]
    fidelity = PRESETS[preset]
    # the speed that a spring as deep as the cube is wide gives a corner
    spring = 4.0 * 0.04 * fidelity.contact_resolution / fidelity.substep

    def check(world):
        assert np.abs(world.linear_velocity).max() < (5.0 if preset == "solid" else spring)

    survives(Scene(bodies, [Ground(material)]), preset, [0.04] * 25, check)


@given(place=powers(1.0, 1e5), material=MATERIALS, preset=PRESET)
def test_far_from_the_origin_a_cube_still_rests(place, material, preset):
    body = Body(CUBE, mass=0.1, position=(place, -place, 0.02), material=material)
    scene = Scene([body], [Ground(material)])
    world = survives(scene, preset, [0.04] * 10, no_gain(scene, preset))
    assert np.abs(world.position[0, 0, :2] - (place, -place)).max() < 5e-6


@given(
    weight=powers(1.0, 1e9), aside=st.floats(0.0, 0.03), material=MATERIALS, preset=PRESET,
)  # fmt: skip
@example(1e9, 0.0, Material(), "balanced")
@example(1e9, 0.01, Material(), "solid")
def test_a_press_of_up_to_a_giganewton_leaves_all_bounded(weight, aside, material, preset):
    """A plate as heavy as its force is large comes down on a cube that it may squash or shoot off.

    It falls by 4 cm, at g; nothing becomes faster than a light body that it strikes elastically.
    """
    plate = Drive(Box((0.1, 0.1, 0.01)), weight / GRAVITY, weight, (0, 0, 0.09), frequency=60.0)
    cube = Body(CUBE, mass=0.1, position=(aside, 0, 0.02), material=material)
    scene = Scene([cube], [Ground(material)], [plate])
    fidelity = PRESETS[preset]
    world = World(scene, fidelity)
    compiled.add(world.features)
    world.command_drives((0.0, 0.0, -1.0))
    for _ in range(25):
        world.advance(0.04)
        assert np.all(np.isfinite(world.position))
        assert np.all(np.isfinite(world.drive_position))
        assert np.abs(world.linear_velocity).max() < 20.0
        assert np.abs(world.drive_velocity).max() < 5.0


def test_ten_million_turns_keep_a_quaternion_of_length_one():
    bodies = [Body(Box((0.03, 0.02, 0.01)), mass=0.1, angular_velocity=(3.0, 50.0, 7.0))]
    world = World(Scene(bodies, gravity=(0.0, 0.0, 0.0)), "balanced", count=10)
    world.advance(1e6 * 2e-3)  # in each of ten lanes
    length = np.sqrt(np.sum(world.orientation**2, axis=-1))
    assert np.abs(length - 1.0).max() < 1e-12


def test_a_failure_leaves_a_script_that_replays_it(tmp_path, monkeypatch):
    monkeypatch.setattr(replay, "FOLDER", tmp_path)
    material = Material(stiffness=1e4)
    scene = Scene([Body(Capsule(0.01, 0.02), mass=0.1, material=material)], [Ground(material)])
    lines = []
    replay.run(scene, PRESETS["balanced"], [0.1, 0.2], lines.append)
    with (
        pytest.raises(AssertionError) as error,
        replayable("falls", scene, PRESETS["balanced"], [0.1, 0.2]),
    ):
        assert scene is None, 'it "fell"'
    assert "falls" in error.value.__notes__[0]
    told = subprocess.run(
        [sys.executable, tmp_path / "falls.py"], capture_output=True, text=True, check=True
    )
    assert told.stdout.splitlines() == lines


def test_all_of_these_are_few_variants():
    """Must stand last: it counts what the others compiled."""
    assert len(compiled) <= VARIANTS
