"""Records random episodes of a task in the source tree that is the working directory.

usage: rollouts.py TASK PRESET EPISODES FILE

FILE gets one array for each quantity that a step returns, [steps + 1, episodes, ...], where the
first entry is of the reset. It must run in trees of other commits, so it uses gym.make_vec and
nothing else of this project.
"""

import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import rigid_envs

EPISODE = {"push": 50, "stack": 100, "throw": 50}  # environment steps

task, preset, episodes, file = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4]
tree = Path(rigid_envs.__file__).resolve().parent.parent
if tree != Path.cwd().resolve():
    sys.exit(f"rigid_envs is imported from {tree}, should be from {Path.cwd()}")
envs = gym.make_vec(
    f"RigidEnvs/{task.capitalize()}-v0",
    num_envs=episodes,
    reward_type="dense",
    fidelity=preset,
    max_episode_steps=EPISODE[task],
)
rng = np.random.default_rng(0)
recorded: dict[str, list[np.ndarray]] = {}


def record(quantities: dict[str, np.ndarray]) -> None:
    """Copies the quantities of a step, as the environment may reuse its arrays."""
    for name, values in quantities.items():
        recorded.setdefault(name, []).append(np.array(values))


observation = envs.reset(seed=0)[0]
none = np.zeros(episodes, dtype=bool)
record({**observation, "reward": np.zeros(episodes), "terminated": none, "truncated": none})
for _ in range(EPISODE[task]):
    action = rng.uniform(-1, 1, envs.action_space.shape).astype(np.float32)
    observation, reward, terminated, truncated = envs.step(action)[:4]
    record({**observation, "reward": reward, "terminated": terminated, "truncated": truncated})
arrays: Any = {name: np.stack(steps) for name, steps in recorded.items()}
np.savez(file, **arrays)
