"""Memory per world, without the model that all worlds share, in KB of 1,024 bytes.

State is World.nbytes. Resident is the growth of a process's memory from 1,024 to 16,384 worlds of
RigidEnvs/Push-v0 after one episode, divided by the number of added worlds; at that time, and at
the peak. Each number of worlds runs in its own process. Linux only: it reads /proc.
"""

import json
from collections.abc import Iterator

from benchmarks.report.processes import run_code
from benchmarks.report.provenance import THREADS
from benchmarks.report.tables import Cell, Table
from physics import PRESETS, World
from rigid_envs.tasks import Push

FEW, MANY = 1024, 16384
KB = 1024.0

EPISODE = """
import json, sys
import gymnasium as gym, numpy as np, rigid_envs
count, threads, fidelity = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
envs = gym.make_vec(
    "RigidEnvs/Push-v0", num_envs=count, reward_type="dense", fidelity=fidelity, threads=threads
)
envs.reset(seed=0)
for _ in range(51):
    envs.step(np.ones((count, 3), dtype=np.float32))
with open("/proc/self/status") as file:
    lines = [line.split() for line in file]
print(json.dumps({line[0]: int(line[1]) for line in lines if line[0] in ("VmRSS:", "VmHWM:")}))
"""


def _resident(count: int, fidelity: str) -> dict[str, float]:
    """Resident memory of a process with `count` worlds, now and at its peak, in KB."""
    found: dict[str, float] = json.loads(run_code(EPISODE, str(count), str(THREADS), fidelity)[1])
    return found


def measure() -> Iterator[Table]:
    """One table."""
    rows: list[list[Cell]] = []
    for preset in PRESETS:
        state = World(Push().scene(), preset, count=FEW).nbytes / KB
        few, many = _resident(FEW, preset), _resident(MANY, preset)
        growth = [(many[key] - few[key]) / (MANY - FEW) for key in ("VmRSS:", "VmHWM:")]
        rows.append([preset, "4", state, *growth])
    columns = ["KB per world", "target", "state", "resident", "resident at the peak"]
    yield Table("memory", f"Push, {FEW:,} to {MANY:,} worlds", columns, rows)
