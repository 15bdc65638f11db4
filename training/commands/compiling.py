"""Compiles kernels ahead of time: general ones, and those made for environments."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np

import rigid_envs  # noqa: F401  (registers the ids)
from physics.compiler.code_cache import folders
from physics.reference.general import GENERAL_KERNELS, compile_general
from physics.scene.fidelity import PRESETS
from rigid_envs.registration import ENVIRONMENTS
from training.settings.errors import UsageError


def run(ids: Sequence[str], presets: Sequence[str], general_only: bool = False) -> None:
    """Compiles the general kernels, then the special ones of environments at presets.

    Args:
        ids: of environments; the sparse ids of all tasks if empty. Dense ids have the same kernels.
        presets: names of fidelities; all if empty.
        general_only: leave the special kernels out.

    Raises:
        UsageError: no such environment or preset.
    """
    for kind, given, known in (
        ("environment", ids, ENVIRONMENTS), ("fidelity", presets, PRESETS),
    ):  # fmt: skip
        if unknown := [name for name in given if name not in known]:
            raise UsageError(f"unknown {kind} {unknown[0]!r}: choose from {', '.join(known)}")
    jobs: dict[str, Callable[[], None]] = {
        f"general kernel, {name}": partial(compile_general, name) for name in GENERAL_KERNELS
    }
    if not general_only:
        chosen = ids or [name for name in ENVIRONMENTS if "Dense" not in name]
        for env_id in chosen:
            for preset in presets or PRESETS:
                jobs[f"{env_id}, {preset}"] = partial(_compile_environment, env_id, preset)
    begin = time.perf_counter()
    for number, (name, job) in enumerate(jobs.items(), 1):
        start = time.perf_counter()
        print(f"{number}/{len(jobs)} {name} ...", end="", flush=True)
        job()
        print(f" {time.perf_counter() - start:.1f} s", flush=True)
    spent = time.perf_counter() - begin
    files = [path for folder in folders() for path in folder.glob("*.*")]
    size = sum(path.stat().st_size for path in files)
    print(f"{len(jobs)} compiled in {spent:.0f} s; {folders()[0]} holds {size / 1e6:.1f} MB")


def _compile_environment(env_id: str, preset: str) -> None:
    """The first steps of an environment, and of a vector environment, which has more kernels."""
    makers: tuple[tuple[Any, dict[str, Any]], ...] = (
        (gym.make, {}),
        (gym.make_vec, {"num_envs": 2}),
    )
    for make, arguments in makers:
        env = make(env_id, fidelity=preset, kernel="special", **arguments)
        env.reset(seed=0)
        env.step(np.zeros_like(env.action_space.sample()))
        env.close()
