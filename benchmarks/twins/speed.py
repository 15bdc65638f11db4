"""Environment steps per second of twins beside their originals."""

import json
import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import gymnasium as gym
import numpy as np

from rigid_envs.twins import TWINS
from training.policies.policy import Policy
from training.policies.trained_policy import shipped_policy
from training.results.originals import find_interpreter
from training.settings.errors import UsageError

WORKER = Path(__file__).with_name("speed_worker.py")
WORLDS, SECONDS = 4096, 5.0


def steps_per_second(env_id: str, cores: int, policy: Policy | None = None) -> float:
    """Of a twin in 4,096 worlds, with random actions, or in the states where a policy leads it.

    A policy's worlds have the fidelity of its training; its network is not part of the time.
    """
    rng = np.random.default_rng(0)
    kwargs = {}
    if policy is not None and "fidelity" in policy.env_kwargs:
        kwargs["fidelity"] = policy.env_kwargs["fidelity"]
    with closing(gym.make_vec(env_id, num_envs=WORLDS, threads=cores, **kwargs)) as envs:
        observation, _ = envs.reset(seed=0)
        shape = envs.action_space.shape
        for length in (1.0, SECONDS):
            spent, steps = 0.0, 0
            while spent < length:
                given = None if policy is None else policy.act(observation)
                start = time.perf_counter()
                if given is None:
                    given = rng.uniform(-1.0, 1.0, shape).astype(np.float32)
                observation, *_ = envs.step(given)
                spent += time.perf_counter() - start
                steps += WORLDS
    return steps / spent


def original(env_id: str, cores: int, python: Path | None) -> tuple[str, float]:
    """The fastest peer of an original, and its steps per second."""
    command = [str(find_interpreter(python)), str(WORKER), env_id, str(cores), str(SECONDS)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = json.loads(done.stdout.splitlines()[-1])
    return max(found.items(), key=lambda one: one[1])


def table(python: Path | None) -> Iterator[str]:
    """Rows of a table, each measured when it is asked for."""
    cores = len(os.sched_getaffinity(0))
    yield (
        f"| twin | steps/s, {WORLDS:,} worlds, {cores} threads | original | steps/s | ratio | "
        "steps/s in a policy's states |"
    )
    yield "|---|---:|---|---:|---:|---:|"
    for twin in TWINS.values():
        env_id = f"RigidEnvs/{twin.__name__}-v0"
        ours = steps_per_second(env_id, cores)
        peer, theirs = original(twin.original, cores, python)
        yield (
            f"| {twin.__name__} | {ours:,.0f} | {peer} | {theirs:,.0f} | {ours / theirs:.0f} | "
            f"{in_policys_states(env_id, cores)} |"
        )


def in_policys_states(env_id: str, cores: int) -> str:
    """Steps per second where the policy that comes with the package acts, and its fidelity."""
    try:
        policy = shipped_policy(env_id)
    except UsageError:  # there is none
        return "–"
    fidelity = policy.env_kwargs.get("fidelity", "balanced")
    return f"{steps_per_second(env_id, cores, policy):,.0f} at `{fidelity}`"
