"""The adaptive pair keeps to its tolerance, for each world by itself, and never hangs."""

import numpy as np
import pytest

from physics import Attractor, Body, Box, Drag, SimulationDiverged, StepVanished
from tests.physics.integrators.top import (
    MOMENTS,
    SPIN,
    TOP,
    angle_between,
    exact_orientation,
    jacobi_spin,
    spin_in_body,
    world_of,
)

SLAB = Box((0.05, 0.03, 0.02))
PLANET = Body(SLAB, mass=2.0, position=(1.0, 0.0, 0.0), linear_velocity=(0.0, 0.4, 0.0))
SUN = Attractor((0.0, 0.0, 0.0), 1.0)


def test_the_error_of_a_top_is_proportional_to_the_tolerance():
    time, tolerances = 4.0, 10.0 ** -np.arange(4, 10)
    spin = jacobi_spin(MOMENTS, SPIN, np.array([time]))[0]
    orientation = exact_orientation(MOMENTS, SPIN, time)
    errors, steps = [], []
    for tolerance in tolerances:
        world = world_of(TOP, "adaptive", 1.0, tolerance=tolerance)
        world.advance(time)
        angle = angle_between(world.orientation[0, 0], orientation)
        errors.append(max(np.abs(spin_in_body(world) - spin).max(), angle))
        steps.append(int(world.steps[0]))
    assert np.all(errors <= 10.0 * tolerances * time)
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.15)
    assert steps == sorted(steps)
    assert steps[-1] < 800  # equal steps of 1 ms would be 4,000


def test_steps_are_short_where_a_planet_is_fast():
    world = world_of(PLANET, "adaptive", 1.0, SUN, tolerance=1e-7)
    before, count, taken = world.kinetic_energy() + world.potential_energy(), [0], []
    for _ in range(20):
        world.advance(0.1)
        taken.append(int(world.steps[0]) - count[-1])
        count.append(int(world.steps[0]))
    assert max(taken) > 8 * min(taken)
    np.testing.assert_allclose(world.kinetic_energy() + world.potential_energy(), before, atol=1e-5)


def test_frames_of_any_length_end_at_their_time_within_the_tolerance():
    rng, tolerance = np.random.default_rng(3), 1e-7
    frames = np.concatenate([rng.uniform(1e-4, 0.3, 20), [1e-9, 0.7]])
    worlds = [world_of(PLANET, "adaptive", 0.5, SUN, tolerance=tolerance) for _ in range(2)]
    for frame in frames:
        worlds[0].advance(frame)
    worlds[1].advance(frames.sum())
    for world in worlds:
        assert world.time[0] == pytest.approx(frames.sum(), rel=1e-14)
    apart = np.abs(worlds[0].position - worlds[1].position).max()
    assert 0.0 < apart < 1e4 * tolerance  # a passage of the sun amplifies errors


def varied(count, threads=1):
    world = world_of(PLANET, "adaptive", 0.5, SUN, count, tolerance=1e-6, threads=threads)
    rng = np.random.default_rng(0)
    state = {
        "position": rng.normal(size=(300, 1, 3)),
        "linear_velocity": rng.normal(size=(300, 1, 3)),
        "angular_velocity": 10.0 * rng.normal(size=(300, 1, 3)),
    }
    world.set_state(**{name: values[:count] for name, values in state.items()})
    return world


def test_a_world_depends_neither_on_count_nor_neighbours_nor_threads():
    many, threaded = varied(300), varied(300, threads=4)
    some = np.random.default_rng(1).random(300) < 0.5
    for world in (many, threaded):
        world.advance(0.7)
        world.advance(0.4)
    assert len(np.unique(many.steps)) > 10
    np.testing.assert_array_equal(many.position, threaded.position)
    np.testing.assert_array_equal(many.orientation, threaded.orientation)
    for count in (1, 5, 40):
        few = varied(count)
        few.advance(0.7)
        few.advance(0.4)
        for name in ("position", "orientation", "linear_velocity", "steps"):
            np.testing.assert_array_equal(getattr(few, name), getattr(many, name)[:count])
    masked = varied(300)
    masked.advance(0.7, some)
    masked.advance(0.7, ~some)
    masked.advance(0.4)
    np.testing.assert_array_equal(masked.position, many.position)


def test_a_snapshot_holds_the_step_and_a_reset_forgets_it():
    world = varied(20)
    world.advance(0.5)
    saved = world.snapshot()
    ends = []
    for _ in range(2):
        world.advance(0.5)
        ends.append((world.position.copy(), world.steps.copy()))
        world.restore(saved)
    np.testing.assert_array_equal(*(position for position, _ in ends))
    np.testing.assert_array_equal(*(steps for _, steps in ends))
    world.reset()
    assert not world.steps.any()
    fresh = world_of(PLANET, "adaptive", 0.5, SUN, 20, tolerance=1e-6)
    for w in (world, fresh):
        w.advance(0.5)
    np.testing.assert_array_equal(world.position, fresh.position)


def test_a_query_changes_no_bit():
    worlds = [varied(20) for _ in range(2)]
    for _ in range(3):
        worlds[0].force()
        for world in worlds:
            world.advance(0.3)
    np.testing.assert_array_equal(worlds[0].position, worlds[1].position)


def test_a_body_that_falls_into_an_attractor_is_an_error_and_leaves_the_others():
    world = world_of(PLANET, "adaptive", 0.1, SUN, 20, tolerance=1e-6)
    velocity = np.zeros((20, 1, 3))
    velocity[:, 0, 1] = 1.0
    velocity[3] = 0.0  # it falls straight into the centre, in pi / sqrt(8) = 1.11 s
    world.set_state(linear_velocity=velocity)
    with pytest.raises(
        StepVanished, match=r"world 3: body 0 needs steps shorter.* singularity"
    ) as e:
        world.advance(2.0)
    assert e.value.time == pytest.approx(np.pi / np.sqrt(8.0), abs=1e-3)
    assert isinstance(e.value, SimulationDiverged)
    assert e.value.worlds == [3]
    others = np.arange(20) != 3
    np.testing.assert_allclose(np.linalg.norm(world.position[others], axis=-1), 1.0, atol=1e-5)
    world.reset(~others)
    world.advance(0.1)


def test_a_tolerance_below_round_off_is_an_error_and_does_not_hang():
    body = Body(SLAB, mass=2.0, position=(1.0, 0.0, 0.0), angular_velocity=(1e4, 2e4, 1e4))
    world = world_of(body, "adaptive", 1e-2, tolerance=1e-12)
    with pytest.raises(StepVanished, match="below round-off"):
        world.advance(1.0)


def test_a_state_too_large_for_double_precision_is_an_error():
    body = Body(SLAB, mass=2.0, linear_velocity=(1e200, 0.0, 0.0))
    world = world_of(body, "adaptive", 1e-2, Drag(quadratic=1.0))
    with pytest.raises(SimulationDiverged, match="world 0: body 0"):
        world.advance(1.0)


def test_drag_for_which_equal_steps_would_be_unstable_is_no_problem():
    body = Body(SLAB, mass=2.0, linear_velocity=(1.0, 0.0, 0.0))
    world = world_of(body, "adaptive", 1.0, Drag(linear=2000.0), tolerance=1e-6)
    assert world.largest_stable_step() == np.inf
    world.advance(0.01)
    assert world.linear_velocity[0, 0, 0] == pytest.approx(np.exp(-10.0), abs=1e-6)
    world.advance(1.0)
    assert world.position[0, 0, 0] == pytest.approx(1e-3, abs=1e-6)
