"""Speed of the environments, beside bare MuJoCo in the same run.

Ours is the whole environment by make_vec, 4,096 worlds, dense reward, random actions, balanced,
with observation, reward and autoreset. The peer is physics alone, no task and no Python in the
loop: the same bodies, ground and tools in MuJoCo at 2 ms, 20 steps to an environment step, the
tools led along paths that random actions take in our own environment, from the same starts. Two
threads each. Sides take turns; rates are medians of the rounds, and the last two columns are the
lowest and the highest ratio within a round.
"""

import argparse
import statistics
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from time import perf_counter

import gymnasium as gym
import numpy as np
from mujoco import MjData, mjtState, rollout
from mujoco.batch import Batch

from benchmarks.mujoco_scene import model_of
from benchmarks.report import (
    THREADS,
    Cell,
    Side,
    Table,
    against,
    clocked,
    elsewhere,
    main,
    rate,
    take_turns,
)
from physics import PRESETS, World
from rigid_envs import Runner
from rigid_envs.tasks import TASKS, Push

# what is asked for, by task
BARS = {
    "push": "600,000; target 1,000,000 and 50 ×",
    "stack": "150,000; target 300,000 and 25 ×",
    "throw": "600,000; target 1,000,000 and 50 ×",
}
ALONE = "20,000"  # of Push by gym.make
WORLDS = 4096
EPISODE = 50  # environment steps
SUBSTEPS = 20  # of MuJoCo in an environment step
PEER = "MuJoCo: rollout"
ROUNDS, SECONDS = 5, 2.0

Array = np.ndarray


def id_of(task: str) -> str:
    """The environment of a task."""
    return f"RigidEnvs/{task.capitalize()}-v0"


def batch(task: str, fidelity: str, worlds: int = WORLDS) -> Side:
    """An episode of the vector environment a call, and the step in which all worlds reset."""
    envs = gym.make_vec(
        id_of(task),
        num_envs=worlds,
        reward_type="dense",
        fidelity=fidelity,
        threads=THREADS,
        max_episode_steps=EPISODE,
    )
    size = envs.single_action_space.shape or ()
    actions = np.random.default_rng(0).uniform(-1, 1, (EPISODE, worlds, *size)).astype(np.float32)
    envs.reset(seed=0)

    def episode() -> int:
        for action in actions:
            envs.step(action)
        envs.step(actions[0])  # the one in which worlds reset: it takes time and doesn't count
        return EPISODE * worlds

    return episode


def push_alone(fidelity: str = "balanced") -> Side:
    """An episode of the single environment a call, reset included."""
    env = gym.make(id_of("push"), reward_type="dense", fidelity=fidelity)
    actions = np.random.default_rng(0).uniform(-1, 1, (EPISODE, 3)).astype(np.float32)

    def episode() -> int:
        env.reset()
        done, steps = False, 0
        while not done:
            _, _, terminated, truncated, _ = env.step(actions[steps])
            done, steps = terminated or truncated, steps + 1
        return steps

    return episode


def episode_of(
    task: str, worlds: int, fidelity: str = "balanced"
) -> tuple[World, Array, Array, Array]:
    """An episode under random actions.

    Returns:
        The world at its end; the bodies' first positions [worlds, bodies, 3] and orientations
        [worlds, bodies, 4]; and the tools' paths [worlds, EPISODE + 1, tools, 3] in m.
    """
    runner, rng = Runner(task, worlds, "dense", fidelity, THREADS), np.random.default_rng(0)
    runner.reset(np.ones(worlds, dtype=bool), np.arange(worlds))
    world = runner.world
    position, orientation = world.position.copy(), world.orientation.copy()
    path = [world.drive_position.copy()]
    for _ in range(EPISODE):
        runner.step(rng.uniform(-1, 1, (worlds, len(runner.task.actions))))
        path.append(world.drive_position.copy())
    return world, position, orientation, np.stack(path, axis=1)


