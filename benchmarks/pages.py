"""Writes the saved figures into README.md and docs: python -m benchmarks.pages [table ...].

Figures in these pages come from benchmarks/results.json, which `python -m benchmarks --save`
writes. Everything between <!-- figures: NAME ... --> and <!-- /figures --> is replaced by the
tables of these names. With names of tables it prints them as Markdown instead.
"""

import argparse
import re
from collections.abc import Iterator

from benchmarks.report.provenance import ROOT, describe
from benchmarks.report.results_file import RESULTS, Saved, load
from benchmarks.report.summary import summary
from benchmarks.report.tables import Cell, Table, markdown
from benchmarks.trade import page as trade_page
from benchmarks.trade import store
from benchmarks.trade.trials import TRIALS
from physics.reference.promises import PROMISES

_DOCS = ("benchmarks", "trade", "stability", "training", "physics", "quickstart")
PAGES = (ROOT / "README.md", *(ROOT / "docs" / f"{name}.md" for name in _DOCS))
RUNS = "runs"  # in place of a table: what the tables of the page were measured on
SUMMARY, TRIALS_TABLE, PROMISES_TABLE = "summary", "trials", "promises"
_BLOCK = re.compile(r"(<!-- figures: ([^>]*?) -->\n).*?(<!-- /figures -->)", re.DOTALL)


def page_text(text: str, saved: Saved) -> str:
    """The text of a page with the saved tables in its blocks.

    Raises:
        SystemExit: A block names a table that is not saved.
    """
    named = [name for found in _BLOCK.finditer(text) for name in _names(found)]

    def block(found: re.Match[str]) -> str:
        parts = [
            _runs(saved, named) if name == RUNS else _titled(_table(saved, name))
            for name in _names(found)
        ]
        return found[1] + "\n".join(parts) + found[3]

    return _BLOCK.sub(block, text)


def _names(found: re.Match[str]) -> list[str]:
    """Names of a block; they are separated by commas, as a name may contain spaces."""
    return [name.strip() for name in found[2].split(",")]


def _table(saved: Saved, name: str) -> Table:
    if name == SUMMARY:
        return summary(saved)
    if name == TRIALS_TABLE:
        return trials_table()
    if name == PROMISES_TABLE:
        return promises_table()
    if name not in saved.tables:
        raise SystemExit(f"table {name!r} is not saved: run python -m benchmarks --save")
    # targets matter to those who change the code, not to the readers of a page
    table = saved.tables[name]
    for column in [name for name in table.columns if name.split()[0] == "target"]:
        table = table.without(column)
    return table._replace(rows=[row for row in table.rows if row[0] != "target"])


def trials_table() -> Table:
    """The scenes of the trade and what their errors are."""
    rows: list[list[Cell]] = [[t.name, t.title, t.error_of] for t in TRIALS.values()]
    return Table(TRIALS_TABLE, "Scenes", ["scene", "what happens", "error"], rows)


def promises_table() -> Table:
    """What each preset holds."""
    rows: list[list[Cell]] = [
        [name, float(p.cubes), 1e3 * p.sink, p.slide, p.restitution, p.creep]
        for name, p in PROMISES.items()
    ]
    columns = [
        "preset",
        "cubes that stand for 10 s, at least",
        "sink at rest, mm",
        "error of a slide",
    ]
    columns += ["error of restitution, ball", "creep on 20°, m/s"]
    return Table(PROMISES_TABLE, "Limits that each preset keeps, for cubes of 4 cm", columns, rows)


def _titled(table: Table) -> str:
    return f"{table.title}:\n\n{markdown(table)}\n"


def _runs(saved: Saved, names: list[str]) -> str:
    """The provenance of all tables of a page, each run once."""
    return "\n".join(_run_lines(saved, [name for name in names if name in saved.runs]))


def _run_lines(saved: Saved, names: list[str]) -> Iterator[str]:
    runs: list[tuple[str, list[str]]] = []
    for name in names:
        text = describe(saved.runs[name])
        known = next((tables for other, tables in runs if other == text), None)
        if known is None:
            runs.append((text, known := []))
        known.append(name)
    for text, tables in runs:
        which = "All tables" if len(runs) == 1 else ", ".join(f"`{name}`" for name in tables)
        first, second = text.splitlines()
        yield f"- {which}: {first}; {second}"
    yield ""


def run() -> None:
    """Writes the pages, or prints the tables named."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pages", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="table")
    options = parser.parse_args()
    saved = load()
    if not saved.tables:
        parser.exit(2, f"{RESULTS} does not exist: run python -m benchmarks --save\n")
    if unknown := [name for name in options.names if name not in saved.tables]:
        parser.error(f"unknown table: {', '.join(unknown)}; saved: {', '.join(saved.tables)}")
    for name in options.names:
        print(f"{_titled(saved.tables[name])}\n{describe(saved.runs[name])}\n")
    if options.names:
        return
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        page.write_text(page_text(text, saved), encoding="utf-8")
        print(f"written: {page.relative_to(ROOT)}")
    trade_page.PATH.write_text(trade_text(saved), encoding="utf-8")
    print(f"written: {trade_page.PATH.relative_to(ROOT)}")


def trade_text(saved: Saved) -> str:
    """The page docs/trade/compare.html of the measured trade."""
    run = describe(saved.runs["trade many"]).replace("\n", "; ")
    return trade_page.page(store.load(), TRIALS, run)


if __name__ == "__main__":
    run()
