"""What features that a scene doesn't need cost: speed of wider kernels relative to the special one.

Push and Stack, balanced, with 4,096 worlds and with one, one thread. Rows add features to those
that the scene needs; those below the general kernel are in no general kernel. All kernels give the
same bits. Worlds take turns; figures are ratios of the fastest rounds, as other load can only add
time.
"""

from collections.abc import Iterator
from typing import Any

from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import Side, take_turns
from physics.model.features import BY_TABLE, Features, general
from physics.scene.fidelity import PRESETS
from physics.step.simulation import Simulation
from rigid_envs.tasks import Push, Stack

COUNTS = (4096, 1)
FRAME = 0.04  # s
ROUNDS, SECONDS = 7, 0.3

GENERAL = "general kernel"
# what is added: its name, and the features
ADDED: dict[str, dict[str, Any]] = {
    "rotation by a table": {"rotation": BY_TABLE},
    "slopes": {"slope": True},
    "contact beside the centre": {"lever": True},
    "balls and capsules": {"sphere": True, "capsule": True},
    "cylinders": {"cylinder": True, "axial": True},
    "compounds": {"compound": True},
    "meshes": {"mesh": True, "grid": True},
    "grippers": {"gripper": True},
    "fields": {"fields": True},
    "wrenches": {"wrench": True},
    GENERAL: {},
    "rolling and spinning resistance": {"resistance": True},
    "joints": {"joints": True},
    "tori and particles": {"torus": True, "particles": True},
}


class _Wider(Simulation):
    """A simulation whose kernel has given features beside those that its scene needs."""

    def __init__(self, *arguments: Any, added: dict[str, Any]) -> None:
        self._added = added
        super().__init__(*arguments)

    def _choose(self, kernel: str) -> Features:
        more = general(self.needed) if self._added is ADDED[GENERAL] else None
        return more or self.needed._replace(**self._added)


def measure() -> Iterator[Table]:
    """One table."""
    columns = ["features that are not needed", "target"]
    columns += [f"{task}, {count:,}" for task in ("Push", "Stack") for count in COUNTS]
    ratios: dict[str, list[float]] = {name: [] for name in ADDED}
    for task in (Push(), Stack()):
        for count in COUNTS:
            sides = {name: _side(task, count, added) for name, added in ADDED.items()}
            sides["special"] = _side(task, count, {})
            rates = {n: max(r) for n, r in take_turns(sides, ROUNDS, SECONDS).items()}
            for name in ADDED:
                ratios[name].append(rates[name] / rates["special"])
    rows: list[list[Cell]] = [
        [name, 0.75 if name == GENERAL else None, *found] for name, found in ratios.items()
    ]
    title = "Speed relative to the special kernel, balanced, one thread"
    yield Table("kernels", title, columns, rows)


def _side(task: Any, count: int, added: dict[str, Any]) -> Side:
    simulation = _Wider(task.scene(), PRESETS["balanced"], count, 1, False, added=added)
    for _ in range(5):
        simulation.advance(FRAME, simulation.everyone)

    def frame() -> int:
        simulation.advance(FRAME, simulation.everyone)
        return count

    return frame
