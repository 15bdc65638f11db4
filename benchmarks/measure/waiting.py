"""What a new user waits for: the commands and programs that README, quick start and examples show.

The first run of each starts with an empty cache and compiles; the second one does not. Wall time,
interpreter and imports included, on idle cores; the packages are installed.
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.report.processes import run_code
from benchmarks.report.provenance import ROOT
from benchmarks.report.tables import Cell, Table

IMPORTS = "import gymnasium as gym\nimport rigid_envs\n"
COMMAND = "import sys\nfrom training.commands.cli import main\nsys.exit(main({words!r}.split()))\n"
COMMANDS = (
    "train --env RigidEnvs/PushDense-v0",
    "evaluate trained --env RigidEnvs/Push-v0",
    "record trained --env RigidEnvs/Throw-v0",
    "demo",
)


def measure() -> Iterator[Table]:
    """One table."""
    page, readme = (ROOT / "docs/quickstart.md").read_text(), (ROOT / "README.md").read_text()
    episode, trained = _blocks(page)[:2]
    programs = {
        "quick start: a first episode": episode,
        "quick start: a trained policy": IMPORTS + trained,
        "README: a million steps of PPO": IMPORTS + _blocks(readme)[1],
        "`python examples/ppo.py`": _script(ROOT / "examples/ppo.py"),
        "`examples/tour.ipynb`": _notebook(ROOT / "examples/tour.ipynb"),
    }
    rows = [_row(name, code) for name, code in programs.items()]
    rows += [_row(f"`rigid-envs {words}`", "", words) for words in COMMANDS]
    yield Table(
        "waiting", "What a new user waits for", ["what", "first run, s", "second run, s"], rows
    )


def _blocks(page: str) -> list[str]:
    """The Python programs of a page."""
    return re.findall(r"```python\n(.*?)```", page, re.DOTALL)


def _script(path: Path) -> str:
    return f"import runpy\nrunpy.run_path({str(path)!r}, run_name='__main__')\n"


def _notebook(path: Path) -> str:
    """The cells of a notebook; its figures are not shown."""
    cells = json.loads(path.read_text())["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    return "\n".join(["import matplotlib; matplotlib.use('agg')", *code])


def _row(name: str, code: str, words: str = "") -> list[Cell]:
    """Two runs of a program, or of a command that writes into a folder that goes away."""
    with TemporaryDirectory() as folder:
        if words:
            logs = "" if "record" in words or "evaluate" in words else f" -f {folder}/runs"
            output = f" -o {folder}/film.mp4" if "record" in words else ""
            code = COMMAND.format(words=words + logs + output)
        variables = {"NUMBA_CACHE_DIR": f"{folder}/cache", "RIGID_ENVS_KERNEL": None}
        return [name, *(run_code(code, variables=variables)[0] for _ in range(2))]
