"""Plots of learning curves, of one run or several seeds."""

from pathlib import Path

import numpy as np
import pytest

from training.commands import cli
from training.results.plot import mean_and_spread, plot_learning_curves
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
