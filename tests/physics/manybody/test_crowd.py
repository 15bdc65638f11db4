"""Worlds of many bodies behave as those of few, and don't depend on the number of threads."""

import copy
import pickle

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Capsule,
    Compound,
    ContactOverflow,
    Cylinder,
    Fidelity,
    Ground,
    Material,
    Mesh,
    Part,
    Scene,
    SimulationDiverged,
    Sphere,
    World,
)
from physics.analysis.lane_queries import LaneQueries
from physics.manybody import simulation as many
from physics.model import free_memory
from physics.step.simulation import Simulation
from tests.physics.manybody.scenes import HALF, heap, wall

CUBE = Box((HALF, HALF, HALF))


@pytest.fixture(autouse=True)
def _threads_for_few_pairs(monkeypatch):
    monkeypatch.setattr(many, "_FEWEST_BATCHES", 2)


def state_of(world):
    dynamic = world._simulation.state.dynamic
    return b"".join(
        dynamic[name].tobytes()
        for name in ("position", "orientation", "momentum", "angular_momentum")
    )


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_a_heap_is_that_of_all_pairs_and_bitwise_the_same_for_1_2_and_4_threads(law, stress):
    worlds = [World(heap(34), law, threads=n) for n in (1, 2, 4)]
    assert all(isinstance(world._simulation, many.CrowdSimulation) for world in worlds)
    assert state_of(worlds[0]) == state_of(worlds[1])
    all_pairs = Simulation(heap(34), worlds[0].fidelity, 1, 1, False, kernel="general")
    apart = []
    for _ in range(20 if stress else 12):  # they meet in the fourth
        for world in worlds:
            world.advance(0.02)
        all_pairs.advance(0.02, all_pairs.everyone)
        assert state_of(worlds[0]) == state_of(worlds[1]) == state_of(worlds[2])
        apart.append(np.abs(worlds[0].position - all_pairs.state.dynamic["position"]).max())
    # Sums in another order differ by round-off, which grows once the first cubes have collided;
    # impulses are swept in another order, so they converge in another way
    assert max(apart[:3]) < 1e-15
    assert max(apart[:4]) < (1e-15 if law == "balanced" else 1e-4)
    assert worlds[0].position[0, :, 2].min() > 0.8 * HALF


