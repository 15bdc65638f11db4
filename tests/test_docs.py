"""The documentation's examples run as they stand, and its tables are those of the code."""

import re
from pathlib import Path

import gymnasium as gym
import pytest

import rigid_envs  # noqa: F401  (registers the ids)
from physics.tuning import tune as tuning

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
WITH_CODE = [page for page in PAGES if BLOCK.search(page.read_text())]


@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: page.name)
def test_the_code_of_a_page_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
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


@pytest.mark.parametrize("task", ["push", "stack", "throw"])
def test_the_observation_table_names_every_index_once(task):
    text = (ROOT / "docs" / "environments" / f"{task}.md").read_text()
    rows = re.findall(r"^\| (\d+)(?:–(\d+))? \|(?:[^|]*\|){3}$", text, re.MULTILINE)
    listed = [i for first, last in rows for i in range(int(first), int(last or first) + 1)]
    env = gym.make(f"RigidEnvs/{task.capitalize()}-v0")
    assert listed == list(range(env.observation_space["observation"].shape[0]))