def mujoco_sides(task: str, worlds: int = 256) -> dict[str, Side]:
    """An episode a call of mujoco.rollout, and of mujoco.batch that gets a path step by step.

    Fewer worlds than ours: MuJoCo's rate doesn't depend on them, and paths and states stay small.
    """
    world, position, orientation, path = episode_of(task, worlds)
    model = model_of(world.scene, TASKS[task].frame / SUBSTEPS, cone="pyramidal")
    state = np.zeros((worlds, 1 + model.nq + model.nv))
    pose = np.concatenate([position, np.roll(orientation, 1, axis=-1)], axis=-1)
    state[:, 1 : 1 + model.nq] = pose.reshape(worlds, -1)
    share = np.arange(1, SUBSTEPS + 1)[:, None, None] / SUBSTEPS
    control = path[:, :-1, None] + share * np.diff(path, axis=1)[:, :, None]
    control = control.reshape(worlds, EPISODE * SUBSTEPS, -1)
    room = np.empty((worlds, EPISODE * SUBSTEPS, state.shape[1]))
    pool, data = rollout.Rollout(nthread=THREADS), [MjData(model) for _ in range(THREADS)]
    spec = int(mjtState.mjSTATE_MOCAP_POS)
    many = Batch(model, nsim=worlds, nthread=THREADS)

    def roll() -> int:
        pool.rollout(model, data, state, control, control_spec=spec, state=room)
        return worlds * EPISODE

    def step() -> int:
        many.reset()
        many.qpos = state[:, 1 : 1 + model.nq]
        for frame in range(EPISODE):
            many.mocap_pos = path[:, frame + 1]
            many.step(nstep=SUBSTEPS)
        return worlds * EPISODE

    return {PEER: roll, "MuJoCo: batch": step}


def panda(python: Path) -> Side:
    """Half a second of PandaPush-v3 a call, in a process and an environment of its own."""
    return elsewhere([python, Path(__file__).parent / "peers" / "panda_push.py", "0.5"])


def beside_peers(task: str, panda_python: Path | None = None) -> Table:
    """Batch and, of Push, single environment against the peers."""
    many, alone = f"{id_of(task)}, {WORLDS:,} worlds", f"{id_of(task)}, gym.make"
    bars = {many: BARS[task], alone: ALONE}
    sides = {many: batch(task, "balanced"), **mujoco_sides(task)}
    if task == "push":
        sides[alone] = push_alone()
        if panda_python:
            sides["panda-gym: PandaPush-v3"] = panda(panda_python)
    rates = take_turns(sides, ROUNDS, SECONDS)
    rows = [[name, bars.get(str(name)), *rest] for name, *rest in against(rates, PEER)]
    columns = ["env steps a second", "bar", "median", f"ratio to {PEER}", "lowest", "highest"]
    name = "speed" if task == "push" else f"speed_{task}"
    return Table(name, f"{task.capitalize()}, balanced, 20 substeps of 2 ms", columns, rows)


def by_preset() -> Iterator[Table]:
    """What each preset costs, where its time goes, and how near its step is to the limit."""
    rows: list[list[Cell]] = []
    for preset, fidelity in PRESETS.items():
        side = batch("push", preset)
        side()
        worst, touching, looked_at = np.inf, 0, 64
        world = episode_of("push", looked_at, preset)[0]
        for w in range(looked_at):
            worst = min(worst, world.largest_stable_step(w))
            touching += len(world.contacts(w).overlap)
        start = perf_counter()
        with clocked(World, "advance") as spent:
            rates = [rate(side, SECONDS) for _ in range(3)]
        engine = sum(spent) / (perf_counter() - start)
        median, substeps = statistics.median(rates), round(Push.frame / fidelity.substep)
        numbers = [substeps, median, median * substeps, engine, 1.0 - engine]
        rows.append([preset, *numbers, fidelity.substep / worst, touching / looked_at])
    columns = ["preset", "substeps", "env steps/s", "substeps/s", "share of engine", "of the task"]
    columns += ["substep / largest stable", "contacts a world"]
    yield Table("presets", f"Push by preset, {WORLDS:,} worlds", columns, rows)


def measure(panda_python: Path | None = None) -> Iterator[Table]:
    """All tables of this module."""
    for task in BARS:
        yield beside_peers(task, panda_python)
    yield from by_preset()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--panda", type=Path, metavar="PYTHON", help="see benchmarks/peers")
    main(__doc__, partial(measure, parser.parse_args().panda))
