"""Heaps of particle bodies: the same motion as the dense engine, whatever the threads and lists."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from physics.analysis.lane_queries import LaneQueries
from physics.granular.queries import GranularQueries
from physics.granular.simulation import GranularSimulation
from physics.granular.tables import SHEAR_LOAD
from physics.model import free_memory
from physics.reference.heaps import heap_scene
from physics.rotation import rotate
from physics.scene.drives import Drive
from physics.scene.fidelity import Fidelity
from physics.scene.material import Material
from physics.scene.particles import Particles
from physics.scene.ready_bodies import chess_piece, torus
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Sphere
from physics.scene.solids import Body, Ground, Static
from physics.step.simulation import Simulation
from physics.world import World

R = 0.02
STEP = 5e-4
FIDELITIES = {
    name: Fidelity(damping="dashpot", friction=name, substep=STEP)
    for name in ("viscous", "coulomb")
}
ROUGH = Material(friction=0.6, restitution=0.3)
ROLLS = Material(rolling_resistance=0.1)
BALL_AND_RING = (Body(Sphere(1)), Body(torus(1.0), position=(5, 0, 0)))


def simulation(scene, friction="coulomb", threads=1, count=1):
    return GranularSimulation(scene, FIDELITIES[friction], count, threads)


def advance(sim, steps):
    assert sim.advance(steps * STEP, sim.everyone)


def some_scene(mixed=True):
    """Rods, and if `mixed` spheres of other sizes and materials, over a ground with two walls."""
    draw = np.random.default_rng(3)
    rod, pair = chess_piece(R), Particles([[0, 0, R], [0, 0, -R]], 1.5 * R)
    soft = Material(friction=0.9, stiffness=3000.0)
    shapes = [rod, rod, Sphere(R), rod, pair, Sphere(1.5 * R), rod]
    materials = [ROUGH, ROUGH, Material(0.2, 0.6), ROUGH, soft, ROUGH, ROUGH]
    if not mixed:
        shapes, materials = [rod] * 7, [ROUGH] * 7
    bodies = [
        Body(
            shape, density=1000.0, material=material, orientation=tuple(draw.normal(size=4)),
            position=(0.03 * np.cos(2.1 * k), 0.03 * np.sin(2.1 * k), 0.1 + 0.07 * k),
            angular_velocity=(1.0, 2.0, 0.5 * k),
        )
        for k, (shape, material) in enumerate(zip(shapes, materials, strict=True))
    ]  # fmt: skip
    walls = [
        Static(Box((0.05, 0.5, 0.3)), position=(0.17, 0.0, 0.3)),
        Static(Box((0.5, 0.05, 0.3)), position=(0.0, -0.17, 0.3)),
    ]
    return Scene(bodies=bodies, statics=[Ground(material=ROUGH), *walls])


def small_heap(count=150, columns=4, friction=0.5):
    return heap_scene([chess_piece(R)] * count, columns, Material(friction, 0.3), seed=1)


def digest(sim):
    return hashlib.sha256(sim.state.dynamic.tobytes()).hexdigest()


def found_in(sim):
    return GranularQueries(sim).table(np.array([0]))


def kinetic_energy(sim):
    rows, omega = sim.state.dynamic[0], sim.angular_velocity()[0]
    linear = np.sum(rows["momentum"] ** 2 * sim.of_bodies("inverse_mass")[:, None])
    return 0.5 * (linear + np.sum(omega * rows["angular_momentum"]))


def potential_energy(sim):
    return float(-np.sum(sim.of_bodies("weight") * sim.state.dynamic[0]["position"]))


@pytest.mark.parametrize("friction", ["viscous", "coulomb"])
def test_bodies_move_as_in_the_dense_engine(friction, stress):
    """Until round-off has grown; with lists that are made again and bodies that are sorted."""
    # equal bodies have kernels of their own; the long form has both kinds at both frictions
    for mixed in (True, False) if stress else (friction == "coulomb",):
        scene, forces = some_scene(mixed), 0.0
        heap = simulation(scene, friction)
        dense = Simulation(scene, FIDELITIES[friction], 1, 1, False)
        for _ in range(60):
            advance(heap, 10)
            assert dense.advance(10 * STEP, dense.everyone)
            forces = max(forces, np.abs(dense.state.dynamic["force"][..., :2]).max())
            for name, scale in (("position", 1.0), ("orientation", 1.0), ("momentum", 0.1)):
                ours, theirs = heap.state.dynamic[name], dense.state.dynamic[name]
                assert np.abs(ours - theirs).max() < 1e-8 * scale, mixed
        assert forces > 1.0  # they have touched
        stored = LaneQueries(dense).elastic_energy()
        assert stored[0] > 1e-6
        assert GranularQueries(heap).elastic_energy() == pytest.approx(stored, rel=1e-6)


@pytest.mark.parametrize("friction", ["viscous", "coulomb"])
def test_results_do_not_depend_on_the_threads(friction):
    heaps = [simulation(small_heap(), friction, threads) for threads in (1, 2, 4)]
    for heap in heaps:
        advance(heap, 400)
    assert len({digest(heap) for heap in heaps}) == 1
    assert found_in(heaps[0]).penetration.max() > 0.0


def test_friction_forgets_how_many_contacts_bodies_had():
    heap = simulation(small_heap())
    advance(heap, 400)
    assert heap.heaps[0].motion[:, SHEAR_LOAD].max() > 0.1
    heap.forget(heap.everyone)
    assert not np.any(heap.heaps[0].motion[:, SHEAR_LOAD])


def test_the_refreshed_forces_and_a_report_agree():
    """Newton's third law, and the sum of the reported forces is the force on each body."""
    heap = simulation(small_heap())
    advance(heap, 400)
    heap.forget(heap.everyone)
    assert heap.refresh()
    found, bodies = found_in(heap), heap.bodies
    total = heap.of_bodies("weight").copy()
    np.add.at(total, found.pair[:, 0], found.force)
    inner = found.pair[:, 1] < bodies
    np.subtract.at(total, found.pair[inner, 1], found.force[inner])
    np.testing.assert_allclose(total, heap.state.dynamic[0]["force"], atol=1e-10)
    assert np.all(found.penetration > 0.0)
    assert inner.any()
    assert not inner.all()


