"""Episodes of the environments with random actions, as sides of a comparison."""

import gymnasium as gym
import numpy as np

from benchmarks.report.provenance import THREADS
from benchmarks.report.timing import Side
from physics import World
from rigid_envs import Runner

WORLDS = 4096
EPISODE = 50  # environment steps

Array = np.ndarray


def id_of(task: str) -> str:
    """The environment id of a task."""
    return f"RigidEnvs/{task.capitalize()}-v0"


def vector_side(task: str, fidelity: str, worlds: int = WORLDS) -> Side:
    """Each call is an episode of the vector environment, with the step that resets all worlds."""
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
        envs.step(actions[0])  # resets all worlds; its time is measured, but it is not counted
        return EPISODE * worlds

    return episode


def single_side(task: str, fidelity: str = "balanced") -> Side:
    """Each call is an episode of the single environment, reset included."""
    env = gym.make(id_of(task), reward_type="dense", fidelity=fidelity)
    size = env.action_space.shape or ()
    actions = np.random.default_rng(0).uniform(-1, 1, (EPISODE, *size)).astype(np.float32)

    def episode() -> int:
        env.reset()
        done, steps = False, 0
        while not done:
            _, _, terminated, truncated, _ = env.step(actions[steps])
            done, steps = terminated or truncated, steps + 1
        return steps

    return episode


def random_episode(
    task: str, worlds: int, fidelity: str = "balanced"
) -> tuple[World, Array, Array, Array]:
    """One episode with random actions.

    Returns:
        The world at the end of the episode; the bodies' first positions [worlds, bodies, 3] in m
        and orientations [worlds, bodies, 4]; and the paths of the drives
        [worlds, EPISODE + 1, drives, 3] in m.
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
