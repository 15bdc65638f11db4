"""Environment steps per second of Push against the number of worlds, with MuJoCo and panda-gym.

All sides use two threads and take turns; figures are medians over the rounds. MuJoCo is physics
alone (peers/mujoco_rollout.py), led along the same paths. panda-gym has random actions; it runs one
world by gym.make, several by Gymnasium's AsyncVectorEnv with one process per world.
"""

import statistics
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from benchmarks.measure.episodes import id_of, vector_side
from benchmarks.peers.mujoco_rollout import BATCH, ROLLOUT, mujoco_sides
from benchmarks.peers.panda import PANDA, panda_side
from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import take_turns

COUNTS = (1, 4, 16, 64, 256, 1024, 4096)
PANDA_COUNTS = (1, 4, 16)  # more processes than that only share the same cores
OURS = id_of("push")
ROUNDS, SECONDS = 3, 1.0


def measure(
    panda_python: Path | None = None,
    counts: Sequence[int] = COUNTS,
    rounds: int = ROUNDS,
    seconds: float = SECONDS,
) -> Iterator[Table]:
    """One table.

    Args:
        panda_python: interpreter that has panda-gym installed, if any.
        counts: numbers of worlds.
        rounds: turns of each side.
        seconds: shortest duration of a turn.
    """
    names = [OURS, ROLLOUT, BATCH, PANDA]
    rows: list[list[Cell]] = []
    for worlds in counts:
        with ExitStack() as children:
            sides = {
                OURS: vector_side("push", "balanced", worlds, trained=True),
                **mujoco_sides("push", worlds, trained=True),
            }
            if panda_python and worlds in PANDA_COUNTS:
                sides[PANDA] = children.enter_context(panda_side(panda_python, worlds))
            rates = take_turns(sides, rounds, seconds)
        medians = {name: statistics.median(values) for name, values in rates.items()}
        rows.append([f"{worlds:,}", *(medians.get(name) for name in names)])
    columns = ["worlds", *names]
    title = "Push in the states of its trained policy: env steps per second by number of worlds"
    yield Table("worlds", title, columns, rows)
