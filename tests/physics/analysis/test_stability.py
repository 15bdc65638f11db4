"""The largest stable step is where theory says: the step is swept across it, from 0.02 on."""

import math

import numpy as np
import pytest

from physics import (
    PRESETS,
    Body,
    Box,
    Capsule,
    Compound,
    Drive,
    Fidelity,
    Ground,
    Material,
    Scene,
    SimulationDiverged,
    Sphere,
    Static,
    World,
)
from physics.analysis.contact_system import ContactSystem
from physics.reference import scenes

# two slabs on each other: the lower one touches the ground, the upper one what is on it
SLABS = Compound([(Box((0.02, 0.02, 0.01)), (0, 0, z)) for z in (-0.01, 0.01)])
LYING = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))


def scene(kind, restitution):
    """Bodies whose contacts have a given stiffness, and so a largest step."""
    material = Material(0.5, restitution, stiffness=2e4)
    cube = scenes.CUBE
    bodies = {
        "ball": [(Sphere(0.02), 0.1, 0.02)],
        "cube": [(cube, 0.1, 0.02)],
        "capsule": [(Capsule(0.02, 0.03), 0.1, 0.02)],
        "slab": [(Box((0.04, 0.04, 0.01)), 0.1, 0.01)],
        "cube on compound": [(SLABS, 0.1, 0.02), (cube, 0.1, 0.06)],
        "two cubes": [(cube, 0.1, 0.02), (cube, 0.1, 0.06)],
        "light on heavy": [(cube, 1.0, 0.02), (cube, 0.05, 0.06)],
    }[kind]
    turn = LYING if kind == "capsule" else (0, 0, 0, 1)
    # out of reach, for a kernel that other scenes have, too
    far = [Static(cube, (0, 0, 9.0), material=material)] if isinstance(bodies[0][0], Box) else []
    return Scene(
        [
            Body(shape, mass=mass, position=(0, 0, z), orientation=turn, material=material)
            for shape, mass, z in bodies
        ],
        [Ground(material), *far],
    )


def at_rest(world, start):
    """Puts a world into the state of one at rest."""
    shape = (world.count, *start.position.shape[1:])
    world.set_state(
        position=np.broadcast_to(start.position, shape),
        orientation=np.broadcast_to(start.orientation, (*shape[:2], 4)),
    )


def predicted(some, damping, start):
    """Largest stable step in s; friction's damping depends on the step, so it is a fixed point."""
    step = 1e-3
    for _ in range(6):
        world = World(some, Fidelity(substep=step, damping=damping), allow_unstable=True)
        at_rest(world, start)
        step = world.largest_stable_step()
    return step


def runs_away(some, damping, start, step, patience):
    """Whether slight disturbances grow at a step.

    Before, they are let fade at a tenth of it, for at most `patience` tenths: a capsule rolls on.
    """
    rng = np.random.default_rng(0)
    world = World(some, Fidelity(substep=step, damping=damping), count=8, allow_unstable=True)
    at_rest(world, start)
    shape = (8, len(some.bodies), 3)
    world.set_state(
        linear_velocity=1e-7 * rng.normal(size=shape),
        angular_velocity=5e-6 * rng.normal(size=shape),
    )
    for _ in range(patience):
        world.advance(0.1 * step)
        if world.kinetic_energy().max() < 1e-16:
            break
    try:
        for _ in range(60):
            world.advance(10 * step)
            if world.kinetic_energy().max() > 1e-11:
                return True
    except SimulationDiverged:
        return True
    return False


@pytest.mark.parametrize(
    ("kind", "damping", "restitution"),
    [
        ("ball", "hunt_crossley", 0.5),
        ("cube", "hunt_crossley", 0.5),
        ("cube", "dashpot", 0.5),
        ("cube", "dashpot", 0.0),
        ("slab", "hunt_crossley", 0.5),
        ("slab", "dashpot", 0.5),
        ("capsule", "hunt_crossley", 0.5),
        ("two cubes", "hunt_crossley", 0.5),
        ("two cubes", "dashpot", 0.5),
        ("cube on compound", "hunt_crossley", 0.5),
        ("light on heavy", "hunt_crossley", 0.5),
    ],
)
def test_the_largest_stable_step_is_predicted_within_a_tenth(kind, damping, restitution, stress):
    some = scene(kind, restitution)
    start = World(some, Fidelity(substep=2e-5, damping=damping), allow_unstable=True)
    start.advance(1.0)
    limit = predicted(some, damping, start)
    patience = 20000 if stress else 3000
    for share in (0.02, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9) if stress else (0.1, 0.5, 0.9):
        assert not runs_away(some, damping, start, share * limit, patience), share
    for share in (1.1, 1.2) if stress else (1.1,):
        assert runs_away(some, damping, start, share * limit, patience), share


def test_impulses_have_no_largest_step_but_that_of_a_servo():
    world = World(scenes.block_on_ground(stiffness=1e9), PRESETS["solid"])
    world.advance(1.0)
    assert world.largest_stable_step() == math.inf
    assert np.abs(world.linear_velocity).max() < 1e-5
    tool = Drive(Sphere(0.02), 0.1, 10.0, (0, 0, 0.1), frequency=2e3)
    with pytest.raises(ValueError, match=r"Drive\.frequency 2000 rad/s .*largest safe step"):
        World(Scene([Body(Box((0.02,) * 3), mass=0.1)], [Ground()], [tool]), "solid")


def test_the_step_of_a_tower_is_that_of_the_largest_eigenvalue():
    """Its modes are close to each other: a power iteration that ended early was off by a sixth."""
    world = World(scenes.tower(8), "balanced")
    world.advance(0.1)
    with pytest.MonkeyPatch.context() as patch:
        found = world.largest_stable_step()
        patch.setattr(ContactSystem, "_largest_eigenvalue", _of_the_whole_matrix)
        assert found == pytest.approx(world.largest_stable_step(), rel=1e-5)


def _of_the_whole_matrix(system, loads, servo):
    columns = [
        system._accelerate(loads, servo, unit.reshape(-1, 6)).ravel()
        for unit in np.eye(6 * len(system._constants))
    ]
    return np.linalg.eigvals(np.array(columns)).real.max()
