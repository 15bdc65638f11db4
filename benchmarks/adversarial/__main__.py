"""Up to 10^9 steps with hostile actions, resets and parameters; prints what went wrong.

Push, Stack and Throw run at every preset with four kinds of actions: random ones; bang-bang, where
each component is at either limit; ramming, which drives hands against bodies, the ground and their
limits; and ramming with resets in the middle of episodes, mostly of worlds in contact. Each of
these runs with the parameters of the scene, and with masses of 10^-3 to 10^3 times those, friction
up to 10, any restitution, and sizes as far as they are accepted, drawn for each episode.

After every step, observations and rewards must be finite, no body may be below the ground, and no
world may have more energy than at the start of its episode, apart from the work of its servos. In a
sample of the chunks, the first 96 worlds must be bitwise equal to 96 worlds that one thread
advances by themselves. Failures are counted, and the first ones are saved in .failures/.

python -m benchmarks.adversarial [--steps 1e9] [--tasks push ...] [--presets fast ...]
    [--actions ramming ...] [--parameters scene ...] [--resume CSV] [--write]
python -m benchmarks.adversarial --replay FILE
"""

import argparse
from pathlib import Path
from time import perf_counter

from benchmarks.adversarial.actions import ACTIONS
from benchmarks.adversarial.chunk import KINDS, Combination, run_chunk
from benchmarks.adversarial.measured_runner import PARAMETERS
from benchmarks.adversarial.replay import replay
from benchmarks.adversarial.report import Results, append, load, summary, table
from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import save
from benchmarks.report.tables import plain

PRESETS = ("fast", "balanced", "accurate", "solid")
WORLDS = 4096
CHUNK = 500  # steps of all worlds, at most: 2 million
COMPARED = 5  # one chunk in so many is compared with a few worlds by themselves
# steps of a combination, roughly in proportion to its speed with the parameters of the scene
SHARES: dict[str, dict[str, float]] = {
    "push": {"fast": 24, "balanced": 24, "accurate": 2.5, "solid": 5},
    "stack": {"fast": 5, "balanced": 4, "accurate": 0.54, "solid": 0.35},
    "throw": {"fast": 24, "balanced": 20, "accurate": 3.5, "solid": 10},
}


def chunks_of(combinations: list[Combination], steps: float) -> list[tuple[Combination, int, int]]:
    """(combination, number of the chunk, steps of all worlds) that make up `steps` in all.

    All combinations advance in proportion, so that a run that is interrupted has tried each.
    """
    whole = sum(SHARES[c.task][c.preset] for c in combinations)
    chunks = []
    for combination in combinations:
        share = SHARES[combination.task][combination.preset] / whole
        count = max(1, round(share * steps / WORLDS))
        for number, first in enumerate(range(0, count, CHUNK)):
            chunks.append((first / count, (combination, number, min(CHUNK, count - first))))
    return [chunk for _, chunk in sorted(chunks, key=lambda pair: pair[0])]


def run(combinations: list[Combination], steps: float, path: Path | None) -> Results:
    """Runs all chunks that a resumed file doesn't hold, or holds with fewer steps."""
    results = load(path) if path else {}
    chunks = chunks_of(combinations, steps)
    left = [
        (combination, number, count)
        for combination, number, count in chunks
        if (combination, number) not in results
        or results[combination, number].steps < count * WORLDS
    ]
    todo, done, start = sum(count for _, _, count in left), 0, perf_counter()
    for combination, number, count in left:
        figures = run_chunk(combination, number, WORLDS, count, number % COMPARED == 0)
        results[combination, number] = figures
        if path:
            append(path, combination, number, figures)
        done += count
        spent = perf_counter() - start
        failures = "/".join(f"{getattr(figures, kind):.0f}" for kind in KINDS)
        print(
            f"{' '.join(combination)} {number}: {figures.steps / figures.seconds:,.0f} steps/s, "
            f"not finite/sank/escaped/gained/different {failures}, "
            f"gain {1e3 * figures.gain:.3g} mJ; "
            f"{100 * done / todo:.1f} %, {spent / done * (todo - done) / 60:.0f} min left",
            flush=True,
        )
    return results


def main() -> None:
    """Runs all combinations and prints the table, or replays a failure."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.adversarial", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--steps", type=float, default=1e7, help="of all combinations together")
    for name, values in (
        ("tasks", list(SHARES)),
        ("presets", PRESETS),
        ("actions", list(ACTIONS)),
        ("parameters", PARAMETERS),
    ):
        parser.add_argument(f"--{name}", nargs="+", choices=values, default=values)
    parser.add_argument("--resume", type=Path, metavar="CSV", help="chunks are appended to it")
    parser.add_argument("--write", action="store_true", help="keep the summary for the docs")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="of a saved failure")
    options = parser.parse_args()
    if options.replay:
        replay(options.replay)
        return
    this_run = provenance()
    print(describe(this_run))
    combinations = [
        Combination(task, preset, actions, parameters)
        for task in options.tasks
        for preset in options.presets
        for parameters in options.parameters
        for actions in options.actions
    ]
    results = run(combinations, options.steps, options.resume)
    print(plain(table(results)))
    if options.write:
        save([summary(results)], this_run, keep=True)


if __name__ == "__main__":
    main()
