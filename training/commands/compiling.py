"""Compiles kernels ahead of time: general ones, and those made for environments."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gymnasium as gym
import numpy as np

import rigid_envs  # noqa: F401  (registers the ids)
from physics.compiler.files.code_cache import NOTE, folders, versions
from physics.compiler.files.levels import LEVELS, offered
from physics.reference.general import GENERAL_KERNELS, compile_general
from physics.scene.fidelity import PRESETS
from rigid_envs.registration import ENVIRONMENTS, NAMES
from training.settings.errors import UsageError


def run(ids: Sequence[str], presets: Sequence[str], general_only: bool = False) -> None:
    """Compiles the general kernels, then the special ones of environments at presets.

    Args:
        ids: of environments; the sparse ids of all tasks but twins if empty. Dense ids have the
            same kernels.
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
    chosen = ids or [f"RigidEnvs/{name}-v0" for name in NAMES]
    jobs: dict[str, Callable[[], None]] = {
        f"general kernel, {name}": partial(compile_general, name) for name in GENERAL_KERNELS
    }
    # what environments compile beside the engine's kernels: draws, clipping, rows of observations
    jobs |= {
        f"{env_id}, by general kernels": partial(
            _compile_environment, env_id, "balanced", "general"
        )
        for env_id in chosen
    }
    if not general_only:
        for env_id in chosen:
            for preset in presets or PRESETS:
                jobs[f"{env_id}, {preset}"] = partial(
                    _compile_environment, env_id, preset, "special"
                )
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


def run_for(
    level: str | None,
    into: Path | None,
    ids: Sequence[str],
    presets: Sequence[str],
    general_only: bool,
) -> int:
    """Compiles in a process of its own, for a level of processors, and copies kernels to a folder.

    Args:
        level: one of `physics.compiler.files.levels.LEVELS`; this processor if None.
        into: folder for the kernels, made if needed; the cache of this machine if None.
        ids: see `run`.
        presets: see `run`.
        general_only: see `run`.

    Returns:
        The exit status of that process.

    Raises:
        UsageError: this processor can't run kernels of the level, which compiling does.
    """
    if level is not None and level not in LEVELS:
        raise UsageError(f"--level {level}: choose from {', '.join(LEVELS)}")
    if level is not None and level not in offered():
        raise UsageError(f"--level {level}: this processor lacks its instructions; use another one")
    environment = dict(os.environ)
    if level is not None:
        environment |= {"NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": ""}
    command = [sys.executable, "-m", "training.commands.cli", "compile", *ids]
    command += ["--fidelity", *presets] if presets else []
    command += ["--general-only"] if general_only else []
    with TemporaryDirectory() as cache:
        if into is not None:
            environment["NUMBA_CACHE_DIR"] = cache
        status = subprocess.run(command, env=environment, check=False).returncode
        if into is not None and status == 0:
            into.mkdir(parents=True, exist_ok=True)
            for file in Path(cache).rglob("*.kernel"):
                shutil.copy(file, into)
            (into / NOTE).write_text(versions() + "\n", encoding="utf-8")
            size = sum(file.stat().st_size for file in into.iterdir())
            print(f"{into} holds {size / 1e6:.1f} MB")
    return status


def _compile_environment(env_id: str, preset: str, kernel: str) -> None:
    """The first steps of an environment, and of a vector environment, which has more kernels."""
    makers: tuple[tuple[Any, dict[str, Any]], ...] = (
        (gym.make, {}),
        (gym.make_vec, {"num_envs": 2}),
    )
    for make, arguments in makers:
        env = make(env_id, fidelity=preset, kernel=kernel, **arguments)
        env.reset(seed=0)
        env.step(np.zeros_like(env.action_space.sample()))
        env.close()
