"""Push's speed in this tree beside other commits: python -m benchmarks.commits COMMIT ...

Each commit is unpacked into a folder of its own, compiled there, and runs in a process of its own
with the packages that are installed here; processes take turns of an episode of 4,096 worlds at
balanced. What a machine does meanwhile hits all sides alike, so differences of a few percent show
after two minutes.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.report import ROOT, THREADS, Table, against, elsewhere, main, take_turns

ROUNDS, SECONDS = 120, 0.01  # an episode takes longer, so a turn is one
HERE = "this tree"
SCRIPT = Path(__file__).parent / "peers" / "push.py"


def unpack(commit: str, tree: Path) -> Path:
    """Puts the files of a commit into a new folder."""
    archive = subprocess.run(["git", "archive", commit], cwd=ROOT, capture_output=True)
    if archive.returncode:
        raise SystemExit(f"{commit!r} can't be had from {ROOT}: {archive.stderr.decode().strip()}")
    tree.mkdir()
    subprocess.run(["tar", "-x", "-C", tree], input=archive.stdout, check=True)
    return tree


def measure(commits: list[str], threads: int) -> Iterator[Table]:
    """One table: this tree and each commit, ratios to the first commit named."""
    with TemporaryDirectory() as folder:
        places = {commit: Path(folder) / str(n) for n, commit in enumerate(commits)}
        trees = {HERE: ROOT} | {commit: unpack(commit, at) for commit, at in places.items()}
        sides = {
            name: elsewhere([sys.executable, SCRIPT, str(threads)], tree)
            for name, tree in trees.items()
        }
        rates = take_turns(sides, ROUNDS, SECONDS)
    columns = ["env steps a second", "median", f"ratio to {commits[0]}", "lowest", "highest"]
    title = f"Push, balanced, 4,096 worlds, {threads} threads, {ROUNDS} turns of an episode each"
    yield Table("commits", title, columns, against(rates, commits[0]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("commits", nargs="+", metavar="COMMIT")
    parser.add_argument("--threads", type=int, default=THREADS)
    words = parser.parse_args()
    main(__doc__, partial(measure, list(dict.fromkeys(words.commits)), words.threads))
