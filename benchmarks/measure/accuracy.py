"""Errors against closed forms, ours by preset and MuJoCo's on the same scenes at the same steps.

Both engines run through the same code; MuJoCo has its default options and elliptic friction cones.
MuJoCo has no coefficient of restitution, so it has no figures there. Blocks and balls rest for 1 s
before they get their speed. Each has a mass of 1 kg. Errors are relative unless a unit is given.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from benchmarks.peers.mujoco_options import MujocoOptions
from benchmarks.peers.mujoco_worlds import MujocoWorlds
from benchmarks.report.tables import Cell, Table
from physics import PRESETS, Fidelity, Scene, World
from physics.reference.measures import (
    BLOCK,
    PHASES,
    Make,
    acceleration,
    creep,
    rebounds,
    roll,
    slide,
)
from physics.reference.scenes import torque_free_box

SLAB = (0.1, 0.1, 0.02)  # m, half extents


def _peer(step: float) -> str:
    return f"MuJoCo {1e3 * step:.3g} ms"


def _engines() -> dict[str, Make]:
    """Ours by preset, then MuJoCo at the substep of each."""

    def ours(fidelity: Fidelity, scene: Scene) -> World:
        return World(scene, fidelity, threads=1)

    def theirs(step: float, scene: Scene) -> MujocoWorlds:
        return MujocoWorlds(scene, MujocoOptions(step))

    presets = {name: partial(ours, fidelity) for name, fidelity in PRESETS.items()}
    steps = [fidelity.substep for fidelity in PRESETS.values()]
    return {**presets, **{_peer(h): partial(theirs, h) for h in steps}}


def restitution_rows() -> Iterator[list[Cell]]:
    """Largest errors of restitution by preset."""
    for e in (0.0, 0.25, 0.5, 0.75, 1.0):
        found = [rebounds(e, fidelity) for fidelity in PRESETS.values()]
        if e == 1.0:
            largest = [float(np.max(x**2 - 1.0)) for x in found]
            yield ["e = 1: energy gained", "1e-3 accurate, solid", *largest]
        else:
            largest = [float(np.max(np.abs(x - e))) for x in found]
            yield [f"e = {e:g}: error of e", "1e-3 accurate, solid", *largest]


def drifts(world: World | MujocoWorlds) -> list[Cell]:
    """Largest relative drift of energy and of angular momentum over 10 s."""
    energy, momentum = world.kinetic_energy()[0], world.angular_momentum()[0].copy()
    largest = np.zeros(2)
    for _ in range(100):
        world.advance(0.1)
        change = math.dist(world.angular_momentum()[0], momentum) / math.hypot(*momentum)
        largest = np.maximum(largest, [abs(world.kinetic_energy()[0] / energy - 1.0), change])
    return [float(largest[0]), float(largest[1])]


def measure() -> Iterator[Table]:
    """Three tables: sliding and rolling, restitution, a tumbling box."""
    engines = _engines()
    tests: dict[tuple[str, str], Callable[[Make], float]] = {
        (f"{name} slides to rest from {v:g} m/s", "5e-4 balanced, 5e-5 accurate"): partial(
            slide, half_extents, v
        )
        for name, half_extents in (("cube", BLOCK), ("slab", SLAB))
        for v in (2.0, 0.5)
    }
    tests["cube creeps down 20°, 60 s, m/s", "1e-9"] = partial(creep, BLOCK)
    tests["cube accelerates down 28°", "1e-3"] = partial(acceleration, 28.0, 2)
    tests["cube accelerates down 30°, 1st second", "–"] = partial(acceleration, 30.0, 1)
    tests["cube accelerates down 30°, 2nd second", "–"] = partial(acceleration, 30.0, 2)
    tests["ball slides, then rolls", "1e-3 balanced"] = roll
    rows: list[list[Cell]] = []
    for (name, target), test in tests.items():
        errors = {engine: test(make) for engine, make in engines.items()}
        step = PRESETS["balanced"].substep
        ours, theirs = errors["balanced"], errors[_peer(step)]
        ratio = theirs / ours if theirs < 1e6 * ours else "> 1e6"
        rows.append([name, target, *errors.values(), ratio])
    columns = ["error", "target", *engines, "MuJoCo / balanced"]
    yield Table("accuracy", "Relative errors in sliding, resting, rolling; μ = 0.5", columns, rows)

    title = f"Sphere that hits a plane without gravity, largest of {PHASES} phases of the step"
    yield Table("restitution", title, ["error", "target", *PRESETS], list(restitution_rows()))

    box = torque_free_box()
    worlds: dict[str, World | MujocoWorlds] = {
        "rigid-envs": World(box, Fidelity(substep=1e-3), threads=1),
        "MuJoCo, Euler": MujocoWorlds(box, MujocoOptions(1e-3)),
        "MuJoCo, RK4": MujocoWorlds(box, MujocoOptions(1e-3, "RK4")),
    }
    rows = [[name, *drifts(world)] for name, world in worlds.items()]
    rows.append(["target", "1e-6", "round-off"])
    title = "Torque-free box about its middle axis, 10 s at 1 ms"
    columns = ["largest relative drift", "energy", "angular momentum"]
    yield Table("tumbling", title, columns, rows)
