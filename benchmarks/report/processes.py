"""Child processes: scripts that take turns, and Python code that runs in a fresh interpreter."""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter

from benchmarks.report.provenance import ROOT
from benchmarks.report.timing import Side

Command = Sequence[str | Path]

GRACE = 10.0  # s that a script has to end once its standard input is closed


@contextmanager
def child(command: Command, tree: Path | None = None) -> Iterator[Side]:
    """A side whose work is done by a script in its own process, which ends with the block.

    For every line on its standard input the script works for one turn, then prints "steps" and
    their number. It ends when its standard input is closed.

    Args:
        command: program and arguments.
        tree: working directory whose packages are imported before installed ones; None for the
            packages that the program itself finds.

    Raises:
        RuntimeError: The script ended during a turn.
    """
    process = subprocess.Popen(
        command, cwd=tree, env=_environment(tree),
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    stdin, stdout = process.stdin, process.stdout
    assert stdin is not None
    assert stdout is not None

    def turn() -> int:
        try:
            stdin.write("go\n")
            stdin.flush()
        except BrokenPipeError:
            pass  # reported below, as the script prints nothing more
        for line in stdout:  # some engines print messages of their own
            if line.startswith("steps "):
                return int(line.split()[1])
        raise RuntimeError(f"{' '.join(map(str, command))} ended during a turn")

    try:
        yield turn
    finally:
        try:
            process.communicate(timeout=GRACE)  # closes its standard input
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def run_in_tree(command: Command, tree: Path) -> None:
    """Runs a script on the packages of a tree, and waits for its end.

    Raises:
        subprocess.CalledProcessError: The script failed.
    """
    subprocess.run(command, cwd=tree, env=_environment(tree), check=True)


def run_code(
    code: str, *arguments: str, variables: Mapping[str, str | None] | None = None
) -> tuple[float, str]:
    """Runs Python code in a fresh interpreter.

    Args:
        code: the program.
        arguments: its arguments.
        variables: of the environment, beside those of this process; None removes one.

    Returns:
        Its duration in s, interpreter and imports included, and what it printed.

    Raises:
        subprocess.CalledProcessError: The code failed.
    """
    changed = {**os.environ, **(variables or {})}
    start = perf_counter()
    run = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=ROOT,
        env={name: value for name, value in changed.items() if value is not None},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return perf_counter() - start, run.stdout


def _environment(tree: Path | None) -> dict[str, str] | None:
    return {**os.environ, "PYTHONPATH": str(tree)} if tree else None
