"""Compares this source tree with other commits: python -m benchmarks.commits COMMIT ...

By default it measures speed: Push, Stack and Throw with 4,096 worlds, dense reward and preset
balanced. Each commit runs in its own process; processes take turns of one episode, so that other
load on the machine hits all of them equally, and differences of a few percent show after a minute.
With --states it checks that the physics is unchanged: random episodes of each task and preset are
compared bit by bit, at every step.
"""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measure import commits
from benchmarks.report.provenance import THREADS, describe, provenance
from benchmarks.report.tables import plain


def run() -> None:
    """Prints a table per task, or with --states a table per commit."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.commits", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("commits", nargs="+", metavar="COMMIT")
    parser.add_argument("--states", action="store_true", help="compare episodes, not speed")
    parser.add_argument(
        "--tasks", nargs="+", choices=commits.TASKS, default=commits.TASKS, metavar="TASK",
        help=f"{', '.join(commits.TASKS)}; give it after the commits",
    )  # fmt: skip
    parser.add_argument(
        "--presets", nargs="+", choices=commits.PRESETS, default=commits.PRESETS, metavar="PRESET",
        help=f"of --states: {', '.join(commits.PRESETS)}",
    )  # fmt: skip
    parser.add_argument("--threads", type=int, default=THREADS, help="of speed")
    parser.add_argument("--worlds", type=int, default=commits.WORLDS, help="of speed")
    parser.add_argument(
        "--policies", action="store_true",
        help="speed in the states of the trained policies instead of with random actions",
    )  # fmt: skip
    parser.add_argument("--turns", type=int, help="episodes per commit and task, of speed")
    parser.add_argument(
        "--trees", type=Path, metavar="FOLDER",
        help="keep the unpacked commits with their compiled kernels there, for the next call",
    )  # fmt: skip
    options = parser.parse_args()
    print(f"{__doc__}\n{describe(provenance())}\n")
    with TemporaryDirectory() as temporary:
        folder = options.trees.resolve() if options.trees else Path(temporary)
        trees = commits.unpack(list(dict.fromkeys(options.commits)), folder)
        if options.states:
            tables = commits.states(trees, options.tasks, options.presets)
        else:
            tables = commits.speed(
                trees,
                options.threads,
                options.tasks,
                options.turns,
                options.worlds,
                options.policies,
            )
        for table in tables:
            print(plain(table) + "\n", flush=True)


if __name__ == "__main__":
    run()
