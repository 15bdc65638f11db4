"""Time to the first step: a fresh process from its start to its end, interpreter and imports too.

It imports, makes RigidEnvs/Push-v0 by gym.make, resets and steps once. Cold: an empty folder for
numba's cache, so that all kernels compile. Warm: the same folder again. Medians.
"""

import statistics
from collections.abc import Iterator
from tempfile import TemporaryDirectory

from benchmarks.report import Cell, Table, fresh, main

FIRST_STEP = """
import gymnasium as gym, rigid_envs
env = gym.make("RigidEnvs/Push-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
"""
IMPORTS = "import gymnasium, rigid_envs"
COLD, WARM = 3, 5  # runs


def measure() -> Iterator[Table]:
    """All tables of this module."""
    cold, warm, imports = [], [], []
    for _ in range(COLD):
        with TemporaryDirectory() as folder:
            cache = {"NUMBA_CACHE_DIR": folder}
            cold.append(fresh(FIRST_STEP, env=cache)[0])
            warm += [fresh(FIRST_STEP, env=cache)[0] for _ in range(-(-WARM // COLD))]
    imports = [fresh(IMPORTS)[0] for _ in range(WARM)]
    rows: list[list[Cell]] = [
        ["cold cache", "15", statistics.median(cold), max(cold)],
        ["warm cache", "1.5", statistics.median(warm), max(warm)],
        ["of it: imports", None, statistics.median(imports), max(imports)],
    ]
    columns = ["s", "bar", "median", "longest"]
    yield Table("startup", "First gym.make + reset + step", columns, rows)


if __name__ == "__main__":
    main(__doc__, measure)
