"""Environment steps per second of each task, compared with bare MuJoCo in the same run.

Ours is the whole environment: gym.make_vec with 4,096 worlds, dense reward, random actions, preset
balanced, with observations, rewards and resets. MuJoCo is physics alone (peers/mujoco_rollout.py).
Both use two threads and take turns; rates are medians over the rounds, and the last two columns
are the lowest and the highest ratio within a round.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

from benchmarks.measure.episodes import WORLDS, id_of, single_side, vector_side
from benchmarks.peers.mujoco_rollout import ROLLOUT, mujoco_sides
from benchmarks.peers.panda import PANDA, panda_side
from benchmarks.report.tables import Table
from benchmarks.report.timing import ratios_to, take_turns

TARGETS = {
    "push": "600,000; later 1,000,000 and 50 ×",
    "stack": "150,000; later 300,000 and 25 ×",
    "throw": "600,000; later 1,000,000 and 50 ×",
}
SINGLE_TARGET = "20,000"  # of Push by gym.make
ROUNDS, SECONDS = 5, 2.0


def of_task(task: str, panda_python: Path | None = None) -> Table:
    """The vector environment of a task and its peers; of Push, the single environment too."""
    many, single = f"{id_of(task)}, {WORLDS:,} worlds", f"{id_of(task)}, gym.make"
    targets = {many: TARGETS[task], single: SINGLE_TARGET}
    sides = {many: vector_side(task, "balanced"), **mujoco_sides(task)}
    with ExitStack() as children:
        if task == "push":
            sides[single] = single_side(task)
            if panda_python:
                sides[PANDA] = children.enter_context(panda_side(panda_python))
        rates = take_turns(sides, ROUNDS, SECONDS)
    rows = [[name, targets.get(str(name)), *rest] for name, *rest in ratios_to(ROLLOUT, rates)]
    columns = ["env steps per second", "target", "median", f"ratio to {ROLLOUT}"]
    columns += ["lowest", "highest"]
    name = "speed" if task == "push" else f"speed_{task}"
    return Table(name, f"{task.capitalize()}, balanced, 20 substeps of 2 ms", columns, rows)


def measure(panda_python: Path | None = None) -> Iterator[Table]:
    """One table per task.

    Args:
        panda_python: interpreter that has panda-gym installed, if any.
    """
    for task in TARGETS:
        yield of_task(task, panda_python)
