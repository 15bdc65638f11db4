"""Speed of a task in the source tree that is the working directory.

usage: episodes.py TASK WORLDS THREADS [POLICY]

For every line on standard input it runs one episode of the vector environment, with dense reward
and preset balanced, and prints the number of environment steps. Actions are random; or, with a
policy file, those that the policy takes from the seed that every episode begins with: they are
recorded once, and then replayed, so the policy's own time doesn't count. It must run in trees of
other commits, so it uses gym.make_vec and the reader of policy files alone.
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import rigid_envs

EPISODE = {"push": 50, "stack": 100, "throw": 50}  # environment steps

task, worlds, threads = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
tree = Path(rigid_envs.__file__).resolve().parent.parent
if tree != Path.cwd().resolve():
    sys.exit(f"rigid_envs is imported from {tree}, should be from {Path.cwd()}")
policy: Any = None
arguments: dict[str, Any] = {}
if len(sys.argv) > 4:
    (file,) = Path(sys.argv[4]).glob("policy.*")
    module = "policies.policy_file" if Path("training/policies").is_dir() else "policy_file"
    policy = import_module(f"training.{module}").load_policy_file(file)
    arguments = dict(policy.header.environment.kwargs)
    if not Path("training/policies").is_dir():  # until November 2026
        arguments = {"guided": True} if arguments.get("observe_task_guide") else {}
arguments |= {"reward_type": "dense", "fidelity": "balanced"}
envs = gym.make_vec(
    f"RigidEnvs/{task.capitalize()}-v0",
    num_envs=worlds,
    threads=threads,
    max_episode_steps=EPISODE[task],
    **arguments,
)
size = envs.single_action_space.shape or ()
rng = np.random.default_rng(0)
actions = rng.uniform(-1, 1, (EPISODE[task], worlds, *size)).astype(np.float32)
observation: Any = envs.reset(seed=0)[0]
if policy:
    for step in range(EPISODE[task]):
        actions[step] = policy.act(observation)
        observation = envs.step(actions[step])[0]
for _ in sys.stdin:
    if policy:
        envs.reset(seed=0)  # its time is measured
    for action in actions:
        envs.step(action)
    if not policy:
        envs.step(actions[0])  # resets all worlds; its time is measured, but it is not counted
    print(f"steps {EPISODE[task] * worlds}", flush=True)
