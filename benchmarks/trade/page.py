"""docs/trade/compare.html: one self-contained page on which a reader compares settings."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.report.provenance import ROOT
from benchmarks.trade.store import Row
from benchmarks.trade.trial import Trial

PATH = ROOT / "docs" / "trade" / "compare.html"
TEMPLATE = Path(__file__).with_name("page.html")
_DATA, _END = "/*data*/", "/*end of data*/"


def page(rows: Sequence[Row], trials: dict[str, Trial], run: str) -> str:
    """The page of measured rows.

    Args:
        rows: of docs/trade/trade.csv.
        trials: by name, for titles.
        run: machine, versions and date of the measurement.
    """
    names = dict.fromkeys(row.trial for row in rows)
    data: dict[str, Any] = {
        "run": run,
        "trials": [
            {"name": name, "title": trials[name].title, "error": trials[name].error_of}
            for name in names
            if name in trials
        ],
        "rows": [[_value(cell) for cell in row] for row in rows],
        "columns": list(Row._fields),
    }
    text = TEMPLATE.read_text(encoding="utf-8")
    before, rest = text.split(_DATA)
    after = rest.split(_END)[1]
    return before + json.dumps(data, ensure_ascii=False, separators=(",", ":")) + after


def _value(cell: str | float) -> str | float | None:
    if isinstance(cell, float):
        return float(f"{cell:.4g}") if math.isfinite(cell) else None
    return cell
