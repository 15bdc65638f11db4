"""Set points of drives: they move, or are at once where they should be."""

import math

import numpy as np
import pytest

from physics import Box, Drive, Fidelity, Scene, World


def world_of(frequency, ratio, substep=1e-5):
    drive = Drive(Box((0.01,) * 3), mass=2.0, force_limit=1e9, frequency=frequency,
                  damping_ratio=ratio)  # fmt: skip
    return World(Scene(bodies=[], drives=[drive]), Fidelity(substep=substep), 1)


def test_a_servo_answers_a_set_point_that_jumps_as_an_oscillator_does():
    frequency, ratio, step, time = 60.0, 1.0, 0.05, 0.04
    world = world_of(frequency, ratio)
    world.move_drives([[[step, 0.0, -step]]], 0.0)
    world.advance(time)
    # critically damped: x = s (1 - (1 + w t) exp(-w t))
    u = frequency * time
    x, v = step * (1.0 - (1.0 + u) * math.exp(-u)), step * frequency * u * math.exp(-u)
    assert world.drive_position[0, 0] == pytest.approx([x, 0.0, -x], rel=1e-3)
    assert world.drive_velocity[0, 0] == pytest.approx([v, 0.0, -v], rel=1e-3)
    # and stays, in however many calls the time is divided
    other = world_of(frequency, ratio)
    other.move_drives([[[step, 0.0, -step]]], 0.0)
    for _ in range(4):
        other.advance(0.25 * time)
    assert other.drive_position == pytest.approx(world.drive_position, rel=1e-9)


def test_a_jump_ends_a_motion_and_a_motion_starts_at_a_jump():
    world = world_of(200.0, 1.0, 1e-4)
    world.move_drives([[[1.0, 0.0, 0.0]]], 0.1)
    world.advance(0.02)
    world.move_drives(np.zeros(3), 0.0)
    world.advance(0.1)
    assert world.drive_position[0, 0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-5)
    world.move_drives([[[0.0, 0.1, 0.0]]], 0.0)
    world.move_drives([[[0.0, 0.3, 0.0]]], 0.1)
    assert world.read().reference[0, 0] == pytest.approx([0.0, 0.1, 0.0])
    world.advance(0.05)
    assert world.read().reference[0, 0] == pytest.approx([0.0, 0.2, 0.0], rel=1e-5)


def test_a_negative_time_is_refused():
    with pytest.raises(ValueError, match=r"time -0.1|time must be .*0"):
        world_of(60.0, 1.0).move_drives(np.zeros(3), -0.1)
