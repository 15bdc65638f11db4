"""Turns of Push's speed in whichever source tree it is run in: a turn for every line of stdin."""

import sys
from pathlib import Path

import gymnasium as gym
import numpy as np

import rigid_envs

WORLDS, EPISODE = 4096, 50

tree = Path(rigid_envs.__file__).resolve().parent.parent
if tree != Path.cwd().resolve():  # an installed copy
    sys.exit(f"rigid_envs is that of {tree}, should be that of {Path.cwd()}")
envs = gym.make_vec(
    "RigidEnvs/Push-v0",
    num_envs=WORLDS,
    reward_type="dense",
    fidelity="balanced",
    threads=int(sys.argv[1]),
    max_episode_steps=EPISODE,
)
actions = np.random.default_rng(0).uniform(-1, 1, (EPISODE, WORLDS, 3)).astype(np.float32)
envs.reset(seed=0)
for _ in sys.stdin:
    for action in actions:
        envs.step(action)
    envs.step(actions[0])  # the one in which worlds reset
    print(f"steps {EPISODE * WORLDS}", flush=True)
