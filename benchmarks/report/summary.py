"""The few figures of README.md, taken from the saved tables."""

from benchmarks.report.results_file import Saved
from benchmarks.report.tables import Cell, Table

TASKS = ("push", "stack", "throw")
# where a policy is at work, and with random actions
TABLES = {"trained policy": "speed_policy_{}", "random actions": "speed_{}"}


def summary(saved: Saved) -> Table:
    """One row per task: rates of its vector environment, and their ratios to MuJoCo's rollout."""
    rows: list[list[Cell]] = []
    for task in TASKS:
        row: list[Cell] = [f"{task.capitalize()}-v0"]
        for name in TABLES.values():
            table = saved.tables[name.format(task)]
            own = next(row for row in table.rows if str(row[0]).startswith("RigidEnvs/"))
            ratio = next(column for column in table.columns if column.startswith("ratio to"))
            row += [own[table.columns.index("median")], own[table.columns.index(ratio)]]
        rows.append(row)
    machine = saved.runs[TABLES["trained policy"].format(TASKS[0])]["machine"]
    who = f"{machine['threads']} threads ({machine['processor']})"
    title = f"4,096 worlds, dense reward, preset `balanced`, {who}"
    columns = ["environment"]
    for label in TABLES:
        columns += [f"env steps/s, {label}", "ratio to MuJoCo rollout"]
    return Table("summary", title, columns, rows)
