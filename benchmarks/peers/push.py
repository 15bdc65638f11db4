"""Turns of Push's speed in whichever source tree it is run in: a turn for every line of stdin."""

import sys
from pathlib import Path

import gymnasium as gym
import numpy as np

import physics
import rigid_envs  # noqa: F401  registers the environments

# an installed copy would be measured for the commit whose tree this is run in
assert Path(physics.__file__).parent.parent == Path.cwd(), physics.__file__
WORLDS, EPISODE = 4096, 50

envs = gym.make_vec(
    "RigidEnvs/Push-v0",
    num_envs=WORLDS,
    reward_type="dense",
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
