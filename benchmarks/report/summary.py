"""The few figures of README.md, taken from the saved tables."""

from benchmarks.report.results_file import Saved
from benchmarks.report.tables import Cell, Table

TASKS = {"Push": "speed", "Stack": "speed_stack", "Throw": "speed_throw"}


def summary(saved: Saved) -> Table:
    """One row per task: rate of its vector environment, and its ratio to MuJoCo's rollout."""
    rows: list[list[Cell]] = []
    for task, name in TASKS.items():
        table = saved.tables[name]
        own = next(row for row in table.rows if str(row[0]).startswith("RigidEnvs/"))
        ratio = next(column for column in table.columns if column.startswith("ratio to"))
        position = table.columns.index(ratio)
        rows.append([f"{task}-v0", own[table.columns.index("median")], own[position]])
    machine = saved.runs["speed"]["machine"]
    who = f"{machine['threads']} threads ({machine['processor']})"
    title = f"4,096 worlds, dense reward, preset `balanced`, {who}"
    return Table("summary", title, ["environment", "env steps/s", "ratio to MuJoCo rollout"], rows)
