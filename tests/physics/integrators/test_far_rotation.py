"""Bodies with two equal moments of inertia precess steadily, and rotate exactly by any angle."""

import math

import numpy as np
import pytest

from physics import Body, Box, Fidelity, Scene, World
from physics.integrators.far_rotation import rotate_symmetric, symmetry_axis
from physics.rotation import multiply, rotate, rotate_back

STEP = 0.02
# the body axis about which the other two moments are equal, and half extents
SHAPES = {0: (0.25, 0.01, 0.01), 1: (0.02, 0.25, 0.02), 2: (0.2, 0.2, 0.01)}


def turned(vector):
    """The quaternion of a rotation vector, in rad."""
    angle = np.linalg.norm(vector)
    return np.array([*(np.sin(0.5 * angle) * vector / angle), np.cos(0.5 * angle)])


@pytest.mark.parametrize("axis", SHAPES)
def test_a_free_symmetric_body_precesses_as_the_closed_form_says(axis):
    start = np.array([0.1, -0.3, 0.2, 0.9])
    start /= np.linalg.norm(start)
    spin = np.array([31.0, -47.0, 23.0])  # rad/s: more than a radian in a step
    body = Body(Box(SHAPES[axis]), mass=1.0, orientation=tuple(start), angular_velocity=tuple(spin))
    world = World(Scene([body], gravity=(0, 0, 0)), Fidelity(substep=STEP))
    moments = np.asarray(body.shape.inertia(1.0))
    momentum = world.angular_momentum()[0].copy()
    energy = world.kinetic_energy()[0]
    along, across = moments[axis], moments[(axis + 1) % 3]
    own = rotate_back(start, momentum)[axis]
    time = 500 * STEP
    world.advance(time)
    about = np.eye(3)[axis] * own * (1.0 / along - 1.0 / across) * time
    exact = multiply(turned(momentum / across * time), multiply(start, turned(about)))
    apart = np.abs(world.orientation[0, 0] @ exact)
    assert 2.0 * math.acos(min(1.0, apart)) < 1e-6
    np.testing.assert_array_equal(world.angular_momentum()[0], momentum)
    assert world.kinetic_energy()[0] == pytest.approx(energy, rel=1e-11)


def test_the_bound_of_the_speed_holds():
    draw = np.random.default_rng(0)
    for _ in range(100):
        q = draw.normal(size=4)
        q /= np.linalg.norm(q)
        momentum, (along, across) = draw.normal(size=3), draw.uniform(0.1, 10.0, 2)
        inverse = np.array([across, along, across])
        *_, bound = rotate_symmetric(*q, 1, along, across, *momentum, 0.3)
        assert np.linalg.norm(rotate(q, inverse * rotate_back(q, momentum))) <= bound


def test_an_axis_of_symmetry_is_found_up_to_round_off():
    assert [symmetry_axis(*j) for j in ((1, 1, 2), (2, 1, 1), (1, 2, 1))] == [2, 0, 1]
    assert symmetry_axis(1.0, 1.0 + 1e-15, 5.0) == 2
    assert symmetry_axis(1.0, 1.0 + 1e-9, 5.0) == -1
    assert symmetry_axis(math.nan, 1.0, 2.0) == -1