@pytest.mark.parametrize("seed", range(6))
def test_no_contact_is_lost(seed):
    """The reported pairs are those of all particles that overlap; sizes differ by 1:20."""
    draw = np.random.default_rng(seed)
    radii = np.exp(draw.uniform(np.log(0.01), np.log(0.2), 60))
    bodies = [Body(Sphere(r), position=tuple(draw.uniform(-0.5, 0.5, 3))) for r in radii]
    rod = chess_piece(0.02)
    bodies += [
        Body(
            rod, position=tuple(draw.uniform(-0.5, 0.5, 3)), orientation=tuple(draw.normal(size=4))
        )
        for _ in range(120)
    ]
    # far away, for a kernel that `some_scene` has, too
    statics = [Ground(height=-50.0), Static(Box((1.0, 1.0, 1.0)), position=(50.0, 0.0, 0.0))]
    heap = simulation(Scene(bodies=bodies, statics=statics))
    assert heap.refresh()
    rows = heap.state.dynamic[0]
    for moved in (0.0, 0.05):  # the second time the list is older than the positions
        rows["position"] += draw.uniform(-moved, moved, rows["position"].shape)
        if moved:
            heap.forget(heap.everyone)
        owner = np.concatenate([np.arange(60), np.repeat(np.arange(60, 180), 4)])
        local = np.concatenate([np.zeros((60, 3)), np.tile(rod.points, (120, 1))])
        points = rows["position"][owner] + rotate(rows["orientation"][owner], local)
        size = np.concatenate([radii, np.full(480, 0.02)])
        apart = np.sqrt(np.sum((points[:, None] - points) ** 2, axis=-1))
        i, j = np.nonzero(np.triu(apart < size[:, None] + size, 1))
        expected = sorted((owner[a], owner[b]) for a, b in zip(i, j, strict=True)
                          if owner[a] != owner[b])  # fmt: skip
        assert sorted(map(tuple, found_in(heap).pair.tolist())) == expected


def test_no_contact_is_lost_on_the_way():
    """A list that is in use is complete: a second simulation makes one for the same state."""
    heap, fresh = simulation(small_heap(), "viscous"), simulation(small_heap(), "viscous")
    for _ in range(30):
        advance(heap, 50)
        fresh.state.dynamic[:] = heap.state.dynamic
        fresh.forget(fresh.everyone)
        pairs = [sorted(map(tuple, found_in(one).pair.tolist())) for one in (heap, fresh)]
        assert pairs[0] == pairs[1]
    assert len(pairs[0]) > 100


