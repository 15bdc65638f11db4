"""Duration of the first step: a fresh process from start to end, interpreter and imports included.

It imports, makes RigidEnvs/Push-v0 with gym.make, resets and steps once. Cold: numba's cache is an
empty folder, so all kernels are compiled. Warm: the same folder again. Figures are medians.
"""

import statistics
from collections.abc import Iterator
from tempfile import TemporaryDirectory

from benchmarks.report.processes import run_code
from benchmarks.report.tables import Cell, Table

FIRST_STEP = """
import gymnasium as gym, rigid_envs
env = gym.make("RigidEnvs/Push-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
"""
IMPORTS = "import gymnasium, rigid_envs"
COLD, WARM = 3, 5  # runs


def measure() -> Iterator[Table]:
    """One table."""
    cold, warm = [], []
    for _ in range(COLD):
        with TemporaryDirectory() as folder:
            cache = {"NUMBA_CACHE_DIR": folder}
            cold.append(run_code(FIRST_STEP, variables=cache)[0])
            warm += [run_code(FIRST_STEP, variables=cache)[0] for _ in range(-(-WARM // COLD))]
    imports = [run_code(IMPORTS)[0] for _ in range(WARM)]
    rows: list[list[Cell]] = [
        ["cold cache", "10", statistics.median(cold), max(cold)],
        ["warm cache", "1.5", statistics.median(warm), max(warm)],
        ["imports alone", None, statistics.median(imports), max(imports)],
    ]
    columns = ["s", "target", "median", "longest"]
    yield Table("startup", "First gym.make, reset and step", columns, rows)
