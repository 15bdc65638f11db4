"""Consistency: how far a short piece of chaotic motion is from that at the finest step.

Long runs of chaotic scenes differ whatever the step is. So a run at the finest step is cut into
pieces; each setting starts every piece in the state of that run, and is compared at its end (Erez,
Tassa and Todorov 2015). Tower: five cubes, the upper two hit with 0.2 to 2 m/s. Heap: six cubes
fall onto each other. Tasks: half of the actions are random, half at their limits. 64 worlds; pieces
of a frame, 40 ms, during 2 s. The reference has the law of the setting and a substep of 0.0625 ms:
the two laws are models of their own. Error: of the body that is farthest off, by position.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from benchmarks.report.tables import Cell, Table
from physics import PRESETS, Body, Box, Fidelity, Ground, Material, Scene, World
from physics.reference.scenes import tower
from physics.scene.fidelity import NEWTON
from rigid_envs.tasks import TASKS, Task

Array = np.ndarray

WORLDS, PIECES, FRAME = 64, 50, 0.04
FINEST = 0.0625e-3  # s
SOLID = PRESETS["solid"]
REFERENCES = {"spring": Fidelity(substep=FINEST), "impulse": replace(SOLID, substep=FINEST)}
SETTINGS: dict[str, Fidelity] = {
    **PRESETS,
    "springs, 0.25 ms": Fidelity(substep=0.25e-3),
    "springs, dashpot, 0.25 ms": Fidelity(substep=0.25e-3, damping="dashpot"),
    "impulses, 4 ms": replace(SOLID, substep=4e-3),
    "impulses, 0.25 ms": replace(SOLID, substep=0.25e-3),
    "impulses, Newton, 4 ms": replace(NEWTON, substep=4e-3),
    "impulses, Newton, 1 ms": replace(NEWTON, substep=1e-3),
}


class Pieces(NamedTuple):
    """A chaotic motion.

    Attributes:
        scene: what moves.
        start: brings a world into the first state.
        command: commands the drives of a world before a piece; None without drives.
    """

    scene: Scene
    start: Callable[[World], None]
    command: Callable[[World, int], None] | None = None


def _tower() -> Pieces:
    def start(world: World) -> None:
        speed = np.zeros((WORLDS, 5, 3))
        speed[:, 3:, 0] = np.linspace(0.2, 2.0, WORLDS)[:, None]
        world.set_state(linear_velocity=speed)

    return Pieces(tower(5), start)


def _heap() -> Pieces:
    rough, cube = Material(friction=0.5, restitution=0.2), Box((0.02, 0.02, 0.02))
    bodies = [Body(cube, mass=0.064, position=(0, 0, 1), material=rough) for _ in range(6)]

    def start(world: World) -> None:
        draw = np.random.default_rng(0)
        position = draw.uniform(-0.02, 0.02, (WORLDS, 6, 3))
        position[:, :, 2] = 0.05 + 0.07 * np.arange(6)
        world.set_state(
            position=position, orientation=draw.normal(size=(WORLDS, 6, 4)),
            linear_velocity=np.zeros(3), angular_velocity=draw.normal(size=(WORLDS, 6, 3)),
        )  # fmt: skip

    return Pieces(Scene(bodies, [Ground(rough)]), start)


def _task(name: str) -> Pieces:
    task: Task = TASKS[name]()
    size = len(task.actions)
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (PIECES, WORLDS, size))
    actions[:, ::2] = np.sign(actions[:, ::2])

    def start(world: World) -> None:
        draws = np.random.default_rng(2).uniform(size=(WORLDS, task.draw_count))
        task.start(world, np.ones(WORLDS, dtype=bool), draws)

    def command(world: World, piece: int) -> None:
        task.act(world, world.read(), actions[piece])

    return Pieces(task.scene(), start, command)


def _state(world: World) -> dict[str, Any]:
    state: dict[str, Any] = {
        name: getattr(world, name).copy()
        for name in ("position", "orientation", "linear_velocity", "angular_velocity")
    }
    if world.scene.drives:
        state["drive_position"] = world.drive_position.copy()
        state["drive_velocity"] = world.drive_velocity.copy()
    return state


def _advance(world: World, pieces: Pieces, piece: int) -> Array:
    """Advances a piece; positions after it [count, bodies, 3]."""
    if pieces.command is not None:
        pieces.command(world, piece)
    world.advance(FRAME)
    return world.position.copy()


def reference(pieces: Pieces, fidelity: Fidelity) -> list[tuple[dict[str, Any], Array]]:
    """The state at the start of every piece, and the positions at its end."""
    world = World(pieces.scene, fidelity, WORLDS)
    pieces.start(world)
    return [(_state(world), _advance(world, pieces, piece)) for piece in range(PIECES)]


def errors(pieces: Pieces, fidelity: Fidelity, known: list[tuple[dict[str, Any], Array]]) -> Array:
    """[pieces * worlds] m, of the body that is farthest off."""
    world, found = World(pieces.scene, fidelity, WORLDS), []
    for piece, (state, end) in enumerate(known):
        world.set_state(**state)
        found.append(np.linalg.norm(_advance(world, pieces, piece) - end, axis=2).max(axis=1))
    return np.concatenate(found)


def measure() -> Iterator[Table]:
    """One table."""
    motions = {"tower": _tower(), "heap": _heap(), **{name: _task(name) for name in TASKS}}
    rows: list[list[Cell]] = []
    for motion, pieces in motions.items():
        known = {law: reference(pieces, fidelity) for law, fidelity in REFERENCES.items()}
        for setting, fidelity in SETTINGS.items():
            if fidelity.solver == "newton" and pieces.scene.drives:
                continue
            errors(pieces, fidelity, known[fidelity.law][:1])  # compiles
            begin = perf_counter()
            found = 1e3 * errors(pieces, fidelity, known[fidelity.law])
            rate = WORLDS * PIECES * FRAME / (perf_counter() - begin)
            quantiles = [float(np.quantile(found, q)) for q in (0.5, 0.9, 0.99)]
            rows.append([motion, setting, rate, *quantiles])
    columns = ["motion", "setting", "simulated s/s", "median mm", "9 of 10 mm", "99 of 100 mm"]
    yield Table("consistency", f"Pieces of 40 ms, {WORLDS} worlds", columns, rows)
