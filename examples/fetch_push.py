"""A policy that was trained in the twin acts in a script of FetchPush.

rigid-envs train --algo ppo --env RigidEnvs/FetchPush-v0 && rigid-envs export -o push.safetensors
pip install -e ".[train]" "gymnasium-robotics==1.4.2" "mujoco==3.2.7"
python examples/fetch_push.py push.safetensors
"""

import sys
from pathlib import Path

import gymnasium as gym
import gymnasium_robotics

from training.policies.trained_policy import trained_policy

EPISODES = 20

gym.register_envs(gymnasium_robotics)
env = gym.make("FetchPush-v4")
policy = trained_policy(Path(sys.argv[1]))
solved = 0
for seed in range(EPISODES):
    observation, info = env.reset(seed=seed)
    truncated = False
    while not truncated:
        batch = {name: values[None] for name, values in observation.items()}
        action = policy.act(batch)[0].clip(-1.0, 1.0)
        observation, reward, terminated, truncated, info = env.step(action)
    solved += bool(info["is_success"])
print(f"{solved} of {EPISODES} episodes solved")
