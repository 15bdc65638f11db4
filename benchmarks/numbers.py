"""Counts the tuned numbers of the engine: python -m benchmarks.numbers.

It collects every numeric literal of physics/ by syntax tree. numbers.toml says of each whether it
is tuned; those that are not have a reason. The table of tuned numbers in docs/physics.md is written
from it with --write. `python -m benchmarks.sweep` measures other values of a tuned number.

Some literals need no entry:
- 0, 1, 2 and 1/2 within an expression: neutral elements, powers, halves; but not where such a
  number is all that a name is set to;
- subscripts, and arguments of `range`;
- the integers 3, 4, 6 and 9, likewise: components of a vector, a quaternion, a symmetric tensor, a
  matrix;
- physics/reference/ and physics/tuning/: scenes and measures, which no law reads.
"""

import argparse
import ast
import re
import tomllib
from collections import Counter, defaultdict
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeGuard

from benchmarks.report.provenance import ROOT
from benchmarks.report.tables import Table, markdown, plain

LIST = Path(__file__).with_suffix(".toml")
PAGE = ROOT / "docs" / "physics.md"
_NEUTRAL, _COMPONENTS = (0, 1, 2, 0.5), (3, 4, 6, 9)
_BLOCK = re.compile(r"(<!-- tuned numbers -->\n).*?(<!-- /tuned numbers -->)", re.DOTALL)


def literals(source: str) -> list[tuple[str, float]]:
    """(function or name that is assigned, value) of the literals that need an entry."""
    tree = ast.parse(source)
    parents = {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}
    found: list[tuple[str, float]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and _is_number(node.value):
            chain: list[Any] = [node]
            while chain[-1] in parents:
                chain.append(parents[chain[-1]])
            if not _needs_no_entry(chain):
                found.append((_place(chain), node.value))
    return found


def _is_number(value: object) -> TypeGuard[float]:
    return type(value) in (int, float)  # not a bool


def _needs_no_entry(chain: list[Any]) -> bool:
    """Whether a literal, the first of a chain of nodes each within the next, needs no entry."""
    value = chain[0].value
    for inner, outer in pairwise(chain):
        if isinstance(outer, ast.Subscript) and inner is outer.slice:
            return True
        if isinstance(outer, ast.Call) and getattr(outer.func, "id", "") == "range":
            return True
    whole, holder = chain[0], chain[1]
    if isinstance(holder, ast.UnaryOp):
        whole, holder = chain[1], chain[2]
    alone = isinstance(holder, ast.Assign | ast.AnnAssign) and holder.value is whole
    if alone and _is_lasting(chain):
        return False
    return value in _NEUTRAL or (type(value) is int and value in _COMPONENTS)


def _is_lasting(chain: list[Any]) -> bool:
    """Whether what it is assigned to is a constant of the module or a field of a class."""
    return not any(isinstance(node, ast.FunctionDef | ast.Lambda) for node in chain)


def _place(chain: list[Any]) -> str:
    """Function, or name at the top level of a module or class, that a literal stands in."""
    names = []
    for node in chain:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.append(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign) and _is_lasting(chain):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names.append(ast.unparse(targets[0]).strip("()"))
    return ".".join(reversed(names))


def collect() -> dict[str, Counter[float]]:
    """How often each value stands in each place, `path:name`, of the engine."""
    found: dict[str, Counter[float]] = defaultdict(Counter)
    for path in sorted((ROOT / "physics").rglob("*.py")):
        if not {"reference", "tuning"} & set(path.parts):
            name = path.relative_to(ROOT / "physics").as_posix()
            for place, value in literals(path.read_text()):
                found[f"{name}:{place}"][value] += 1
    return dict(found)


def listed() -> dict[str, list[dict[str, Any]]]:
    """The entries of numbers.toml: `tuned` and `other`."""
    return tomllib.loads(LIST.read_text())


def differences() -> list[str]:
    """What the code has and the list lacks, and the reverse."""
    expected: dict[str, Counter[float]] = defaultdict(Counter)
    entries = listed()
    for entry in (*entries["tuned"], *entries["other"]):
        values = entry["values"] if "values" in entry else [entry["value"]]
        for place in entry["where"] if isinstance(entry["where"], list) else [entry["where"]]:
            expected[place].update(values)
    actual, found = collect(), []
    for place in sorted({*expected, *actual}):
        new = actual.get(place, Counter()) - expected.get(place, Counter())
        gone = expected.get(place, Counter()) - actual.get(place, Counter())
        found += [f"{place}: {value!r} is not in {LIST.name}" for value in new.elements()]
        found += [f"{place}: {value!r} of {LIST.name} is not there" for value in gone.elements()]
    return found


def table() -> Table:
    """The tuned numbers."""
    rows = [
        [f"`{entry['where'].split(':')[1].lstrip('_')}`", entry["shown"], entry["meaning"],
         entry["reason"], f"`{entry['where'].split(':')[0]}`"]
        for entry in listed()["tuned"]
    ]  # fmt: skip
    return Table(
        "numbers", "Tuned numbers", ["name", "value", "meaning", "why this value", "file"], rows
    )


def page_text(text: str) -> str:
    """The text of the page with the present table."""
    return _BLOCK.sub(lambda found: f"{found[1]}{markdown(table())}\n{found[2]}", text)


def run() -> None:
    """Prints the table and how many there are; fails if the list and the code differ."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.numbers", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--write", action="store_true", help=f"writes the table into {PAGE.name}")
    options = parser.parse_args()
    print(plain(table()))
    entries = listed()
    others = sum(sum(count.values()) for count in collect().values()) - len(entries["tuned"])
    print(f"\n{len(entries['tuned'])} tuned numbers, {others} other literals with a reason")
    if options.write:
        PAGE.write_text(page_text(PAGE.read_text()))
    if found := differences():
        raise SystemExit("\n".join(found))


if __name__ == "__main__":
    run()
