"""Episodes of the environments, as sides of a comparison."""

from typing import Any

import gymnasium as gym
import numpy as np

from benchmarks.report.provenance import ROOT, THREADS
from benchmarks.report.timing import Side
from physics import World
from rigid_envs import Runner
from rigid_envs.tasks import TASKS
from training.policies.policy_file import PolicyFile, load_policy_file

WORLDS = 4096
EPISODE = 50  # environment steps with random actions

Array = np.ndarray


def id_of(task: str) -> str:
    """The environment id of a task."""
    return f"RigidEnvs/{task.capitalize()}-v0"


def policy_of(task: str) -> PolicyFile:
    """The trained policy of a task that comes with the project."""
    folder = ROOT / "results" / "ppo" / f"RigidEnvs-{task.capitalize()}-v0_seed0"
    return load_policy_file(folder / "policy.safetensors")


def vector_side(task: str, fidelity: str, worlds: int = WORLDS, trained: bool = False) -> Side:
    """Each call is an episode of the vector environment, with the step that resets all worlds.

    Actions are random; if `trained`, those that the trained policy takes from the seed that every
    episode begins with. They are recorded once, so the policy's own time doesn't count.
    """
    policy = policy_of(task) if trained else None
    arguments: dict[str, Any] = dict(policy.header.environment.kwargs) if policy else {}
    steps = TASKS[task].max_episode_steps if policy else EPISODE
    arguments |= {"reward_type": "dense", "fidelity": fidelity, "max_episode_steps": steps}
    envs = gym.make_vec(id_of(task), num_envs=worlds, threads=THREADS, **arguments)
    size = envs.single_action_space.shape or ()
    actions = np.random.default_rng(0).uniform(-1, 1, (steps, worlds, *size)).astype(np.float32)
    observation = envs.reset(seed=0)[0]
    if policy:
        for step in range(steps):
            actions[step] = policy.act(observation)
            observation = envs.step(actions[step])[0]

    def episode() -> int:
        if policy:
            envs.reset(seed=0)
        for action in actions:
            envs.step(action)
        if not policy:
            envs.step(actions[0])  # resets all worlds; its time is measured, but it is not counted
        return steps * worlds

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


def recorded_episode(
    task: str, worlds: int, fidelity: str = "balanced", trained: bool = False
) -> tuple[World, Array, Array, Array]:
    """One episode with random actions, or with those of the trained policy.

    Returns:
        The world at the end of the episode; the bodies' first positions [worlds, bodies, 3] in m
        and orientations [worlds, bodies, 4]; and the paths of the drives
        [worlds, steps + 1, drives, 3] in m.
    """
    policy = policy_of(task) if trained else None
    arguments: dict[str, Any] = dict(policy.header.environment.kwargs) if policy else {}
    arguments |= {"reward_type": "dense", "fidelity": fidelity}
    runner, rng = Runner(task, worlds, threads=THREADS, **arguments), np.random.default_rng(0)
    runner.reset(np.ones(worlds, dtype=bool), np.arange(worlds))
    world, observation = runner.world, runner.observe()[0]
    position, orientation = world.position.copy(), world.orientation.copy()
    path = [world.drive_position.copy()]
    for _ in range(TASKS[task].max_episode_steps if policy else EPISODE):
        if policy:
            actions = policy.act(observation)
        else:
            actions = rng.uniform(-1, 1, (worlds, len(runner.task.actions)))
        observation = runner.step(actions).observation
        path.append(world.drive_position.copy())
    return world, position, orientation, np.stack(path, axis=1)
