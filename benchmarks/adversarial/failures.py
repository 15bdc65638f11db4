"""Failures, saved as JSON files that hold all that is needed to see them again.

A world's result depends on its seed, the number of its episode and the actions, not on the worlds
beside it. So these are saved, together with the scene and the fidelity in which it happened.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.adversarial.measured_runner import MeasuredRunner
from benchmarks.report.provenance import ROOT
from physics.scene.parameters import with_parameters

Array = np.ndarray

FOLDER = ROOT / ".failures"


class Failure(NamedTuple):
    """What went wrong in one world.

    Attributes:
        task: name of the task.
        preset: name of the fidelity.
        parameters: "scene" or "random", see `MeasuredRunner`.
        what: what went wrong.
        seed: of the world.
        episode: number of its episode.
        actions: of every step of the episode, [steps, actions]; it went wrong in the last one.
        scene: JSON text of the scene with the world's parameters.
        fidelity: JSON text.
    """

    task: str
    preset: str
    parameters: str
    what: str
    seed: int
    episode: int
    actions: list[list[float]]
    scene: str
    fidelity: str

    @classmethod
    def of(
        cls,
        runner: MeasuredRunner,
        names: tuple[str, str, str],
        what: str,
        world: int,
        actions: Array,
    ) -> "Failure":
        """The failure of a world, given task, preset and parameters, and its actions so far."""
        scene = runner.world.scene
        if runner.world.features.per_world_parameters:
            scene = with_parameters(scene, runner.world.parameters.pick([world]))
        return cls(
            *names, what, int(runner.seeds[world]), int(runner.episodes[world]), actions.tolist(),
            scene.to_json(), runner.world.fidelity.to_json(),
        )  # fmt: skip

    def save(self, name: str) -> Path:
        """Writes a file in the folder of failures."""
        FOLDER.mkdir(exist_ok=True)
        path = FOLDER / f"{name}.json"
        path.write_text(json.dumps(self._asdict(), indent=1) + "\n", encoding="utf-8")
        return path


def load(path: Path) -> Failure:
    """Reads a file of `Failure.save`.

    Raises:
        ValueError: not such a file.
    """
    content: Any = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(content, dict) or set(content) != set(Failure._fields):
        raise ValueError(f"{path} must hold a failure with the fields {list(Failure._fields)}")
    return Failure(**content)
