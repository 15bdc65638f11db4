"""panda-gym's PandaPush-v3 as a side, in a separate process with a separate interpreter."""

from contextlib import AbstractContextManager
from pathlib import Path

from benchmarks.report.processes import child
from benchmarks.report.timing import Side

PANDA = "panda-gym: PandaPush-v3"
SCRIPT = Path(__file__).parent / "panda_push.py"


def panda_side(python: Path, worlds: int = 1, pixels: int = 0) -> AbstractContextManager[Side]:
    """Each call takes about half a second; several worlds run in one process each.

    Args:
        python: interpreter that has panda-gym installed.
        worlds: 1 for gym.make, more for Gymnasium's AsyncVectorEnv.
        pixels: width and height of the picture that is drawn after each step; 0 for none.
    """
    return child([python, SCRIPT, "0.5", str(worlds), str(pixels)])
