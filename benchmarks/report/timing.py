"""Rates of sides that take turns, so that other load on the machine hits all of them equally."""

import statistics
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from time import perf_counter
from typing import Any

from benchmarks.report.tables import Cell

# does some work and returns how many units it was
Side = Callable[[], int]


def rate(side: Side, seconds: float) -> float:
    """Units per second of a side that is called until `seconds` s have passed, at least once."""
    start = perf_counter()
    done = side()
    while (spent := perf_counter() - start) < seconds:
        done += side()
    return done / spent


def take_turns(sides: Mapping[str, Side], rounds: int, seconds: float) -> dict[str, list[float]]:
    """Units per second of each side in each round; every side is called once before the first."""
    for side in sides.values():
        side()
    rates: dict[str, list[float]] = {name: [] for name in sides}
    for _ in range(rounds):
        for name, side in sides.items():
            rates[name].append(rate(side, seconds))
    return rates


def ratios_to(peer: str, rates: Mapping[str, list[float]]) -> list[list[Cell]]:
    """Rows: side, median rate, ratio of the medians, lowest and highest ratio within a round."""
    rows: list[list[Cell]] = []
    for name, own in rates.items():
        ratios = [a / b for a, b in zip(own, rates[peer], strict=True)]
        ratio = statistics.median(own) / statistics.median(rates[peer])
        rows.append([name, statistics.median(own), ratio, min(ratios), max(ratios)])
    return rows


@contextmanager
def clocked(owner: type, name: str) -> Iterator[list[float]]:
    """Measures the duration of every call of a method within the block, in s."""
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
