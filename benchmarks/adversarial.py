"""Millions of steps with hostile actions in every task and preset; prints what went wrong.

4,096 worlds act at random, or by bang-bang: each component is at either limit, and changes sides
now and then. Episodes end and begin as in training. After every step, observations and rewards must
be finite, no body's centre may be below the ground, and the first 96 worlds must be bitwise equal
to 96 worlds that one thread advances by themselves. A failure is saved with the state before it,
and ends the run.

python -m benchmarks.adversarial [--steps 1e7] [--tasks push ...] [--presets fast ...]
                                 [--resume CSV]
"""

import argparse
import csv
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import gymnasium as gym
import numpy as np

from benchmarks.measure.episodes import WORLDS, id_of
from benchmarks.report.provenance import ROOT, THREADS, describe, provenance
from benchmarks.report.tables import Cell, Table, cell_text, plain
from rigid_envs.tasks import TASKS

Array = np.ndarray
Actions = Iterator[Array]

PRESETS = ("fast", "balanced", "accurate", "solid")
COLUMNS = [
    "task", "preset", "actions", "million steps", "left the bounds", "lowest centre m",
    "deepest penetration m", "fastest m/s", "s",
]  # fmt: skip
ALONE = 96  # worlds that are advanced a second time
TURN = 0.15  # probability that a component changes sides in a step
LOOK = 100  # steps between two measurements of penetration


def random_actions(size: int) -> Actions:
    """Independent actions, uniform in [-1, 1]."""
    draw = np.random.default_rng(0)
    while True:
        yield draw.uniform(-1.0, 1.0, (WORLDS, size))


def bang_bang(size: int) -> Actions:
    """Actions of -1 and 1."""
    draw = np.random.default_rng(0)
    actions = np.ones((WORLDS, size))
    while True:
        turns = draw.random(actions.shape) < TURN
        actions = np.where(turns, -actions, actions)
        yield actions


ACTIONS: dict[str, Callable[[int], Actions]] = {"random": random_actions, "bang-bang": bang_bang}


def problem(whole: tuple[Any, ...], alone: tuple[Any, ...], lowest: float) -> str:
    """What is wrong with a step of all worlds and of the few; "" if nothing is."""
    observation, reward = whole[:2]
    values = {**observation, "reward": reward}
    for name, value in values.items():
        if not np.isfinite(value).all():
            world = int(np.flatnonzero(~np.isfinite(value.reshape(len(value), -1)).all(axis=1))[0])
            return f"{name} of world {world} is {value[world]}"
    if lowest < 0.0:
        return f"the centre of a body is at a height of {lowest:g} m"
    few = {**alone[0], "reward": alone[1]}
    for name, value in values.items():
        if not np.array_equal(value[:ALONE], few[name]):
            return f"{name} differs between {WORLDS} worlds and {ALONE} of them by themselves"
    return ""


def run(task: str, preset: str, name: str, steps: float) -> list[Cell]:
    """One row of the table.

    Raises:
        AssertionError: a step went wrong; the state before it is saved.
    """
    arguments: dict[str, Any] = {"fidelity": preset, "reward_type": "dense"}
    envs: Any = gym.make_vec(id_of(task), num_envs=WORLDS, threads=THREADS, **arguments)
    few: Any = gym.make_vec(id_of(task), num_envs=ALONE, threads=1, **arguments)
    envs.reset(seed=0)
    few.reset(seed=0)
    world, actions = envs.unwrapped._runner.world, ACTIONS[name](envs.single_action_space.shape[0])
    left, lowest, deepest, fastest, start = 0, np.inf, 0.0, 0.0, perf_counter()
    count = max(1, round(steps / WORLDS))
    for k in range(count):
        if k % LOOK == 0:
            kept, since = envs.unwrapped.get_state(), []
        action = next(actions)
        since.append(action)
        whole, alone = envs.step(action), few.step(action[:ALONE])
        now = world.read()
        low = float(now.position[..., 2].min())
        wrong = problem(whole, alone, low)
        if wrong:
            path = ROOT / ".failures" / f"{task}_{preset}_{name}.pickle"
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(pickle.dumps({"state": kept, "actions": since}))
            raise AssertionError(
                f"{task} at {preset}, {name} actions, step {k}: {wrong}; {path.name} in "
                ".failures holds an earlier state and the actions since"
            )
        left += int(whole[4]["out_of_bounds"].sum())
        lowest = min(lowest, low)
        fastest = max(fastest, float(np.abs(now.linear_velocity).max()))
        if k % LOOK == 0:
            deepest = max(deepest, float(world.penetration().max()))
    million = count * WORLDS / 1e6
    return [
        task, preset, name, million, left, lowest, deepest, fastest, perf_counter() - start
    ]  # fmt: skip


def main() -> None:
    """Runs all combinations that a resumed file doesn't hold, and prints the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.adversarial", description=__doc__)
    parser.add_argument("--steps", type=float, default=1e7, help="of each combination")
    parser.add_argument("--tasks", nargs="+", choices=list(TASKS), default=list(TASKS))
    parser.add_argument("--presets", nargs="+", choices=PRESETS, default=list(PRESETS))
    parser.add_argument("--resume", type=Path, metavar="CSV", help="rows are appended to it")
    options = parser.parse_args()
    print(describe(provenance()))
    rows: list[list[Cell]] = []
    if options.resume and options.resume.exists():
        with options.resume.open() as file:
            rows = [[*row[:3], *map(float, row[3:])] for row in csv.reader(file)]
    done = {tuple(row[:3]) for row in rows}
    for task in options.tasks:
        for preset in options.presets:
            for name in ACTIONS:
                if (task, preset, name) in done:
                    continue
                rows.append(run(task, preset, name, options.steps))
                print(*map(cell_text, rows[-1]), flush=True)
                if options.resume:
                    with options.resume.open("a", newline="") as file:
                        csv.writer(file).writerow(rows[-1])
    title = f"{WORLDS:,} worlds, {THREADS} threads; {ALONE} of them compared with one thread"
    print(plain(Table("adversarial", title, COLUMNS, rows)))


if __name__ == "__main__":
    main()
