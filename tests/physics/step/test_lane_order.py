"""Worlds change their places in lane groups, and nothing else changes."""

import numpy as np
import pytest

from physics import Body, Ground, Scene, Sphere, World
from physics.compiler.jit import LANES
from physics.reference import scenes
from physics.step import lane_order

COUNT = 16 * LANES - 5
FIELDS = ("position", "orientation", "linear_velocity", "angular_velocity", "drive_position")


def scattered(fidelity, sort, monkeypatch):
    """Worlds in which the block lies, falls, or is pushed; sorted or not."""
    monkeypatch.setattr(lane_order, "_FEWEST_GROUPS", 1 if sort else 10**9)
    world, rng = World(scenes.push_like(), fidelity, COUNT, threads=2), np.random.default_rng(3)
    position = np.broadcast_to(world.position, (COUNT, *world.position.shape[1:])).copy()
    position[:, 0, 2] += np.where(rng.random(COUNT) < 0.5, rng.uniform(0.0, 0.3, COUNT), 0.0)
    world.set_state(position=position)
    target = world.drive_position + rng.uniform(-0.2, 0.2, world.drive_position.shape)
    return world, target


def run(world, target, frames=20):
    """The states after each of some frames; some worlds wait, some are reset on the way."""
    rng, states = np.random.default_rng(4), []
    for frame in range(frames):
        world.move_drives(target, 0.4)
        world.advance(0.02, worlds=rng.random(COUNT) < (0.5 if frame % 5 == 4 else 1.1))
        if frame % 7 == 6:
            world.reset(rng.random(COUNT) < 0.2)
        states.append([getattr(world, name).copy() for name in FIELDS])
    return states


@pytest.mark.parametrize("fidelity", ["balanced", "solid"])
def test_sorted_worlds_are_bitwise_those_that_stay_in_place(fidelity, monkeypatch):
    alike, target = scattered(fidelity, False, monkeypatch)
    expected = run(alike, target)
    world, target = scattered(fidelity, True, monkeypatch)
    for ours, theirs in zip(run(world, target), expected, strict=True):
        for a, b in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(a, b)
    state = world._simulation.state
    assert (state.place != np.arange(COUNT)).mean() > 0.3  # they did move
    np.testing.assert_array_equal(state.resident[state.place], np.arange(COUNT))
    assert sorted(state.place) == list(range(COUNT))
    # what is read lane by lane is that of the right world
    np.testing.assert_array_equal(world.penetration(), alike.penetration())
    touching = 0
    for w in range(0, COUNT, 11):
        ours, theirs = world.contacts(w), alike.contacts(w)
        touching += len(ours.point)
        np.testing.assert_array_equal(ours.point, theirs.point)
        np.testing.assert_array_equal(ours.force, theirs.force)
    assert touching > 0


def test_groups_hold_worlds_with_the_same_half_pairs(monkeypatch):
    world, target = scattered("balanced", True, monkeypatch)
    run(world, target)
    simulation = world._simulation
    model, state = simulation.model, simulation.state
    scratch = lane_order.Scratch.of(model, state)
    lane_order.sort_worlds(model, state, scratch, 0, COUNT // LANES + 1)
    counts = state.half_pair["count"]

    def empty(order):
        """Lanes without a candidate, in the slots that groups work on."""
        groups = [counts[order[n : n + LANES]] for n in range(0, COUNT, LANES)]
        return sum(int((group.max(axis=0) - group).sum()) for group in groups)

    assert empty(state.resident[:COUNT]) < 0.6 * empty(np.arange(COUNT))
    # all are where they belong
    assert lane_order.sort_worlds(model, state, scratch, 0, COUNT // LANES + 1) == 0


def test_a_snapshot_taken_elsewhere_continues_bitwise(monkeypatch):
    world, target = scattered("balanced", True, monkeypatch)
    run(world, target, 5)
    saved = world.snapshot()
    expected = run(world, target, 10)
    world.restore(saved)
    for ours, theirs in zip(run(world, target, 10), expected, strict=True):
        for a, b in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(a, b)


def test_worlds_with_their_own_parameters_stay_in_place(monkeypatch):
    monkeypatch.setattr(lane_order, "_FEWEST_GROUPS", 1)
    world = World(scenes.push_like(), count=2 * LANES, per_world_parameters=True)
    simulation = world._simulation
    assert not lane_order.can_sort(simulation.model, simulation.features, world.count)


def test_scenes_with_one_half_pair_with_many_and_with_none_in_one_process():
    """The kernel is compiled for the first of them."""
    lane_order.make_sort.cache_clear()
    count, ball = 8 * LANES, Body(Sphere(0.1), mass=1.0, position=(0, 0, 1))
    for scene in (
        Scene(bodies=[ball]),
        Scene(bodies=[ball], statics=[Ground()]),
        scenes.push_like(),
    ):
        world = World(scene, count=count, threads=2)
        rng = np.random.default_rng(0)
        position = np.broadcast_to(world.position, (count, len(scene.bodies), 3)).copy()
        position[:, 0, 2] += np.where(rng.random(count) < 0.5, 0.0, 0.3)
        world.set_state(position=position)
        alone = World(scene, count=1)
        alone.set_state(position=position[-1:])
        for _ in range(12):
            world.advance(0.02)
            alone.advance(0.02)
        np.testing.assert_array_equal(world.position[-1], alone.position[0])
