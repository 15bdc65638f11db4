"""Newton's method solves for all contacts at once: nearly rigid piles at long steps."""

import math
from dataclasses import replace

import numpy as np
import pytest

from physics import Body, Box, Fidelity, Ground, Hinge, Material, Scene, World
from physics.compiler.jit import LANES
from physics.impulse import blocks
from physics.model.impulse_rows import BLOCK, BLOCK_VECTOR
from physics.reference import scenes
from physics.reference.measures import energy_gain, grazing
from physics.reference.scenes import GRAVITY, settled
from physics.scene.fidelity import NEWTON

LONG = replace(NEWTON, substep=0.02)
MASS, WIDTH = 0.064, 0.04  # of a tower's cube


_ARM = Body(Box((0.02, 0.02, 0.02)), mass=0.1, position=(0, 0, 0.1), name="arm")
HINGED = Scene([_ARM], [Ground()], joints=[Hinge("arm", None, anchor=(0, 0, 0.2), axis=(0, 1, 0))])


def interfaces(masses, fidelity):
    """m by which each body of a tower sinks into what is below it: load / stiffness."""
    loads = GRAVITY * np.cumsum(masses[::-1])[::-1]
    below = np.concatenate([[np.inf], masses[:-1]])
    pair_masses = 1.0 / (1.0 / masses + 1.0 / below)
    return loads / (pair_masses * (fidelity.contact_resolution / fidelity.substep) ** 2)


def heavy_tower(ratio):
    """Five cubes of 64 g and one that is `ratio` times as heavy."""
    below = scenes.tower(5)
    top = Body(
        Box((0.02, 0.02, 0.02)), mass=MASS * ratio, position=(0, 0, 5.5 * WIDTH),
        material=below.bodies[0].material,
    )  # fmt: skip
    return Scene([*below.bodies, top], below.statics)


# --- the matrix ---------------------------------------------------------------------------------


