"""Errors against closed forms, beside MuJoCo on the same scenes at the same steps.

Both engines run through the same code. Ours by preset; MuJoCo with its default options and elliptic
cones. MuJoCo has no coefficient of restitution, hence no figures there. Blocks and balls settle for
1 s, then get their speed. All weigh 1 kg. Errors are relative unless a unit stands beside them.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from benchmarks.mujoco_scene import MujocoWorld
from benchmarks.report import Cell, Table, main
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
    """Ours by preset, then MuJoCo at the step of each."""

    def ours(fidelity: Fidelity, scene: Scene) -> World:
        return World(scene, fidelity, threads=1)

    def theirs(step: float, scene: Scene) -> MujocoWorld:
        return MujocoWorld(scene, step)

    presets = {name: partial(ours, fidelity) for name, fidelity in PRESETS.items()}
    steps = [fidelity.substep for fidelity in PRESETS.values()]
    return {**presets, **{_peer(h): partial(theirs, h) for h in steps}}


def restitution_rows() -> Iterator[list[Cell]]:
    """Worst errors of restitution by preset."""
    for e in (0.0, 0.25, 0.5, 0.75, 1.0):
        found = [rebounds(e, fidelity) for fidelity in PRESETS.values()]
        if e == 1.0:
            worst = [float(np.max(x**2 - 1.0)) for x in found]
            yield ["e = 1: energy gained", "1e-3 accurate, solid", *worst]
        else:
            worst = [float(np.max(np.abs(x - e))) for x in found]
            what = "rebound, share of v" if e == 0.0 else "error of e"
            yield [f"e = {e:g}: {what}", "1e-3 accurate, solid", *worst]


def drifts(world: World | MujocoWorld) -> list[Cell]:
    """Worst relative drift of energy and of angular momentum over 10 s."""
    energy, momentum = world.kinetic_energy()[0], world.angular_momentum()[0].copy()
    worst = np.zeros(2)
    for _ in range(100):
        world.advance(0.1)
        turned = math.dist(world.angular_momentum()[0], momentum) / math.hypot(*momentum)
        worst = np.maximum(worst, [abs(world.kinetic_energy()[0] / energy - 1.0), turned])
    return [float(worst[0]), float(worst[1])]


def measure() -> Iterator[Table]:
    """All tables of this module."""
    engines = _engines()
    tests: dict[tuple[str, str], Callable[[Make], float]] = {
        (f"{name} slides to rest from {v:g} m/s", "5e-4 balanced, 5e-5 accurate"): partial(
            slide, half_extents, v
        )
        for name, half_extents in (("cube", BLOCK), ("slab", SLAB))
        for v in (2.0, 0.5)
    }
    tests["cube creeps on 20°, 60 s, m/s", "1e-9"] = creep
    tests["cube accelerates on 28°", "1e-3"] = partial(acceleration, 28.0, 2)
    tests["cube accelerates on 30°, 1st second", "–"] = partial(acceleration, 30.0, 1)
    tests["cube accelerates on 30°, 2nd second", "–"] = partial(acceleration, 30.0, 2)
    tests["ball slides, then rolls", "1e-3 balanced"] = roll
    rows: list[list[Cell]] = []
    for (name, bar), test in tests.items():
        errors = {engine: test(make) for engine, make in engines.items()}
        step = PRESETS["balanced"].substep
        ours, theirs = errors["balanced"], errors[_peer(step)]
        ratio = theirs / ours if theirs < 1e6 * ours else "> 1e6"
        rows.append([name, bar, *errors.values(), ratio])
    columns = ["error", "bar", *engines, "MuJoCo / balanced"]
    yield Table("accuracy", "Relative errors in sliding, resting, rolling; μ = 0.5", columns, rows)

    title = f"Sphere on a plane without gravity, worst of {PHASES} touch phases"
    yield Table("restitution", title, ["error", "bar", *PRESETS], list(restitution_rows()))

    box = torque_free_box()
    worlds: dict[str, World | MujocoWorld] = {
        "ours": World(box, Fidelity(substep=1e-3), threads=1),
        "MuJoCo, Euler": MujocoWorld(box, 1e-3),
        "MuJoCo, RK4": MujocoWorld(box, 1e-3, "RK4"),
    }
    rows = [[name, *drifts(world)] for name, world in worlds.items()]
    rows.append(["bar", "1e-6", "round-off"])
    title = "Torque-free box about its middle axis, 10 s at 1 ms"
    yield Table("tumbling", title, ["worst drift", "energy", "angular momentum"], rows)


if __name__ == "__main__":
    main(__doc__, measure)
