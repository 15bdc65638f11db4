"""Measures trials: python -m benchmarks trade [trial ...] [--restart] [--errors CURVE]."""

import argparse
import math
from pathlib import Path
from time import perf_counter

from benchmarks.report.provenance import describe, provenance
from benchmarks.report.results_file import save
from benchmarks.trade import fronts, store
from benchmarks.trade.cost import maker, many_worlds, one_world
from benchmarks.trade.settings import Setting, options_text, ours, peers
from benchmarks.trade.trial import Trial, judge
from benchmarks.trade.trials import TRIALS
from benchmarks.trade.tuning_peer import tuned

ROUNDS = 2  # of timing; the faster one counts, as other load can only add time
# the second round leaves out settings that are so many times slower than one of their engine with
# no larger error: other load during the first round doesn't explain that
CLOSE = 2.0
WRONG = 1.0  # an error from which on a setting's cost means nothing


def settings(trial: Trial) -> list[Setting]:
    """All settings of a trial."""
    return [*ours(trial), *peers(trial, tuned)]


def measured(trial: Trial, path: Path) -> list[store.Row]:
    """Rows of a trial: first all errors, then the costs in rounds.

    What is measured is kept in a file beside `path` until the trial is complete; a run that was
    interrupted continues there.
    """
    chosen = {setting.key: setting for setting in settings(trial)}
    partial = store.Partial(path, trial.name)
    missing = [
        key
        for key, setting in chosen.items()
        if key not in partial.rows or partial.rows[key].options != options_text(setting.options)
    ]
    begin = perf_counter()
    for k, key in enumerate(missing):
        partial.add(_judged(trial, chosen[key]))
        _progress(trial, "errors", k + 1, len(missing), begin)
    for turn in range(ROUNDS):
        rows = partial.rows
        timed = [key for key in chosen if rows[key].error < WRONG]
        if turn > 0:
            close = fronts.close(rows.values(), CLOSE)
            timed = [key for key in timed if key in close]
        missing = [key for key in timed if partial.rounds[key] <= turn]
        begin = perf_counter()
        for k, key in enumerate(missing):
            options, row = chosen[key].options, partial.rows[key]
            one, many = one_world(trial, options), many_worlds(trial, options)
            partial.add(row._replace(one=_larger(row.one, one), many=_larger(row.many, many)))
            _progress(trial, f"costs, round {turn + 1}", k + 1, len(missing), begin)
    print()
    return [partial.rows[key] for key in chosen]


def _judged(trial: Trial, setting: Setting) -> store.Row:
    """The error of a setting, without its cost."""
    outcome = judge(trial, maker(setting.options, trial))
    return store.Row(
        trial.name, setting.engine, setting.curve, setting.label, options_text(setting.options),
        outcome.status, outcome.error, outcome.energy, outcome.penetration, math.nan, math.nan,
        outcome.note,
    )  # fmt: skip


def with_new_errors(trial: Trial, rows: list[store.Row], begins: str) -> list[store.Row]:
    """Rows of a trial with the errors of some of our curves measured again; costs stay.

    `begins`: with what the names of the curves begin.
    """
    chosen = {s.key: s for s in ours(trial) if s.curve.startswith(begins)}
    own = [row for row in rows if row.key in chosen]
    found, begin = {}, perf_counter()
    for k, row in enumerate(own):
        new = _judged(trial, chosen[row.key])
        if new.error < WRONG and math.isnan(row.one):
            print(f"\n{row.curve}, {row.label} has no cost yet: measure again with --restart")
        found[row.key] = new._replace(one=row.one, many=row.many)
        _progress(trial, "errors", k + 1, len(own), begin)
    print()
    return [found.get(row.key, row) for row in rows]


def _larger(before: float, rate: float) -> float:
    return rate if math.isnan(before) else max(before, rate)


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
    parser.add_argument(
        "--errors", metavar="CURVE",
        help="measure only errors again, of our curves whose names begin with this",
    )  # fmt: skip
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.trials if name not in TRIALS]:
        parser.error(f"unknown trial: {', '.join(unknown)}; known: {', '.join(TRIALS)}")
    run = provenance()
    print(describe(run))
    names = options.trials or list(TRIALS)
    rows = store.load(options.data)
    if options.restart:
        rows = [row for row in rows if row.trial not in names]
        store.replace_all(rows, options.data)
        for name in names:
            store.Partial(options.data, name).remove()
    done = {row.trial for row in rows}
    for name in names if options.errors else ():
        if name in done:
            own = [row for row in rows if row.trial == name]
            rows = [row for row in rows if row.trial != name]
            rows += with_new_errors(TRIALS[name], own, options.errors)
            store.replace_all(rows, options.data)
    for name in names if not options.errors else ():
        if name in done:
            print(f"{name}: is in {options.data.name}; --restart measures it again")
            continue
        store.append(measured(TRIALS[name], options.data), options.data)
        store.Partial(options.data, name).remove()
    order = list(TRIALS)
    rows = sorted(store.load(options.data), key=lambda row: order.index(row.trial))
    store.replace_all(rows, options.data)
    if options.data == store.PATH:
        save([fronts.ratios(rows, worlds) for worlds in fronts.WORLDS], run, keep=True)
        print(
            f"written: {store.PATH.name} and the tables of ratios; benchmarks.plots and "
            "benchmarks.pages write the pictures and pages"
        )
