"""Plots of learning curves, of one run or several seeds."""

import json
from pathlib import Path

import numpy as np
import pytest

from training.commands import cli
from training.results.plot import (
    EVALUATED,
    EXPLORING,
    SECONDS,
    STEPS,
    held,
    mean_and_spread,
    plot_learning_curves,
    read_curve,
)
from training.runs.run_folder import RunFolder, create_run_folder
from training.settings.config import TrainConfig
from training.settings.errors import UsageError

HEADER = "time/total_timesteps,time/wall_time,rollout/success_rate\n"


def learned(tmp_path: Path, config: TrainConfig, rows: str) -> RunFolder:
    """A run with the given learning curve."""
    folder = create_run_folder(tmp_path, config)
    folder.progress.write_text(HEADER + rows)
    return folder


@pytest.fixture
def seeds(tmp_path, quick_ppo) -> list[RunFolder]:
    """Three runs, of which the last one ends early."""
    curves = ("80,1,0.1\n160,2,0.5\n", "80,1.5,0.3\n160,3,0.9\n", "80,1.2,1.0\n")
    return [
        learned(tmp_path, quick_ppo.replace(seed=seed), rows) for seed, rows in enumerate(curves)
    ]


def test_mean_and_range_cover_the_common_range():
    lines = [([0.0, 2.0], [0.0, 20.0]), ([1.0, 3.0], [30.0, 50.0])]
    points, mean, lowest, highest = mean_and_spread(lines)
    assert (points[0], points[-1]) == (1.0, 2.0)
    np.testing.assert_allclose(lowest, 10 * points)
    np.testing.assert_allclose(highest, 20 + 10 * points)
    np.testing.assert_allclose(mean, 10 + 10 * points)


def test_a_run_that_ended_at_its_target_keeps_its_last_value_in_the_mean():
    lines = [(np.array([0.0, 2.0]), np.array([0.0, 96.0])), (np.array([0.0, 4.0]), [0.0, 95.0])]
    points, mean, _, _ = mean_and_spread(held(lines, {0.95}))
    assert points[-1] == 4.0
    assert mean[-1] == pytest.approx(95.5)
    assert mean_and_spread(held(lines, {0.97}))[0][-1] == 2.0  # it may have had fewer steps


def test_rows_of_evaluations_alone_and_rows_without_a_wall_time_are_kept(tmp_path):
    """SAC writes rows between updates; Stable-Baselines3's clock begins anew in a resumption."""
    path = tmp_path / "progress.csv"
    path.write_text(
        "time/total_timesteps,time/wall_time,time/time_elapsed,rollout/success_rate,"
        "eval/success_rate\n"
        "10,1.5,1,0.1,\n20,,3,0.2,\n30,,4,,0.5\n40,,1,0.6,\n50,7.25,2,0.7,0.9\n"
    )
    rows = read_curve(path)
    assert [row[SECONDS] for row in rows] == [1.5, 3.5, 4.5, 5.5, 7.25]
    assert rows[2]["eval/success_rate"] == 0.5
    assert "rollout/success_rate" not in rows[2]


@pytest.mark.parametrize("folder", sorted(Path("results").glob("*/*")), ids=lambda path: path.name)
def test_a_recorded_curve_ends_where_the_table_says(folder):
    recorded = json.loads((folder / "result.json").read_text())
    rows = read_curve(folder / "progress.csv")
    assert rows[-1][STEPS] == pytest.approx(recorded["steps"], rel=0.05)
    evaluated = [row[EVALUATED] for row in rows if EVALUATED in row]
    shown = evaluated[-1] if evaluated else rows[-1][EXPLORING]
    assert shown == pytest.approx(recorded["success_at_end"]["rate"], abs=0.1)


def test_lines_without_a_common_range_have_no_mean():
    assert mean_and_spread([([0.0, 1.0], [0, 1]), ([1.0, 2.0], [0, 1])]) is None


def test_plot_of_several_seeds_is_next_to_their_folders(seeds, tmp_path):
    for folders in (seeds, seeds[:2]):
        image = plot_learning_curves(folders)
        assert image == tmp_path / "ppo" / "Test-Reach-v0_learning_curves.png"
        assert image.read_bytes().startswith(b"\x89PNG")
        assert image.stat().st_size < 300_000


def test_command_accepts_one_run_or_several(seeds, tmp_path, capsys):
    words = ["plot", *(str(folder.path) for folder in seeds)]
    out = tmp_path / "curves" / "all.png"
    assert cli.main([*words, "-o", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    assert cli.main(words[:2]) == 0
    assert capsys.readouterr().out == f"{seeds[0].path / 'learning_curve.png'}\n"


def test_outputs_that_cannot_be_written_are_named(seeds, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for output, message in (("a.txt", "should end in .png"), ("file/a.png", "cannot be written")):
        assert cli.main(["plot", str(seeds[0].path), "-o", str(tmp_path / output)]) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1


def test_runs_that_differ_in_more_than_their_seed_raise(seeds, tmp_path, quick_ppo, quick_sac):
    rows = "80,1,0.1\n160,2,0.5\n"
    other = quick_ppo.replace(env_kwargs={"reward_type": "sparse"})
    sac = learned(tmp_path, quick_sac, rows)
    elsewhere = type(quick_ppo).from_mapping("RigidEnvs/Push-v0", quick_ppo.as_mapping(), "")
    for folder, complaint in (
        (sac, r"algorithm of .*sac.Test-Reach-v0_1 is 'sac', but .*ppo.Test-Reach-v0_1 has 'ppo'"),
        (learned(tmp_path, elsewhere, rows), "environment of .* is 'RigidEnvs/Push-v0', but"),
        (learned(tmp_path, other, rows), "env_kwargs of .*'sparse'.* differ only in their seed"),
        (seeds[0], "is given twice"),
    ):
        with pytest.raises(UsageError, match=complaint):
            plot_learning_curves([*seeds, folder])


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (None, "progress.csv is missing"),
        (HEADER, "no row with a success rate"),
        (HEADER + "80,one,0.5\n", r"progress\.csv is damaged"),
        ("\0\xff", r"progress\.csv"),
    ],
)
def test_run_without_a_learning_curve_raises(seeds, content, complaint):
    last = seeds[-1]
    last.progress.unlink()
    if content is not None:
        last.progress.write_text(content, encoding="latin-1")
    with pytest.raises(UsageError, match=rf"Test-Reach-v0_3.*{complaint}"):
        plot_learning_curves(seeds)
