"""What all benchmarks share: the header, the tables, and sides that take turns."""

import os
import platform
import statistics
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

from physics.step.threads import default_threads

THREADS = 2  # of both sides, wherever threads are used
ROOT = Path(__file__).parent.parent
PACKAGES = ("numpy", "numba", "gymnasium", "mujoco")

Cell = str | float | None
Side = Callable[[], int]


class Table(NamedTuple):
    """Figures under a title. Cells are text, numbers, or None where there is nothing to measure."""

    name: str
    title: str
    columns: list[str]
    rows: list[list[Cell]]


def figure(cell: Cell) -> str:
    """A cell as text; numbers to three digits."""
    if cell is None:
        return "–"
    if isinstance(cell, str):
        return cell
    if cell != 0.0 and not 1e-3 <= abs(cell) < 1e9:
        return f"{cell:.1e}"
    rounded = float(f"{cell:.3g}")
    return f"{rounded:,.0f}" if abs(rounded) >= 100 else f"{rounded:g}"


def plain(table: Table) -> str:
    """A table in columns, for a terminal."""
    cells = [table.columns, *([figure(c) for c in row] for row in table.rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = ["  ".join([r[0].ljust(widths[0]), *map(str.rjust, r[1:], widths[1:])]) for r in cells]
    return "\n".join([table.title, lines[0], "-" * len(lines[0]), *lines[1:]])


def markdown(table: Table) -> str:
    """A table in Markdown."""
    cells = [table.columns, ["---", *["---:"] * (len(table.columns) - 1)]]
    cells += [[figure(c) for c in row] for row in table.rows]
    return "\n".join("| " + " | ".join(row) + " |" for row in cells)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _commit() -> str:
    def git(*words: str) -> str:
        run = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
        return run.stdout.strip() if run.returncode == 0 else ""

    head = git("rev-parse", "--verify", "--short=10", "HEAD")
    if not head:
        return "none"
    changed = git("status", "--porcelain", "--", "*.py", "pyproject.toml", "constraints.txt")
    return head + (" and changes" if changed else "")


def circumstances() -> dict[str, Any]:
    """Machine, versions and commit that figures belong to."""
    versions = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return {
        "date": date.today().isoformat(),
        "commit": _commit(),
        "machine": {
            "processor": _processor(),
            "system": f"{platform.system()} {platform.machine()}",
            "cores": default_threads(),
            "threads": THREADS,
            # above the cores in use, others are at work and times say little
            "load": round(os.getloadavg()[0], 2),
        },
        "versions": versions,
    }


def describe(now: dict[str, Any]) -> str:
    """Circumstances in two lines."""
    machine = now["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in now["versions"].items())
    return (
        f"{machine['processor']}, {machine['system']}: {machine['cores']} cores, "
        f"{machine['threads']} threads used, load {machine['load']}\n"
        f"{versions}; {now['date']}, commit {now['commit']}"
    )


def main(doc: str | None, measure: Callable[[], Iterator[Table]]) -> None:
    """Prints what is measured, the header, and each table as soon as it is known."""
    print(f"{doc}\n{describe(circumstances())}\n")
    for table in measure():
        print(plain(table) + "\n", flush=True)


def rate(side: Side, seconds: float) -> float:
    """Units a second of a side that does some work and returns how many units it was."""
    done, start = 0, perf_counter()
    while (spent := perf_counter() - start) < seconds:
        done += side()
    return done / spent


def take_turns(sides: Mapping[str, Side], rounds: int, seconds: float) -> dict[str, list[float]]:
    """Units a second of each side in each round; all sides have had a turn before the first."""
    for side in sides.values():
        side()
    rates: dict[str, list[float]] = {name: [] for name in sides}
    for _ in range(rounds):
        for name, side in sides.items():
            rates[name].append(rate(side, seconds))
    return rates


def against(rates: dict[str, list[float]], peer: str) -> list[list[Cell]]:
    """Rows: side, median rate, its ratio to the peer's, lowest and highest ratio of a round."""
    rows: list[list[Cell]] = []
    for name, mine in rates.items():
        ratios = [a / b for a, b in zip(mine, rates[peer], strict=True)]
        ratio = statistics.median(mine) / statistics.median(rates[peer])
        rows.append([name, statistics.median(mine), ratio, min(ratios), max(ratios)])
    return rows


def elsewhere(command: list[str | Path], tree: Path | None = None) -> Side:
    """A turn a call of a script that runs in a process of its own, and on the packages of a tree.

    For every line it reads the script takes a turn, then prints "steps" and how many they were. It
    ends when there are no more lines, so with this process.
    """
    env = {**os.environ, "PYTHONPATH": str(tree)} if tree else None
    process = subprocess.Popen(
        command, cwd=tree, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )

    def turn() -> int:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write("go\n")
        process.stdin.flush()
        for line in process.stdout:  # some engines print of their own
            if line.startswith("steps "):
                return int(line.split()[1])
        raise RuntimeError(f"{' '.join(map(str, command))} ended early")

    return turn


@contextmanager
def clocked(owner: type, name: str) -> Iterator[list[float]]:
    """Times every call of a method within the block, in s."""
    original = getattr(owner, name)
    spent: list[float] = []

    def timed(*args: Any, **kwargs: Any) -> Any:
        start = perf_counter()
        try:
            return original(*args, **kwargs)
        finally:
            spent.append(perf_counter() - start)

    setattr(owner, name, timed)
    try:
        yield spent
    finally:
        setattr(owner, name, original)


def fresh(code: str, *words: str, env: Mapping[str, str] | None = None) -> tuple[float, str]:
    """Runs Python code in a process of its own: its s from start to end, and what it printed."""
    start = perf_counter()
    run = subprocess.run(
        [sys.executable, "-c", code, *words],
        cwd=ROOT,
        env={**os.environ, **(env or {})},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return perf_counter() - start, run.stdout
