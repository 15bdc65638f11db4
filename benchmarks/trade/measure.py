"""Measures trials: python -m benchmarks trade [trial ...] [--restart] [--data CSV]."""

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import save
from benchmarks.trade import fronts, store
from benchmarks.trade.cost import maker, many_worlds, one_world
from benchmarks.trade.settings import Setting, options_text, ours, peers
from benchmarks.trade.trial import Outcome, Trial, judge
from benchmarks.trade.trials import TRIALS
from benchmarks.trade.tuning_peer import tuned

ROUNDS = 2  # of timing; the faster one counts, as other load can only add time
WRONG = 1.0  # an error from which on a setting's cost means nothing


def settings(trial: Trial) -> list[Setting]:
    """All settings of a trial."""
    return [*ours(trial), *peers(trial, tuned)]


def measured(trial: Trial) -> Iterator[store.Row]:
    """Rows of a trial: first all errors, then the costs in rounds."""
    chosen = settings(trial)
    outcomes: dict[str, Outcome] = {}
    begin = perf_counter()
    for k, setting in enumerate(chosen):
        outcomes[setting.key] = judge(trial, maker(setting.options, trial))
        _progress(trial, "errors", k + 1, len(chosen), begin)
    worth = [s for s in chosen if outcomes[s.key].error < WRONG]
    rates = {setting.key: (0.0, 0.0) for setting in worth}
    begin = perf_counter()
    for turn in range(ROUNDS):
        for k, setting in enumerate(worth):
            one, many = rates[setting.key]
            one = max(one, one_world(trial, setting.options))
            many = max(many, many_worlds(trial, setting.options))
            rates[setting.key] = one, many
            _progress(trial, "costs", turn * len(worth) + k + 1, ROUNDS * len(worth), begin)
    print()
    for setting in chosen:
        outcome = outcomes[setting.key]
        one, many = rates.get(setting.key, (math.nan, math.nan))
        yield store.Row(
            trial.name, setting.engine, setting.curve, setting.label, options_text(setting.options),
            outcome.status, outcome.error, outcome.energy, outcome.penetration, one, many,
            outcome.note,
        )  # fmt: skip


def _progress(trial: Trial, what: str, done: int, count: int, begin: float) -> None:
    spent = perf_counter() - begin
    left = spent / done * (count - done)
    print(f"\r{trial.name}: {what} {done}/{count}, {left:4.0f} s left ", end="", flush=True)


def main(arguments: list[str]) -> None:
    """Measures the trials that the file doesn't hold yet, and appends their rows."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks trade", description=__doc__)
    parser.add_argument("trials", nargs="*", metavar="trial", help=", ".join(TRIALS))
    parser.add_argument("--data", type=Path, default=store.PATH, metavar="CSV")
    parser.add_argument("--restart", action="store_true", help="measure again what is in the file")
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.trials if name not in TRIALS]:
        parser.error(f"unknown trial: {', '.join(unknown)}; known: {', '.join(TRIALS)}")
    run = provenance()
    print(describe(run))
    names = options.trials or list(TRIALS)
    rows = store.load(options.data)
    if options.restart:
        rows = [row for row in rows if row.trial not in names]
        options.data.unlink(missing_ok=True)
        store.append(rows, options.data)
    done = {row.trial for row in rows}
    for name in names:
        if name in done:
            print(f"{name}: is in {options.data.name}; --restart measures it again")
            continue
        store.append(list(measured(TRIALS[name])), options.data)
    if options.data == store.PATH:
        rows = store.load()
        save([fronts.ratios(rows, worlds) for worlds in fronts.WORLDS], run, keep=True)
        print(
            f"written: {store.PATH.name} and the tables of ratios; benchmarks.plots and "
            "benchmarks.pages write the pictures and pages"
        )