def test_blocks_are_solved_as_a_dense_matrix_is():
    """Six rows of blocks, some of which are zero at first and fill in."""
    rng, rows = np.random.default_rng(1), 6
    linked = {(1, 0), (2, 1), (3, 0), (4, 2), (5, 3), (5, 4)}
    dense = np.zeros((LANES, 3 * rows, 3 * rows))
    for a, b in linked:
        J = np.zeros((LANES, 4, 3 * rows))
        J[:, :, 3 * a : 3 * a + 3] = rng.normal(size=(LANES, 4, 3))
        J[:, :, 3 * b : 3 * b + 3] = rng.normal(size=(LANES, 4, 3))
        dense += 1e3 * np.swapaxes(J, 1, 2) @ J
    dense += np.eye(3 * rows)
    right = rng.normal(size=(LANES, 3 * rows))

    matrix = np.zeros(rows * (rows + 1) // 2, BLOCK).view(np.recarray)
    vectors = np.zeros(rows, BLOCK_VECTOR).view(np.recarray)
    for a in range(rows):
        vectors[a].component[:] = right[:, 3 * a : 3 * a + 3].T
        for b in range(a + 1):
            block = matrix[blocks.block_index(a, b)]
            block.used = int(a == b or (a, b) in linked)
            entries = dense[:, 3 * a : 3 * a + 3, 3 * b : 3 * b + 3].reshape(LANES, 9).T
            block.entry[:] = entries.ravel() if block.used else np.nan
    blocks.factor(matrix, np.zeros(9 * LANES), rows)
    blocks.solve(matrix, vectors, rows)
    found = np.concatenate([vectors[a].component for a in range(rows)]).T
    expected = np.linalg.solve(dense, right[:, :, None])[:, :, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


# --- piles --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("cubes", "step"), [(5, 0.02), (10, 0.02), (10, 2e-3), (20, 8e-3)])
def test_a_tower_stands_and_sinks_as_its_stiffness_says(cubes, step, stress):
    fidelity = replace(NEWTON, substep=step)
    world = settled(scenes.tower(cubes), fidelity)
    start = world.position.copy()
    world.advance(60.0 if stress else 4.0)
    assert np.abs(world.position - start).max() < 1e-5
    sinks = cubes * WIDTH - WIDTH / 2 - world.position[0, -1, 2]
    expected = interfaces(np.full(cubes, MASS), fidelity).sum()
    assert sinks == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("ratio", "step"), [(250.0, 8e-3), (1000.0, 1e-3)])
def test_a_light_tower_supports_a_heavy_cube(ratio, step):
    fidelity = replace(NEWTON, substep=step)
    world = settled(heavy_tower(ratio), fidelity)
    start = world.position.copy()
    world.advance(4.0)
    assert np.abs(world.position - start).max() < 1e-5
    sinks = 5.5 * WIDTH - world.position[0, -1, 2]
    expected = interfaces(np.array([MASS] * 5 + [MASS * ratio]), fidelity).sum()
    assert sinks == pytest.approx(expected, rel=0.02)


def test_contacts_support_what_is_above_them():
    world = settled(scenes.tower(5), LONG, time=2.0)
    told = world.contacts()
    pairs = np.sort(told.pair, axis=-1)
    for below in range(4):
        here = np.all(pairs == (below, below + 1), axis=-1)
        force = np.abs(told.force[here, 2]).sum()
        assert force == pytest.approx(MASS * GRAVITY * (4 - below), rel=1e-4)


def test_a_world_does_not_depend_on_its_neighbours_or_on_threads():
    """One of the worlds is a tower that is being knocked over, so the solutions differ."""
    scene, count = scenes.tower(5), 2 * LANES + 1
    speed = np.zeros((count, 5, 3))
    speed[:, 4, 0] = np.linspace(0.0, 2.0, count)
    speed[:, 2, 1] = np.linspace(-1.0, 1.0, count)
    together = World(scene, LONG, count, threads=2)
    together.set_state(linear_velocity=speed)
    together.advance(0.6)
    for n in (0, 7, count - 1):
        alone = World(scene, LONG)
        alone.set_state(linear_velocity=speed[n : n + 1])
        alone.advance(0.6)
        np.testing.assert_array_equal(alone.position[0], together.position[n])
        np.testing.assert_array_equal(alone.linear_velocity[0], together.linear_velocity[n])


def test_a_tower_with_masses_of_its_own_stands_alike(stress):
    """Masses as parameters of each world give what the same masses in the scene give."""
    if not stress:
        pytest.skip("a kernel of its own for ten seconds; see make stress")
    world = World(scenes.tower(5), LONG, 2, per_world_parameters=True)
    heavier = np.array([[MASS] * 5, [MASS, MASS, MASS, MASS, 10 * MASS]])
    world.set_parameters(mass=heavier)
    world.advance(2.0)
    for n in range(2):
        sinks = 4.5 * WIDTH - world.position[n, -1, 2]
        expected = interfaces(heavier[n], LONG).sum()
        assert sinks == pytest.approx(expected, rel=0.01)


def test_a_tower_that_is_knocked_over_gains_no_energy_and_comes_to_rest():
    """Fast impacts and deep overlaps are left to sweeps."""
    world = World(scenes.tower(5), NEWTON, 64)
    speed = np.zeros((64, 5, 3))
    speed[:, 3:, 0] = np.linspace(0.2, 3.0, 64)[:, None]
    world.set_state(linear_velocity=speed)
    start = world.kinetic_energy() + world.potential_energy()
    for _ in range(150):
        world.advance(0.04)
        now = world.kinetic_energy() + world.potential_energy()
        assert (now - start).max() < 1e-12
    assert np.abs(world.linear_velocity).max() < 1e-4
    assert (world.position[:, :, 2] > 0.019).all()


# --- collisions and friction --------------------------------------------------------------------


@pytest.mark.parametrize(("restitution", "friction"), [(0.95, 0.5), (0.0, 0.5)])
def test_no_collision_gains_energy_or_momentum(restitution, friction):
    cube = Box((0.02, 0.02, 0.02))
    world = grazing((cube, cube), restitution, friction, NEWTON, 1200)
    momentum = world.linear_momentum()
    assert energy_gain(world) <= 1e-9
    assert np.abs(world.linear_momentum() - momentum).max() < 1e-15


@pytest.mark.parametrize("speed", [2.0, 0.5])
def test_a_block_stops_after_v_squared_over_two_mu_g(speed):
    scene = scenes.block_on_ground(friction=0.5)
    world = settled(scene, NEWTON, time=0.2)
    start = world.position[0, 0, 0]
    world.set_state(linear_velocity=np.array([[[speed, 0.0, 0.0]]]))
    world.advance(1.0)
    exact = speed**2 / (2.0 * 0.5 * GRAVITY)
    assert world.position[0, 0, 0] - start == pytest.approx(exact, rel=5e-3)
    assert np.abs(world.linear_velocity).max() < 1e-5


@pytest.mark.parametrize(("degrees", "creep"), [(10.0, 1e-7), (20.0, 1e-7), (26.0, 2e-5)])
def test_a_block_below_the_angle_of_friction_stays(degrees, creep):
    """Close to the angle of friction, 26.57 degrees, points slide in turn."""
    scene = scenes.block_on_ground(friction=0.5, angle=math.radians(degrees))
    world = settled(scene, LONG)
    start = world.position.copy()
    world.advance(2.0)
    assert np.abs(world.position - start).max() / 2.0 < creep


# --- what it doesn't solve ----------------------------------------------------------------------


def test_springs_need_no_solver():
    with pytest.raises(ValueError, match=r"Fidelity.solver 'newton' requires law='impulse'"):
        Fidelity(solver="newton")


def test_the_largest_contact_resolution_belongs_to_the_solver():
    with pytest.raises(ValueError, match=r"contact_resolution with solver='newton'.*100"):
        replace(NEWTON, contact_resolution=101.0)
    with pytest.raises(ValueError, match=r"contact_resolution with law='impulse'.*2"):
        replace(NEWTON, solver="gauss_seidel")


RESISTING = scenes.block_on_ground().bodies[0]
RESISTING = replace(RESISTING, material=Material(rolling_resistance=1e-3))


@pytest.mark.parametrize(
    ("scene", "what"),
    [
        (HINGED, "the scene has 1 joints"),
        (scenes.push_like(), "the scene has 1 driven solids"),
        (Scene([RESISTING], [Ground()]), "the scene has rolling or spinning resistance"),
        (scenes.pyramid(10), "got engine='bodies' for 55 bodies"),
    ],
)
def test_a_scene_that_newton_cannot_solve_is_refused(scene, what):
    message = f"free bodies with engine='worlds'; {what}: use solver='gauss_seidel'"
    with pytest.raises(ValueError, match=message):
        World(scene, NEWTON)
