"""The documentation's examples run as they stand, and its tables are those of the code."""

import re
from pathlib import Path

import gymnasium as gym
import pytest

from physics.tuning import tune as tuning
from rigid_envs import RigidEnv, RigidVectorEnv
from rigid_envs.episodes.arguments import argument_names
from rigid_envs.tasks import TASKS, PickAndPlace, Push, PushT, Reach, Slide, Stack, Throw

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
WITH_CODE = [page for page in PAGES if BLOCK.search(page.read_text())]


@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: page.name)
def test_the_code_of_a_page_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    (tmp_path / "results").symlink_to(ROOT / "results")
    # of all that `tune` tries on docs/trade.md: two kernels instead of six
    families = tuning.families
    monkeypatch.setattr(
        tuning,
        "families",
        lambda scene: [one for one in families(scene) if one.name in ("springs", "impulses")],
    )
    known = set(gym.registry)
    code = "\n".join(BLOCK.findall(page.read_text()))
    code = code.replace("learn(1_000_000)", "learn(51_200)")  # a round: enough to see that it runs
    try:
        exec(compile(code, str(page), "exec"), {"__name__": "page"})
    finally:
        for name in set(gym.registry) - known:
            del gym.registry[name]


def test_a_task_of_ones_own_takes_less_than_a_hundred_lines(capsys, tmp_path, monkeypatch):
    test_the_code_of_a_page_runs(ROOT / "docs" / "add-a-task.md", tmp_path, monkeypatch)
    assert "solved 100%" in capsys.readouterr().out
    task = BLOCK.findall((ROOT / "docs" / "add-a-task.md").read_text())[0]
    assert len(task.splitlines()) < 100


@pytest.mark.parametrize(
    "task",
    [PickAndPlace(), Push(), PushT(), Reach(), Slide(), Stack(2), Throw()],
    ids=lambda t: type(t).__name__,
)
def test_the_observation_table_has_a_row_for_every_index(task):
    text = (ROOT / "docs" / "environments" / f"{type(task).__name__.lower()}.md").read_text()
    found = re.findall(r"^\| (\d+) \| ([^|]+) \| ([^|]*) \| (\S+) to (\S+) \|$", text, re.MULTILINE)
    listed = [
        (int(i), name, unit.strip(), *(float(v.replace("−", "-")) for v in limits))
        for i, name, unit, *limits in found
    ]
    assert listed == [(i, *bound) for i, bound in enumerate(task.bounds)]


@pytest.mark.parametrize("task", TASKS.values(), ids=lambda t: t.__name__)
def test_the_table_of_arguments_names_every_argument(task):
    text = (ROOT / "docs" / "environments" / f"{task.__name__.lower()}.md").read_text()
    table = text[text.index("## Arguments") : text.index("## Action")]
    named = {name for row in re.findall(r"^\| (`[^|]*) \|", table, re.MULTILINE)
             for name in re.findall(r"`(\w+)`", row)}  # fmt: skip
    known = {*argument_names(task), *argument_names(RigidEnv), *argument_names(RigidVectorEnv)}
    assert named == known - {"task", "num_envs"}