def test_a_collision_conserves_momentum():
    """Of two rods far from all statics, also angular momentum about the origin."""
    rod = chess_piece(R)
    bodies = [
        Body(rod, position=(-0.05, 0.0, 0.01), linear_velocity=(1.0, 0.0, 0.0), material=ROUGH),
        Body(rod, position=(0.05, 0.004, 0.0), angular_velocity=(3.0, 1.0, 0.0), material=ROUGH),
    ]
    # statics, so that it shares its kernel with the heaps
    far = [Ground(height=-9.0), Static(Box((0.1, 0.1, 0.1)), (9.0, 0.0, 0.0))]
    heap = simulation(Scene(bodies=bodies, statics=far, gravity=(0.0, 0.0, 0.0)))

    def total():
        rows = heap.state.dynamic[0]
        spin = rows["angular_momentum"] + np.cross(rows["position"], rows["momentum"])
        return np.concatenate([rows["momentum"].sum(axis=0), spin.sum(axis=0)])

    before, first = total(), heap.state.dynamic["momentum"].copy()
    advance(heap, 300)
    assert np.abs(heap.state.dynamic["momentum"] - first).max() > 0.01
    np.testing.assert_allclose(total(), before, atol=1e-14)


@pytest.mark.parametrize("friction", ["viscous", "coulomb"])
def test_a_heap_settles_and_never_gains_energy(friction):
    heap = simulation(small_heap(), friction)
    start = energy = kinetic_energy(heap) + potential_energy(heap)
    for _ in range(40):
        advance(heap, 100)
        # springs hold energy that they return, far less than what was lost
        present = kinetic_energy(heap) + potential_energy(heap)
        assert present < energy + 1e-3 * start
        energy = present
    advance(heap, 4000)
    assert kinetic_energy(heap) < 1e-4 * start
    # the load of the whole heap on one contact sinks by W/k; the pair mass of equal bodies is m/2
    mass = 1.0 / heap.of_bodies("inverse_mass")[0]
    k = 0.5 * mass * (heap.fidelity.contact_resolution / STEP) ** 2
    assert found_in(heap).penetration.max() < heap.bodies * mass * 9.81 / k


def test_a_copy_continues_bitwise_equal():
    heap = simulation(small_heap())
    advance(heap, 333)
    hidden, state = heap.saved(), heap.state.dynamic.copy()
    advance(heap, 200)
    expected = digest(heap)
    heap.state.dynamic[:] = state
    heap.restore(hidden)
    advance(heap, 200)
    assert digest(heap) == expected


def test_a_heap_that_outgrows_memory_says_so_and_stays_as_it_was(monkeypatch):
    sim = simulation(small_heap())
    before = sim.state.dynamic.tobytes()
    monkeypatch.setattr(free_memory, "free_bytes", lambda: 1e4)
    with pytest.raises(
        MemoryError, match=r"particles that are near .* 1e-05 GB of memory are free"
    ):
        advance(sim, 2000)
    assert sim.state.dynamic.tobytes() == before
    with pytest.raises(MemoryError, match="2 heaps of 150 bodies need"):
        simulation(small_heap(), count=2)
    monkeypatch.undo()
    advance(sim, 20)


def test_worlds_are_independent_and_masked():
    heap = simulation(small_heap(20), "viscous", count=2)
    assert heap.advance(100 * STEP, np.array([True, False]))
    alone = simulation(small_heap(20), "viscous")
    advance(alone, 100)
    assert heap.state.dynamic[0].tobytes() == alone.state.dynamic[0].tobytes()
    assert heap.state.world["time"].tolist() == [100 * STEP, 0.0]
    heap.reset(heap.everyone)
    assert heap.state.dynamic[0].tobytes() == heap.state.dynamic[1].tobytes()


def test_a_body_that_is_not_finite_is_named_and_the_others_keep_their_state():
    heap = simulation(small_heap(20), "viscous")
    advance(heap, 10)
    heap.state.dynamic["momentum"][0, 7, 1] = np.nan
    heap.forget(heap.everyone)
    assert not heap.advance(10 * STEP, heap.everyone)
    assert heap.failed("diverged") == [0]
    assert heap.state.world["diverged"].tolist() == [8]
    finite = np.isfinite(heap.state.dynamic["position"][0]).all(axis=1)
    assert np.flatnonzero(~finite).tolist() in ([], [7])
    heap.reset(heap.everyone)
    advance(heap, 10)


