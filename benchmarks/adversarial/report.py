"""Results of chunks in a CSV file, and the table of all combinations."""

from collections.abc import Iterable
from pathlib import Path

from benchmarks.adversarial.chunk import Combination, Figures
from benchmarks.report.csv_file import append_rows, read_rows
from benchmarks.report.tables import Cell, Table

Key = tuple[Combination, int]
Results = dict[Key, Figures]

HEADER = [*Combination._fields, "chunk", *Figures._fields]
COLUMNS = [
    "task", "preset", "actions", "parameters", "million steps", "million episodes", "not finite",
    "sank", "escaped", "gained energy", "not bitwise", "lowest centre m", "deepest penetration m",
    "fastest m/s", "largest gain mJ", "gain over allowed", "s",
]  # fmt: skip
SUMMARY_COLUMNS = [
    "task", "preset", "parameters", "million steps", "million episodes", "not finite",
    "not bitwise", "sank", "escaped", "gained energy", "deepest penetration mm",
    "largest gain mJ",
]  # fmt: skip


def append(path: Path, combination: Combination, number: int, figures: Figures) -> None:
    """Adds a chunk to a file, which is created if it isn't there."""
    append_rows(path, HEADER, [[*combination, number, *figures]])


def load(path: Path) -> Results:
    """The chunks of a file; none if it isn't there.

    Raises:
        ValueError: not such a file.
    """
    results: Results = {}
    for row in read_rows(path, HEADER):
        names = Combination(*row[: len(Combination._fields)])
        number, *figures = row[len(Combination._fields) :]
        results[names, int(number)] = Figures(*map(float, figures))
    return results


def total(chunks: Iterable[Figures]) -> Figures:
    """Sums of counts, extremes of the others."""
    every = list(chunks)
    extremes = {"lowest": min, "deepest": max, "fastest": max, "gain": max, "gain_ratio": max}
    return Figures(
        **{
            name: float(extremes.get(name, sum)(getattr(chunk, name) for chunk in every))
            for name in Figures._fields
        }
    )


def table(results: Results) -> Table:
    """One row per combination, and the total."""
    combinations = list(dict.fromkeys(combination for combination, _ in results))
    rows: list[list[Cell]] = []
    for combination in combinations:
        own = [figures for (names, _), figures in results.items() if names == combination]
        rows.append([*combination, *_cells(total(own))])
    if results:
        rows.append(["all", "", "", "", *_cells(total(results.values()))])
    return Table("adversarial", "Hostile actions, resets and parameters", COLUMNS, rows)


def summary(results: Results) -> Table:
    """One row per task, preset and kind of parameters, and the total."""
    rows: list[list[Cell]] = []
    groups = dict.fromkeys((c.task, c.preset, c.parameters) for c, _ in results)
    for names in groups:
        own = (f for (c, _), f in results.items() if (c.task, c.preset, c.parameters) == names)
        rows.append([*names, *_brief(total(own))])
    rows.append(["all", "", "", *_brief(total(results.values()))])
    return Table("adversarial", "Hostile actions, resets and parameters", SUMMARY_COLUMNS, rows)


def _brief(figures: Figures) -> list[Cell]:
    return [
        figures.steps / 1e6, figures.episodes / 1e6, figures.not_finite, figures.different,
        figures.sank, figures.escaped, figures.gained, 1e3 * figures.deepest, 1e3 * figures.gain,
    ]  # fmt: skip


def _cells(figures: Figures) -> list[Cell]:
    return [
        figures.steps / 1e6, figures.episodes / 1e6, figures.not_finite, figures.sank,
        figures.escaped,
        figures.gained, figures.different, figures.lowest, figures.deepest, figures.fastest,
        1e3 * figures.gain, figures.gain_ratio, figures.seconds,
    ]  # fmt: skip
