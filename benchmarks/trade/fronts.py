"""Which setting is cheapest at an error, and where we are ahead of MuJoCo or behind."""

import math
from collections.abc import Collection, Iterable, Sequence

from benchmarks.report.tables import Cell, Table
from benchmarks.trade.settings import OURS, PEER
from benchmarks.trade.store import Row

ERRORS = (1e-1, 1e-2, 1e-3)
WORLDS = {"one": "one world", "many": "4,096 worlds"}


def rate(row: Row, worlds: str) -> float:
    """Simulated s per s of "one" world or of "many"."""
    return row.one if worlds == "one" else row.many


def cheapest(rows: Iterable[Row], engine: str, error: float, worlds: str) -> Row | None:
    """The fastest setting of an engine whose error is at most `error`; None if there is none."""
    good = [
        row
        for row in rows
        if row.engine == engine and row.error <= error and rate(row, worlds) > 0.0
    ]
    return max(good, key=lambda row: rate(row, worlds), default=None)


def front(rows: Iterable[Row], engine: str, worlds: str) -> list[Row]:
    """The settings of an engine that no other one of it beats in both error and speed."""
    best, found = math.inf, []
    timed = [row for row in rows if row.engine == engine and rate(row, worlds) > 0.0]
    for row in sorted(timed, key=lambda row: (-rate(row, worlds), row.error)):
        if row.error < best:
            best = row.error
            found.append(row)
    return found


def close(rows: Collection[Row], factor: float) -> set[tuple[str, str, str]]:
    """Keys of the settings that are less than `factor` times slower than any as accurate one.

    Either with one world or with many.
    """

    def beaten(row: Row, worlds: str) -> bool:
        return any(
            rate(other, worlds) >= factor * rate(row, worlds)
            for other in rows
            if other.engine == row.engine and other.error <= row.error
        )

    return {row.key for row in rows if not all(beaten(row, worlds) for worlds in WORLDS)}


def smallest(rows: Iterable[Row], engine: str) -> float:
    """Smallest error that an engine reaches; inf if it reaches none."""
    return min(
        (row.error for row in rows if row.engine == engine and row.error < math.inf),
        default=math.inf,
    )


def ratios(rows: Sequence[Row], worlds: str) -> Table:
    """Per trial: how many times as fast as MuJoCo at each error; and the smallest errors."""
    table: list[list[Cell]] = []
    for trial in dict.fromkeys(row.trial for row in rows):
        own = [row for row in rows if row.trial == trial]
        cells: list[Cell] = [trial]
        for error in ERRORS:
            ours, peer = (cheapest(own, engine, error, worlds) for engine in (OURS, PEER))
            if ours and peer:
                cells.append(rate(ours, worlds) / rate(peer, worlds))
            else:
                cells.append("ours only" if ours else "MuJoCo only" if peer else None)
        table.append([*cells, smallest(own, OURS), smallest(own, PEER)])
    columns = ["scene", *(f"error ≤ {error:g}" for error in ERRORS)]
    columns += ["our smallest error", "MuJoCo's"]
    title = f"Times as fast as MuJoCo's fastest setting with at most this error, {WORLDS[worlds]}"
    return Table(f"trade {worlds}", title, columns, table)
