"""Measures other values of a tuned number: python -m benchmarks.sweep NAME VALUE ...

NAME is a tuned number of `python -m benchmarks.numbers`. Each value is written into a copy of the
engine, which is compiled and measured by itself; that takes a minute or two per value. Columns:
largest errors of restitution, of a ball and of cubes that land on a face, an edge or a corner;
largest gain of energy of slim solids in grazing impacts; error of the velocity of a cube that
slides across a slope; slip of a box until it holds on a slope; error of a slide; drift of towers in
20 s, in m. At `solid`: the part of its time for which a ball stops bouncing too early; how fast a
ball in the ground leaves it; the speed that is left when a tower lands; how much farther a spinning
slab slides. All at `balanced`, or at the preset that is named.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measure.tuned import COLUMNS
from benchmarks.numbers import listed
from benchmarks.report.processes import run_in_tree
from benchmarks.report.provenance import ROOT, describe, provenance
from benchmarks.report.tables import Cell, Table, plain


def edited(name: str, value: str, folder: Path) -> Path:
    """A copy of the engine in which a number has another value.

    Raises:
        SystemExit: `name` is no tuned number that is assigned by itself, or `value` is no number.
    """
    files = {
        entry["where"].split(":")[1].lstrip("_"): entry["where"].split(":")[0]
        for entry in listed()["tuned"]
    }
    key = name.lstrip("_")
    if key not in files or not key.isupper():
        known = ", ".join(sorted(k for k in files if k.isupper()))
        raise SystemExit(f"{name} is not a tuned number that can be swept; these can: {known}")
    if not re.fullmatch(r"[0-9.e/+-]+", value):
        raise SystemExit(f"{value!r} is not a number: give one such as 0.5, 1e-3 or 1/3")
    for package in ("physics", "benchmarks"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / package, folder / package, ignore=ignored)
    path = folder / "physics" / files[key]
    text, found = re.subn(rf"(?m)^(_?{key} = ).*$", rf"\g<1>{value}", path.read_text())
    if found != 1:
        raise SystemExit(f"{path.name} does not set {name} once")
    path.write_text(text)
    return folder


def measure(name: str, value: str) -> list[Cell]:
    """The row of a value; None in all columns if the engine doesn't run with it."""
    with TemporaryDirectory() as temporary:
        tree = edited(name, value, Path(temporary))
        output = tree / "result.json"
        script = f"import runpy, sys; sys.stdout = open({str(output)!r}, 'w'); "
        script += "runpy.run_module('benchmarks.measure.tuned', run_name='__main__')"
        try:
            run_in_tree([sys.executable, "-c", script], tree)
        except subprocess.CalledProcessError:
            return [value, *[None] * len(COLUMNS)]
        return [value, *json.loads(output.read_text()).values()]


def run() -> None:
    """Prints a row for each value."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.sweep", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("values", nargs="+", metavar="VALUE")
    options = parser.parse_args()
    rows = [measure(options.name, value) for value in options.values]
    print(f"{describe(provenance())}\n")
    print(plain(Table("sweep", f"Values of {options.name}", ["value", *COLUMNS], rows)))


if __name__ == "__main__":
    run()