def test_a_body_that_leaves_the_box_falls_on():
    scene = small_heap(30)
    gone = replace(scene.bodies[4], position=(1e4, 0.0, 50.0), mass=None)
    bodies = [*scene.bodies[:4], gone, *scene.bodies[5:]]
    heap = simulation(replace(scene, bodies=bodies), "viscous")
    advance(heap, 200)
    expected = 50.0 - 0.5 * 9.81 * (200 * STEP) ** 2
    assert heap.state.dynamic["position"][0, 4, 2] == pytest.approx(expected)


def test_the_readout_shows_the_state():
    heap = simulation(small_heap(20), "viscous")
    advance(heap, 100)
    shown, rows = heap.readout(), heap.state.dynamic
    np.testing.assert_array_equal(shown.position, rows["position"])
    velocity = rows["momentum"] * heap.of_bodies("inverse_mass")[:, None]
    np.testing.assert_array_equal(shown.linear_velocity, velocity)
    np.testing.assert_allclose(shown.angular_velocity, heap.angular_velocity(), rtol=1e-12)


@pytest.mark.parametrize(
    ("scene", "fidelity", "reason"),
    [
        ({"bodies": [Body(Box((1, 1, 1)))]}, {}, "must be Particles or Sphere, got Box"),
        ({"drives": [Drive(Sphere(1), mass=1.0, force_limit=9.0)]}, {}, "drives must be empty"),
        ({"bodies": [Body(Sphere(1), group=2)]}, {}, r"bodies\[0\] must have the default group"),
        ({"bodies": [Body(Sphere(1), material=ROLLS)]}, {}, "resistance must be 0, got 0.1"),
        ({"bodies": [Body(Particles([[0, 0, 0]], 1.0))]}, {}, "must be a Sphere instead"),
        ({}, {"damping": "hunt_crossley"}, "damping must be 'dashpot', got 'hunt_crossley'"),
        ({}, {"integrator": "rk4"}, "integrator must be 'midpoint' or 'euler', got 'rk4'"),
        ({"bodies": BALL_AND_RING}, {"geometry": "particle"}, "geometry must be 'shape'"),
    ],
)  # fmt: skip
def test_what_is_not_supported_is_named(scene, fidelity, reason):
    scene = Scene(**{"bodies": [Body(Sphere(1), position=(5, 0, 0))], **scene})
    asked = replace(FIDELITIES["viscous"], **fidelity)
    with pytest.raises(ValueError, match=reason):
        GranularSimulation(scene, asked, 1, 1)


def test_ready_bodies_have_principal_axes():
    assert len(chess_piece(0.1).positions) == 4
    ring = torus(0.1)
    assert np.linalg.norm(ring.points[0] - ring.points[1]) == pytest.approx(0.2)
    with pytest.raises(ValueError, match="torus balls"):
        torus(0.1, balls=2)


@pytest.mark.parametrize("friction", ["viscous", "coulomb"])
def test_worlds_of_many_particle_bodies_are_heaps(friction):
    scene = heap_scene([chess_piece(R)] * 40, 4, ROUGH)
    world = World(scene, FIDELITIES[friction])
    assert isinstance(world._simulation, GranularSimulation)
    world.advance(0.4)
    saved, deepest = world.snapshot(), world.penetration()[0]
    contacts = world.contacts()
    assert deepest == contacts.penetration.max() > 0.0
    world.advance(0.05)
    after = world.position.copy()
    world.restore(saved)
    assert world.penetration()[0] == deepest
    world.advance(0.05)
    assert np.array_equal(world.position, after)
    assert world.samples(0)[0].shape == (4, 3)
    assert STEP < world.largest_stable_step() < 10.0 * STEP
    with pytest.raises(ValueError, match="apply_wrench is not offered in a heap of 40 bodies"):
        world.apply_wrench(force=(0.0, 0.0, 1.0), body=0)
    with pytest.raises(ValueError, match="first_touch is not recorded"):
        world.first_touch(0, 1)


def test_a_stiffness_that_is_too_large_for_a_heap_is_refused():
    scene = heap_scene([chess_piece(R)] * 40, 4, Material(0.5, stiffness=1e8))
    with pytest.raises(ValueError, match="makes the substep of"):
        World(scene, FIDELITIES["viscous"])
