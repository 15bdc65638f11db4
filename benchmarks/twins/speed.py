"""Environment steps per second of twins beside their originals, with random actions."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import gymnasium as gym
import numpy as np

from rigid_envs.twins import TWINS
from training.results.originals import INTERPRETER

WORKER = Path(__file__).with_name("speed_worker.py")
WORLDS, SECONDS = 4096, 5.0


def steps_per_second(env_id: str, cores: int) -> float:
    """Of a twin in 4,096 worlds, random actions included."""
    rng = np.random.default_rng(0)
    with closing(gym.make_vec(env_id, num_envs=WORLDS, threads=cores)) as envs:
        envs.reset(seed=0)
        shape = envs.action_space.shape
        for length in (1.0, SECONDS):
            start, steps = time.perf_counter(), 0
            while time.perf_counter() - start < length:
                envs.step(rng.uniform(-1.0, 1.0, shape).astype(np.float32))
                steps += WORLDS
            found = steps / (time.perf_counter() - start)
    return found


def original(env_id: str, cores: int, python: Path | None) -> tuple[str, float]:
    """The fastest peer of an original, and its steps per second."""
    interpreter = python or (INTERPRETER if INTERPRETER.exists() else Path(sys.executable))
    command = [str(interpreter), str(WORKER), env_id, str(cores), str(SECONDS)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = json.loads(done.stdout.splitlines()[-1])
    return max(found.items(), key=lambda one: one[1])


def table(python: Path | None) -> Iterator[str]:
    """Rows of a table, each measured when it is asked for."""
    cores = len(os.sched_getaffinity(0))
    yield f"| twin | steps/s, {WORLDS:,} worlds, {cores} threads | original | steps/s | ratio |"
    yield "|---|---:|---|---:|---:|"
    for twin in TWINS.values():
        ours = steps_per_second(f"RigidEnvs/{twin.__name__}-v0", cores)
        peer, theirs = original(twin.original, cores, python)
        yield f"| {twin.__name__} | {ours:,.0f} | {peer} | {theirs:,.0f} | {ours / theirs:.0f} |"