def mixture() -> Scene:
    """Columns of two bodies of all shapes, the upper one a little beside the lower one's centre."""
    half, m = HALF, Material(friction=0.5)
    corners = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
             (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
    shapes = [
        Sphere(half), CUBE, Capsule(half, half), Cylinder(half, half),
        Compound([Part(CUBE, (-half, 0.0, 0.0)), Part(CUBE, (half, 0.0, 0.0))]),
        Mesh(vertices=corners, faces=faces, cells=8),
    ]  # fmt: skip
    low = [Body(shapes[k % 6], density=500.0, position=(0.12 * (k % 6), 0.12 * (k // 6), 0.045),
                material=m) for k in range(18)]  # fmt: skip
    high = [Body(shapes[(k + k // 6) % 6], density=500.0, material=m,
                 position=(0.12 * (k % 6) + 0.003, 0.12 * (k // 6) + 0.005, 0.13))
            for k in range(18)]  # fmt: skip
    return Scene([*low, *high], [Ground(m)])


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_bodies_of_all_shapes_touch_as_among_all_pairs(law):
    world = World(mixture(), law)
    all_pairs = Simulation(mixture(), world.fidelity, 1, 1, False, kernel="general")
    apart = []
    for _ in range(12):
        world.advance(0.02)
        all_pairs.advance(0.02, all_pairs.everyone)
        apart.append(np.abs(world.position - all_pairs.state.dynamic["position"]).max())
    # round-off grows after the first touch; impulses converge in another way
    assert max(apart[:3]) < (1e-15 if law == "balanced" else 1e-3)
    assert max(apart) < (1e-4 if law == "balanced" else 5e-3)
    kinds = {type(world.scene.bodies[i].shape) for i in world.contacts().pair.ravel() if i < 36}
    assert len(kinds) == 6
    assert np.abs(world.linear_velocity).max() < 2.0  # m/s; they have fallen by less than 10 cm


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_bodies_that_cannot_touch_fall_freely(law):
    cubes = [Body(CUBE, position=(0.1 * k, 0.0, 1.0), mask=0) for k in range(33)]
    world = World(Scene(cubes), law, kernel="special")  # no other test has the general one
    world.advance(0.1)
    assert world.position[0, :, 2] == pytest.approx(1.0 - 0.5 * 9.81 * 0.01)


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_a_wall_rests_with_the_weight_of_its_cubes_on_the_ground(law):
    world = World(wall(12, 3), law)
    world.advance(2.0)
    assert np.abs(world.linear_velocity).max() < 2e-3
    contacts, bodies = world.contacts(), len(world.scene.bodies)
    on_ground = contacts.pair.max(axis=1) >= bodies
    weight = sum(body.mass for body in world.scene.bodies) * 9.81
    assert contacts.force[on_ground, 2].sum() == pytest.approx(weight, rel=0.1)
    assert contacts.normal[on_ground, 2] == pytest.approx(np.ones(on_ground.sum()))
    assert world.normal_force(0, "static 0") == pytest.approx(3 * world.scene.bodies[0].mass * 9.81,
                                                              rel=0.25)  # fmt: skip
    assert 0.0 <= world.first_touch(0, "static 0")[0] < 0.1
    assert np.isnan(world.first_touch(0, 35)[0])
    assert world.normal_force(0, 35)[0] == 0.0
    assert world.penetration()[0] == contacts.penetration.max()
    assert world.penetration()[0] < 0.1 * HALF
    assert np.abs(world.position[0, :, :2] - [b.position[:2] for b in world.scene.bodies]).max() < (
        1e-3
    )


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_snapshots_copies_and_resets_continue_bitwise(law):
    world = World(heap(40, seed=1), law)
    world.advance(0.3)
    saved = world.snapshot()
    copied, pickled = copy.deepcopy(world), pickle.loads(pickle.dumps(world))
    for other in (world, copied, pickled):
        other.advance(0.1)
    assert state_of(world) == state_of(copied) == state_of(pickled)
    after = state_of(world)
    world.restore(saved)
    world.advance(0.1)
    assert state_of(world) == after
    world.reset()
    assert world.time[0] == 0.0
    world.advance(0.3)
    world.advance(0.1)
    assert state_of(world) == after


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_momentum_and_angular_momentum_are_conserved_without_walls(law):
    scene = heap(40, seed=2)
    bodies = [
        Body(CUBE, density=500.0, position=b.position, orientation=b.orientation,
             linear_velocity=tuple(-4.0 * np.array(b.position)), angular_velocity=(5.0, 0.0, -3.0))
        for b in scene.bodies
    ]  # fmt: skip
    world = World(Scene(bodies, [Ground(height=-100.0)], gravity=(0.0, 0.0, 0.0)), law)
    before = world.linear_momentum()[0], world.angular_momentum()[0]
    energy = world.kinetic_energy()[0]
    world.advance(0.2)
    assert len(world.contacts().force) > 10
    assert world.linear_momentum()[0] == pytest.approx(before[0], abs=1e-12)
    assert world.angular_momentum()[0] == pytest.approx(before[1], abs=1e-12)
    assert world.kinetic_energy()[0] < 0.9 * energy


def test_worlds_of_one_call_are_independent():
    three = World(heap(40), "balanced", count=3)
    three.set_state(linear_velocity=(0.5, 0.0, 0.0), worlds=np.array([False, True, False]))
    alone = World(heap(40), "balanced")
    three.advance(0.2)
    alone.advance(0.2)
    assert np.array_equal(three.position[0], alone.position[0])
    assert np.array_equal(three.position[2], alone.position[0])
    assert not np.array_equal(three.position[1], alone.position[0])
    three.advance(0.02, worlds=np.array([True, False, False]))
    assert three.time.tolist() == pytest.approx([0.22, 0.2, 0.2])


def test_a_body_that_is_not_finite_is_named_and_the_other_worlds_are_whole():
    world = World(heap(40), "balanced", count=2)
    world.advance(0.1)
    velocity = np.zeros((1, 40, 3))
    velocity[0, 7] = 1e200
    world.set_state(linear_velocity=velocity, worlds=np.array([True, False]))
    with pytest.raises(SimulationDiverged, match="body 7") as failed:
        world.advance(0.1)
    assert failed.value.worlds == [0]
    assert np.isfinite(world.position[1]).all()
    world.reset(np.array([True, False]))
    world.advance(0.1)


def test_a_wrench_lifts_one_cube():
    world = World(wall(12, 3), "balanced")
    world.advance(0.5)
    world.apply_wrench(force=(0.0, 0.0, 1.0), body=30)
    before = world.position[0, :, 2].copy()
    world.advance(0.1)
    risen = world.position[0, :, 2] - before
    assert risen[30] > 0.01
    assert np.abs(np.delete(risen, 30)).max() < 2e-3


def test_the_largest_stable_step_and_elastic_energy_are_those_of_all_pairs():
    world = World(heap(34), "balanced")
    all_pairs = Simulation(heap(34), world.fidelity, 1, 1, False, kernel="general")
    world.advance(0.1)
    all_pairs.advance(0.1, all_pairs.everyone)
    expected = LaneQueries(all_pairs)
    assert world.largest_stable_step() == pytest.approx(expected.largest_stable_step(0), rel=1e-5)
    stored = expected.elastic_energy()
    assert stored[0] > 1e-6
    assert world.elastic_energy() == pytest.approx(stored, rel=1e-9)


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_a_world_that_outgrows_memory_says_so_and_stays_as_it_was(monkeypatch, law):
    world = World(heap(40), law)
    before = state_of(world)
    monkeypatch.setattr(free_memory, "free_bytes", lambda: 1e4)
    with pytest.raises(MemoryError, match="pairs of bodies that are near each other need"):
        world.advance(0.02)
    assert state_of(world) == before
    with pytest.raises(MemoryError, match=r"3 worlds of this scene need .* take fewer bodies"):
        World(heap(40), law, count=3)
    monkeypatch.undo()
    world.advance(0.02)
    other = World(heap(40), law)
    other.advance(0.02)
    assert state_of(world) == state_of(other)


def test_memory_and_pairs_grow_with_the_number_of_bodies():
    small, large = World(wall(20, 2), "balanced"), World(wall(400, 2), "balanced")
    for world in (small, large):
        world.advance(0.02)
    assert large.nbytes / 800 < 1.2 * small.nbytes / 40
    assert large._simulation.model.half_pair.size == 0


def test_the_samples_of_a_solid_are_those_of_its_own_spacing():
    world = World(heap(40), "balanced")
    points, radius = world.samples(0)
    assert points.shape == (20, 3)  # corners and the middles of edges
    assert radius == pytest.approx(0.025 * HALF)
    assert len(world.samples("static 0")[0]) == 0  # the ground


def test_what_is_not_recorded_says_so():
    world = World(heap(40), "balanced")
    with pytest.raises(ValueError, match=r"first_touch_position is not recorded in a world of 40"):
        world.first_touch_position(0, "static 0")
    with pytest.raises(ValueError, match="must be solids that can touch"):
        world.first_touch("static 0", "static 1")


def test_a_stiffness_that_is_too_large_for_the_step_is_refused():
    cubes = wall(12, 3)
    stiff = [
        Body(CUBE, density=500.0, position=b.position,
             material=type(b.material)(friction=0.6, stiffness=1e6))
        for b in cubes.bodies
    ]  # fmt: skip
    with pytest.raises(ValueError, match="the largest safe step is"):
        World(Scene(stiff, cubes.statics), Fidelity())


@pytest.mark.parametrize("law", ["balanced", "solid"])
def test_queries_tell_of_the_restored_state_and_change_no_bit(law):
    world, other = World(heap(40), law), World(heap(40), law)
    for one in (world, other):
        one.advance(0.3)
    deepest, saved = world.penetration()[0], world.snapshot()
    world.advance(0.1)
    world.restore(saved)
    assert world.penetration()[0] == deepest
    force = world.contacts().force
    fresh = World(heap(40), law)
    fresh.restore(saved)
    assert fresh.penetration()[0] == deepest
    assert np.array_equal(fresh.contacts().force, force)
    for one in (world, other):
        one.apply_wrench(force=(0.2, 0.0, 0.0), body=5)
        one.advance(0.02)
    for _ in range(3):
        world.contacts()
        world.force()
    for one in (world, other):
        one.advance(0.04)
    assert state_of(world) == state_of(other)


def test_a_call_that_is_interrupted_changes_nothing(monkeypatch):
    world = World(heap(40), "balanced")
    world.advance(0.3)
    before, search, calls = state_of(world), many.PairLists.search, []

    def interrupted(lists, crowd):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return search(lists, crowd)

    monkeypatch.setattr(many.PairLists, "search", interrupted)
    with pytest.raises(KeyboardInterrupt):
        world.advance(0.2)
    assert state_of(world) == before
    assert world.time[0] == pytest.approx(0.3)
    monkeypatch.setattr(many.PairLists, "search", search)
    world.advance(0.1)
    assert np.abs(world.position[0, :, :2]).max() < 0.3
    assert world.position[0, :, 2].min() > 0.5 * HALF


def test_too_many_pairs_of_particles_are_an_error():
    close = [
        Body(CUBE, position=(2.5 * HALF * n, 0.0, HALF), material=wall(1, 1).bodies[0].material)
        for n in range(40)
    ]
    world = World(Scene(close), Fidelity(geometry="particle", spacing=0.1, skin=1.0))
    with pytest.raises(ContactOverflow):
        world.advance(0.01)
