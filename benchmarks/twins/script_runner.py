"""python script_runner.py STEPS [-m] SCRIPT ...: ends a script after some steps of environments.

Steps are counted in this process: those of environments of `gymnasium.make`, and of vector
environments whose worlds are in other processes. Nothing else is changed.
"""

import atexit
import os
import runpy
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from gymnasium.vector import AsyncVectorEnv
from gymnasium.wrappers import TimeLimit

OWN = os.getpid()
taken = 0


def count(cls: type, name: str, worlds: Callable[[Any], int], most: int) -> None:
    """Has a method of a class count steps, and end the script after the last one."""
    original = getattr(cls, name)

    def step(self: Any, *args: Any, **kwargs: Any) -> Any:
        global taken
        result = original(self, *args, **kwargs)
        if os.getpid() == OWN and taken < most:
            taken += worlds(self)
            if taken >= most:
                raise SystemExit(0)
        return result

    setattr(cls, name, step)


def report() -> None:
    """Prints how many steps were taken."""
    if os.getpid() == OWN:
        print(f"\n{taken:,} steps", flush=True)


def main() -> None:
    """Runs the script."""
    most = int(sys.argv[1])
    count(TimeLimit, "step", lambda env: 1, most)
    count(AsyncVectorEnv, "step_wait", lambda envs: envs.num_envs, most)
    with suppress(ImportError):
        from stable_baselines3.common.vec_env import SubprocVecEnv

        count(SubprocVecEnv, "step_wait", lambda envs: envs.num_envs, most)
    atexit.register(report)
    module = sys.argv[2] == "-m"
    sys.argv = sys.argv[3 if module else 2 :]
    if module:
        sys.path.insert(0, os.getcwd())
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
    else:
        sys.path[0] = os.path.dirname(os.path.abspath(sys.argv[0]))
        runpy.run_path(sys.argv[0], run_name="__main__")


if __name__ == "__main__":
    main()
