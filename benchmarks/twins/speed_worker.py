"""Steps an original with random actions; prints steps per second as JSON.

python speed_worker.py ID CORES SECONDS: an interpreter with Gymnasium and the original runs this
file; it imports nothing of this project. EnvPool is tried where it is installed and has the
environment.
"""

import importlib
import json
import sys
import time
from typing import Any

import gymnasium as gym
import numpy as np

MODULES = {"Fetch": "gymnasium_robotics", "Panda": "panda_gym"}
WARM_UP = 1.0  # s


def rate(envs: Any, worlds: int, size: int, seconds: float) -> float:
    """Steps per second of a vector environment, after a warm-up."""
    envs.reset()
    rng = np.random.default_rng(0)
    found = 0.0
    for length in (WARM_UP, seconds):
        start, steps = time.perf_counter(), 0
        while time.perf_counter() - start < length:
            envs.step(rng.uniform(-1.0, 1.0, (worlds, size)).astype(np.float32))
            steps += worlds
        found = steps / (time.perf_counter() - start)
    envs.close()
    return found


def main() -> None:
    """Prints the steps per second of each peer and number of worlds."""
    env_id, cores, seconds = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    gym.register_envs(importlib.import_module(MODULES[env_id[:5]]))
    size = gym.make(env_id).action_space.shape[0]  # type: ignore[index]
    found: dict[str, float] = {}
    for worlds in (cores, 4 * cores):
        envs = gym.vector.AsyncVectorEnv([lambda: gym.make(env_id) for _ in range(worlds)])
        found[f"AsyncVectorEnv, {worlds} worlds"] = rate(envs, worlds, size, seconds)
    try:
        envpool: Any = importlib.import_module("envpool")
        known = env_id in envpool.list_all_envs()
    except ImportError:
        known = False
    if known:
        for worlds in (cores, 16 * cores):
            pool = envpool.make_gymnasium(env_id, num_envs=worlds, num_threads=cores)
            found[f"EnvPool, {worlds} worlds"] = rate(pool, worlds, size, seconds)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
