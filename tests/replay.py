"""What failed, as a script that runs it again: `python .failures/<test>.py`."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from physics import Fidelity, Scene, SimulationDiverged, World

ROOT = str(Path(__file__).parent.parent)
FOLDER = Path(ROOT) / ".failures"

# physics' own names, for every repr in it is what builds the object
SCRIPT = '''"""{why}"""

import sys

sys.path.insert(0, {root!r})

from physics import *
from tests.replay import run

run({scene!r}, {fidelity!r}, {spans!r})
'''


def run(
    scene: Scene, fidelity: Fidelity, spans: list[float], tell: Callable[[str], object] = print
) -> None:
    """Advances a scene by spans in s, and tells each body's place and the energies."""
    world = World(scene, fidelity)
    for span in spans:
        world.advance(span)
        energy = world.kinetic_energy()[0] + world.potential_energy()[0]
        places = np.array2string(world.position[0], precision=6, separator=", ")
        tell(f"{world.time[0]:.6g} s  {energy:.6g} J  {places}")


@contextmanager
def replayable(name: str, scene: Scene, fidelity: Fidelity, spans: list[float]) -> Iterator[None]:
    """Writes a script if what is within fails; the smallest example is the last to be written."""
    try:
        yield
    except (AssertionError, SimulationDiverged) as error:
        FOLDER.mkdir(exist_ok=True)
        script = FOLDER / f"{name}.py"
        why = f"{name}: {str(error).splitlines()[0] if str(error) else type(error).__name__}"
        text = SCRIPT.format(
            root=ROOT, why=why.replace('"', "'"), scene=scene, fidelity=fidelity, spans=spans
        )
        script.write_text(text)
        error.add_note(f"replay it by: {sys.executable} {script}")
        raise
