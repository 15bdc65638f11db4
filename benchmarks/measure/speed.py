"""Environment steps per second of each task, compared with bare MuJoCo in the same run.

Ours is the whole environment: gym.make_vec with 4,096 worlds, dense reward, preset balanced, with
observations, rewards and resets; in the states that the trained policies visit, and with random
actions. MuJoCo is physics alone, led along the same paths of the hand (peers/mujoco_rollout.py).
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

TASKS = ("push", "stack", "throw")
# ratios to MuJoCo's rollout with random actions
TARGETS = {"push": "60 ×", "stack": "33 ×", "throw": "48 ×"}
SINGLE_TARGET = "22,000"  # of Push by gym.make
ROUNDS, SECONDS = 5, 2.0


def with_policy(task: str) -> Table:
    """The vector environment of a task in the states of its trained policy, and MuJoCo."""
    many = f"{id_of(task)}, {WORLDS:,} worlds"
    sides = {
        many: vector_side(task, "balanced", trained=True),
        **mujoco_sides(task, trained=True),
    }
    rows = ratios_to(ROLLOUT, take_turns(sides, ROUNDS, SECONDS))
    title = f"{task.capitalize()} in the states of its trained policy, 20 substeps of 2 ms"
    columns = ["env steps per second", "median", f"ratio to {ROLLOUT}", "lowest", "highest"]
    return Table(f"speed_policy_{task}", title, columns, rows)


def with_random_actions(task: str, panda_python: Path | None = None) -> Table:
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
    title = f"{task.capitalize()} with random actions, 20 substeps of 2 ms"
    return Table(f"speed_{task}", title, columns, rows)


def measure(panda_python: Path | None = None) -> Iterator[Table]:
    """Two tables per task.

    Args:
        panda_python: interpreter that has panda-gym installed, if any.
    """
    for task in TASKS:
        yield with_policy(task)
    for task in TASKS:
        yield with_random_actions(task, panda_python)
