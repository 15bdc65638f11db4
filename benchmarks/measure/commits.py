"""This source tree compared with those of other commits: speed, or the course of episodes.

Each commit is unpacked into its own folder, compiled there, and runs in its own process with the
packages that are installed here.
"""

import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from benchmarks.report.processes import Command, child, run_in_tree
from benchmarks.report.provenance import ROOT
from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import ratios_to, take_turns

HERE = "this tree"
# turns of an episode: about a minute for each side and task on two cores
TURNS = {"push": 120, "stack": 60, "throw": 120}
TASKS = tuple(TURNS)
PRESETS = ("fast", "balanced", "accurate", "solid")
WORLDS, EPISODES = 4096, 100
# of each tree its own file, as its format may differ
POLICY = "results/ppo/RigidEnvs-{}-v0_seed0"
PEERS = Path(__file__).resolve().parents[1] / "peers"

Array = np.ndarray


class Difference(NamedTuple):
    """How two recordings differ.

    Attributes:
        largest: largest absolute difference of a number; infinite if shapes or NaNs differ.
        step: first step that differs, where 0 is the reset; None if all are bitwise identical.
    """

    largest: float
    step: int | None


def unpack(commits: Sequence[str], folder: Path) -> dict[str, Path]:
    """Writes the files of commits into subfolders named by their hashes.

    A subfolder that exists already is used as it is, with its compiled kernels.

    Returns:
        The source tree of each commit, and of HERE, this tree.

    Raises:
        SystemExit: A commit does not exist.
    """
    trees = {HERE: ROOT}
    for commit in commits:
        name = _git("rev-parse", "--verify", f"{commit}^{{commit}}").decode().strip()
        trees[commit] = tree = folder / name
        if not tree.exists():
            archive = _git("archive", name)
            new = tree.with_name(f"{name}.new")  # so that an interrupted call leaves no half tree
            new.mkdir(parents=True, exist_ok=True)
            subprocess.run(["tar", "-x", "-C", new], input=archive, check=True)
            new.rename(tree)
    return trees


def speed(
    trees: Mapping[str, Path],
    threads: int,
    tasks: Sequence[str] = TASKS,
    turns: int | None = None,
    worlds: int = WORLDS,
    policies: bool = False,
) -> Iterator[Table]:
    """One table per task: rates of all trees, which take turns of one episode.

    Args:
        trees: source trees by name; the second is what ratios refer to.
        threads: of each side.
        tasks: some of TASKS.
        turns: of each side; those of TURNS if None.
        worlds: of each side.
        policies: in the states of this tree's trained policies; else with random actions.
    """
    reference = next(name for name in trees if name != HERE)
    for task in tasks:
        rounds = turns or TURNS[task]
        with ExitStack() as children:
            sides = {}
            for name, tree in trees.items():
                arguments = [task, str(worlds), str(threads)]
                arguments += [POLICY.format(task.capitalize())] if policies else []
                command: Command = [sys.executable, PEERS / "episodes.py", *arguments]
                sides[name] = children.enter_context(child(command, tree))
            rates = take_turns(sides, rounds, 0.0)  # a turn is one episode, whatever it takes
        columns = ["env steps per second", "median", f"ratio to {reference}", "lowest", "highest"]
        title = (
            f"{task.capitalize()}, balanced, {worlds:,} worlds, {threads} threads, "
            f"{rounds} turns of one episode"
        )
        title += " of the trained policy" if policies else ""
        yield Table(f"commits {task}", title, columns, ratios_to(reference, rates))


def states(
    trees: Mapping[str, Path],
    tasks: Sequence[str] = TASKS,
    presets: Sequence[str] = PRESETS,
    episodes: int = EPISODES,
) -> Iterator[Table]:
    """One table per commit: are all steps of random episodes bitwise those of this tree?

    Compared are observations, goals, rewards and ends of episodes after every step. Observed
    quaternions have w >= 0, so the sign of a quaternion makes no difference.

    Args:
        trees: source trees by name; HERE is compared with each of the others.
        tasks: some of TASKS.
        presets: names of fidelities.
        episodes: number of episodes per task and preset, one in each world.
    """
    with TemporaryDirectory() as folder:
        recorded = {
            (task, preset): _record(HERE, trees[HERE], task, preset, episodes, Path(folder))
            for task in tasks
            for preset in presets
        }
        for name, tree in trees.items():
            if name == HERE:
                continue
            rows: list[list[Cell]] = []
            for (task, preset), own in recorded.items():
                other = _record(name, tree, task, preset, episodes, Path(folder))
                found = difference(own, other)
                answer = "equal" if found.step is None else f"differs from step {found.step} on"
                rows.append([task, preset, answer, found.largest])
            title = f"{HERE} and {name}: every step of {episodes} random episodes, bit by bit"
            yield Table("states", title, ["task", "preset", "steps", "largest difference"], rows)


def difference(own: Mapping[str, Array], other: Mapping[str, Array]) -> Difference:
    """Compares two recordings, by name an array [steps, ...] each, bitwise."""
    if {k: (v.shape, v.dtype) for k, v in own.items()} != {
        k: (v.shape, v.dtype) for k, v in other.items()
    }:
        return Difference(np.inf, 0)
    largest, first = 0.0, None
    for name, mine in own.items():
        theirs = other[name]
        steps = len(mine)
        unequal = mine.reshape(steps, -1).view(np.uint8) != theirs.reshape(steps, -1).view(np.uint8)
        unequal = unequal.any(axis=1)
        if not unequal.any():
            continue
        step = int(np.argmax(unequal))
        first = step if first is None else min(first, step)
        apart = np.abs(mine.astype(float) - theirs.astype(float))
        largest = max(largest, float(np.nan_to_num(apart, nan=np.inf).max()))
    return Difference(largest, first)


def _record(
    name: str, tree: Path, task: str, preset: str, episodes: int, folder: Path
) -> dict[str, Array]:
    file = folder / "episodes.npz"
    arguments = [task, preset, str(episodes), str(file)]
    command: Command = [sys.executable, PEERS / "rollouts.py", *arguments]
    try:
        run_in_tree(command, tree)
    except subprocess.CalledProcessError:
        raise SystemExit(f"{task} at {preset} does not run in {name}, see above") from None
    with np.load(file) as arrays:
        return dict(arrays)


def _git(*arguments: str) -> bytes:
    run = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True)
    if run.returncode:
        raise SystemExit(f"git {' '.join(arguments)}: {run.stderr.decode().strip()}")
    return run.stdout
