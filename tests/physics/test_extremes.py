"""Extremes: to survive is to stay finite with bounded energy. `make stress` draws 2,000 examples.

Sizes, masses and materials are arguments of the kernels, so all examples run on a few of them.
"""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from physics import Body, Box, Capsule, Fidelity, Ground, Material, Scene, Sphere, World

GRAVITY = 9.81


def powers(low, high):
    """Numbers whose logarithm is uniform between those of `low` and `high`."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda x: 10.0**x)


DIRECTIONS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.1)
TURNS = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1)
MATERIALS = st.builds(
    Material,
    friction=st.sampled_from([0.01, 0.5, 10.0]),
    restitution=st.sampled_from([0.0, 0.5, 1.0]),
)
PRESET = st.sampled_from(["fast", "balanced"])


def unit(vector):
    """A vector of length one."""
    return tuple(float(x) for x in np.array(vector) / math.hypot(*vector))


def mechanical(world):
    """Kinetic energy and that of the field of gravity, J."""
    return float(world.kinetic_energy()[0] + world.potential_energy()[0])


def survives(world, frames, span, gain=0.0):
    """Advances; the energy never exceeds that at the start and `gain` J, and all stays finite."""
    bound = mechanical(world) + gain
    scale = abs(bound) + float(world.kinetic_energy()[0]) + 1e-12
    for _ in range(frames):
        world.advance(span)
        assert np.all(np.isfinite(world.position))
        length = np.sqrt(np.sum(world.orientation**2, axis=-1))
        np.testing.assert_allclose(length, 1.0, atol=1e-12)
        assert mechanical(world) <= bound + 0.02 * scale


@given(
    shape=st.sampled_from(["ball", "cube", "rod", "plate", "capsule"]),
    size=powers(1e-4, 1e3), mass=powers(1e-6, 1e6), turn=TURNS, material=MATERIALS, preset=PRESET,
)  # fmt: skip
def test_any_size_and_mass_lands(shape, size, mass, turn, material, preset):
    """A body falls by its own size, at steps in proportion to the time that this takes."""
    shapes = {
        "ball": Sphere(size),
        "cube": Box((size, size, size)),
        "rod": Box((20.0 * size, size, size)),
        "plate": Box((10.0 * size, 10.0 * size, size)),
        "capsule": Capsule(size, 5.0 * size),
    }
    body = shapes[shape]
    step = {"fast": 4e-3, "balanced": 2e-3}[preset] * math.sqrt(size / 0.02)
    height = body.reach + body.width
    scene = Scene(
        [Body(body, mass=mass, position=(0, 0, height), orientation=turn, material=material)],
        [Ground(material)],
    )
    world = World(scene, Fidelity(substep=step))
    survives(world, 10, 50 * step)
    # a rod that falls on its end sinks by some of its own thickness, at steps this long
    assert world.position[0, 0, 2] > -body.width


@given(spin=powers(1.0, 1e4), axis=DIRECTIONS, preset=PRESET)
def test_any_spin_keeps_its_energy(spin, axis, preset):
    """Torque-free: L exactly, energy as well as the step resolves the turn, |q| to round-off."""
    velocity = tuple(spin * x for x in unit(axis))
    body = Body(Box((0.03, 0.02, 0.01)), mass=0.1, angular_velocity=velocity)
    world = World(Scene([body], gravity=(0.0, 0.0, 0.0)), preset)
    momentum, energy = world.angular_momentum(), float(world.kinetic_energy()[0])
    moments = body.shape.inertia(0.1)
    worst = 0.5 * float(np.sum(momentum**2)) / moments.min()
    for _ in range(10):
        world.advance(0.04)
        np.testing.assert_array_equal(world.angular_momentum(), momentum)
        assert 0.5 * float(np.sum(momentum**2)) / moments.max() * (1 - 1e-9) <= float(
            world.kinetic_energy()[0]
        )
        assert float(world.kinetic_energy()[0]) <= worst * (1 + 1e-9)
        length = np.sqrt(np.sum(world.orientation**2))
        assert abs(length - 1.0) < 1e-12
    assert energy > 0.0


@given(speed=powers(1e-3, 10.0), turn=TURNS, material=MATERIALS, preset=PRESET)
def test_after_an_impact_at_any_speed_the_energy_is_bounded(speed, turn, material, preset):
    """Up to bodies that cross themselves in a step."""
    scene = Scene(
        [
            Body(
                Box((0.02, 0.02, 0.02)), mass=0.1, position=(0, 0, 0.06), orientation=turn,
                linear_velocity=(0.3 * speed, 0.0, -speed), material=material,
            )
        ],
        [Ground(material)],
        gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    world = World(scene, preset)
    before = float(world.kinetic_energy()[0])
    world.advance(0.1)
    world.advance(0.1)
    # a ground that is met as deep as the cube is wide, all in one step, gives energy it never took
    assert np.all(np.isfinite(world.position))
    assert float(world.kinetic_energy()[0]) <= before * (1.02 if speed < 1.0 else 4.0)


@given(ratio=powers(1.0, 1e6), heavy_below=st.booleans(), material=MATERIALS)
def test_any_ratio_of_masses(ratio, heavy_below, material):
    masses = (0.01 * ratio, 0.01) if heavy_below else (0.01, 0.01 * ratio)
    cube = Box((0.02, 0.02, 0.02))
    bodies = [
        Body(cube, mass=mass, position=(0.0, 0.0, z), material=material)
        for mass, z in zip(masses, (0.021, 0.065), strict=True)
    ]
    world = World(Scene(bodies, [Ground(material)]), "balanced")
    survives(world, 25, 0.04)
    assert np.all(world.position[0, :, 2] > -0.05)


@given(share=st.floats(0.0, 1.0), turn=TURNS, material=MATERIALS)
def test_bodies_that_overlap_at_the_start_part_at_a_bounded_speed(share, turn, material):
    """From touching to one in the other's very centre, and half in the ground."""
    cube = Box((0.02, 0.02, 0.02))
    bodies = [
        Body(cube, mass=0.1, position=(0, 0, 0.01), material=material),
        Body(cube, mass=0.1, position=(0.04 * share, 0, 0.01), orientation=turn, material=material),
    ]
    world = World(Scene(bodies, [Ground(material)]), "balanced")
    omega = world.fidelity.contact_resolution / world.fidelity.substep
    for _ in range(25):
        world.advance(0.04)
        assert np.all(np.isfinite(world.position))
        # the speed that a spring as deep as the cube is wide gives a corner
        assert np.abs(world.linear_velocity).max() < 4.0 * 0.04 * omega


@given(place=powers(1.0, 1e5), material=MATERIALS)
def test_far_from_the_origin_a_cube_still_rests(place, material):
    body = Body(Box((0.02,) * 3), mass=0.1, position=(place, -place, 0.02), material=material)
    world = World(Scene([body], [Ground(material)]), "balanced")
    survives(world, 10, 0.04)
    assert np.abs(world.position[0, 0, :2] - (place, -place)).max() < 1e-6


def test_ten_million_turns_keep_a_quaternion_of_length_one():
    bodies = [Body(Box((0.03, 0.02, 0.01)), mass=0.1, angular_velocity=(3.0, 50.0, 7.0))]
    world = World(Scene(bodies, gravity=(0.0, 0.0, 0.0)), "balanced", count=8)
    world.advance(1e6 * 2e-3)  # in each of eight lanes: 8e6 steps
    length = np.sqrt(np.sum(world.orientation**2, axis=-1))
    assert np.abs(length - 1.0).max() < 1e-12
