"""Frames per second: 480 x 480 pixels, render() of single environments on one core.

Each world is drawn in the middle of an episode with random actions, with exact shapes, with contact
forces, and with particles and forces.
"""

from collections.abc import Iterator
from typing import Any

import gymnasium as gym

import rigid_envs  # noqa: F401  (registers the ids)
from benchmarks.measure.episodes import id_of
from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import Side, rate

SCENES: list[tuple[str, dict[str, Any]]] = [
    ("Push", {}),
    *(("Stack", {"blocks": blocks}) for blocks in (2, 3, 4, 5)),
    ("Throw", {}),
]
STEPS, SECONDS = 25, 1.5
FRAMES = 10  # per call
TARGET = 300.0  # frames per second


def rendering_side(task: str, **arguments: Any) -> Side:
    """Each call draws FRAMES frames of one world."""
    env = gym.make(id_of(task), render_mode="rgb_array", **arguments)
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(STEPS):
        env.step(env.action_space.sample())

    def turn() -> int:
        for _ in range(FRAMES):
            env.render()
        return FRAMES

    turn()
    return turn


def measure() -> Iterator[Table]:
    """One table: every task, drawn with exact shapes and with particles."""
    rows: list[list[Cell]] = []
    for task, arguments in SCENES:
        shown: list[dict[str, Any]] = [
            {}, {"show_forces": True}, {"show_forces": True, "show_particles": True}
        ]  # fmt: skip
        rates = [rate(rendering_side(task, **more, **arguments), SECONDS) for more in shown]
        blocks = f", {arguments['blocks']} blocks" if arguments else ""
        rows.append([f"{task}{blocks}", TARGET, *rates])
    columns = ["frames per second", "target", "exact shapes", "with forces", "as particles"]
    yield Table("rendering", "Frames of 480 x 480, one core", columns, rows)
