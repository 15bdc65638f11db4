"""The list of near pairs is complete, whatever the sizes, and stays so until a body leaves it."""

import numpy as np
import pytest

from physics import Body, Box, Capsule, Fidelity, Ground, Material, Scene, Sphere, Static
from physics.manybody.kinds import find_kinds
from physics.manybody.pair_lists import PairLists
from physics.manybody.simulation import CrowdSimulation
from physics.rotation import rotate_back

FIDELITY = Fidelity()


def scattered(seed, largest, count=120):
    """Balls, boxes and capsules of sizes up to 1 : `largest`, some of them overlapping."""
    random = np.random.default_rng(seed)
    sizes = 0.01 * np.array([1.0, largest ** (1 / 3), largest ** (2 / 3), largest])
    reach = 12.0 * sizes.mean()
    bodies = []
    for n in range(count):
        r = float(sizes[random.integers(4)])
        shape = [Sphere(r), Box((r, 0.5 * r, 0.7 * r)), Capsule(0.4 * r, 0.6 * r)][n % 3]
        bodies.append(
            Body(
                shape,
                position=tuple(random.uniform(-reach, reach, 3)),
                orientation=tuple(random.normal(size=4)),
            )
        )
    tilted = Static(Box((reach, 0.3, 0.2)), orientation=(0.1, 0.2, 0.3, 0.9))
    return Scene(bodies, [Ground(height=-0.5 * reach), tilted])


def reaches_of(simulation):
    """Centres and bounding radii of bodies."""
    return simulation.state.dynamic["position"][0], np.array([
        body.shape.reach for body in simulation.scene.bodies
    ])  # fmt: skip


@pytest.mark.parametrize("largest", [1.0, 3.0, 20.0])
def test_every_pair_whose_surfaces_are_nearer_than_the_margins_is_found(largest, stress):
    for seed in range(4 if stress else 2):
        missed, found, solids = search(seed, largest)
        assert missed == 0, seed
        assert found < 0.5 * solids**2, seed


def search(seed, largest):
    """Near pairs that are missed and those that are found among scattered solids; their number."""
    simulation = CrowdSimulation(scattered(seed, largest), FIDELITY, 1, 1, False)
    lists, crowd = simulation._lists[0], simulation.arrays(0)[0]
    simulation._load(simulation.state.dynamic, 0, crowd)
    simulation._place(crowd)
    lists.search(crowd)
    places = lists._places
    found = {divmod(int(key), places) for key in lists.found}
    assert len(found) == len(lists.found)
    # samples of a body that are nearer to the surface of another than both margins
    margin, solids = lists._least_margin, [*simulation.scene.bodies, *simulation.scene.statics]
    first_static = len(simulation.mechanisms.body)
    bodies = np.arange(simulation.bodies)
    points = np.stack([surface_of(body) for body in simulation.scene.bodies])
    missed = 0
    for j, other in enumerate(solids):
        q = j if j < simulation.bodies else first_static + j - simulation.bodies
        near = distance(other, points) < margin[bodies] + margin[q] - 1e-12
        for i in np.flatnonzero(near & (bodies != j)):
            if (i, q) not in found and (q, i) not in found:
                missed += 1
    return missed, len(found), len(solids)


def surface_of(body):
    """Points of a body's core [n, 3] in the world, with its rounding subtracted later."""
    random = np.random.default_rng(1)
    directions = random.normal(size=(60, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    shape = body.shape
    if isinstance(shape, Sphere):
        own = shape.radius * directions
    elif isinstance(shape, Capsule):
        own = shape.radius * directions
        own[:, 2] += np.sign(own[:, 2]) * shape.half_length
    else:
        own = np.clip(2.0 * directions, -1.0, 1.0) * shape.half_extents
    return np.array(body.position) - rotate_back(np.array(body.orientation) * [-1, -1, -1, 1], -own)


def distance(solid, points):
    """m, of the nearest of the points [bodies, n, 3] of each body from a solid."""
    if isinstance(solid, Ground):
        return (points[..., 2] - solid.height).min(axis=-1)
    own = rotate_back(np.array(solid.orientation), points - np.array(solid.position))
    shape = solid.shape
    if isinstance(shape, Sphere):
        return (np.linalg.norm(own, axis=-1) - shape.radius).min(axis=-1)
    if isinstance(shape, Capsule):
        own[..., 2] -= np.clip(own[..., 2], -shape.half_length, shape.half_length)
        return (np.linalg.norm(own, axis=-1) - shape.radius).min(axis=-1)
    outside = np.maximum(np.abs(own) - shape.half_extents, 0.0)
    return np.linalg.norm(outside, axis=-1).min(axis=-1)


def test_solids_that_filters_keep_apart_are_no_pairs():
    cube = Box((0.02, 0.02, 0.02))
    bodies = [
        Body(cube, position=(0.03 * n, 0.0, 0.0), group=1 + n % 2, mask=1 + n % 2)
        for n in range(40)
    ]
    simulation = CrowdSimulation(Scene(bodies), FIDELITY, 1, 1, False)
    lists, crowd = simulation._lists[0], simulation.arrays(0)[0]
    simulation._load(simulation.state.dynamic, 0, crowd)
    simulation._place(crowd)
    lists.search(crowd)
    pairs = np.stack(np.divmod(lists.found, lists._places))
    assert len(lists.found) > 0
    assert np.all(np.diff(pairs % 2, axis=0) == 0)


def test_kinds_are_built_once_however_many_bodies_there_are():
    cube, ball = Box((0.02, 0.02, 0.02)), Sphere(0.02)
    bodies = [Body(cube if n % 2 else ball, position=(0.1 * n, 0.0, 0.1)) for n in range(400)]
    heavy = Body(ball, density=5000.0, position=(0.0, 0.0, 5.0), material=Material(0.1))
    kinds = find_kinds(Scene([*bodies, heavy], [Ground()]), FIDELITY)
    assert len(kinds.pair) == 4  # ball, cube, heavy ball, ground
    # ball and cube each with itself, the three with each other and with the ground
    assert len(kinds.pair_kind) == 2 + 3 + 3
    assert isinstance(PairLists, type)
