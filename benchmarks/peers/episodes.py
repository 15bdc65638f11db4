"""Speed of a task in the source tree that is the working directory.

usage: episodes.py TASK WORLDS THREADS

For every line on standard input it runs one episode of the vector environment with random actions,
dense reward and preset balanced, and prints the number of environment steps. It must run in trees
of other commits, so it uses gym.make_vec and nothing else of this project.
"""

import sys
from pathlib import Path

import gymnasium as gym
import numpy as np

import rigid_envs

EPISODE = {"push": 50, "stack": 100, "throw": 50}  # environment steps

task, worlds, threads = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
tree = Path(rigid_envs.__file__).resolve().parent.parent
if tree != Path.cwd().resolve():
    sys.exit(f"rigid_envs is imported from {tree}, should be from {Path.cwd()}")
envs = gym.make_vec(
    f"RigidEnvs/{task.capitalize()}-v0",
    num_envs=worlds,
    reward_type="dense",
    fidelity="balanced",
    threads=threads,
    max_episode_steps=EPISODE[task],
)
size = envs.single_action_space.shape or ()
rng = np.random.default_rng(0)
actions = rng.uniform(-1, 1, (EPISODE[task], worlds, *size)).astype(np.float32)
envs.reset(seed=0)
for _ in sys.stdin:
    for action in actions:
        envs.step(action)
    envs.step(actions[0])  # resets all worlds; its time is measured, but it is not counted
    print(f"steps {EPISODE[task] * worlds}", flush=True)
